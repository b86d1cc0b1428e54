/* glint version */
#include <stdio.h>

#include "cli/command.h"
#include "cli/exit.h"
#include "core/base/isa.h"
#include "core/base/json_write.h"

int
cmd_version(const struct invocation *in)
{
    char isa[ISA_SIZE];
    isa_class(isa);
    if (!invocation_has(in, "json")) {
        printf("glint %s\nbuild %s\nisa   %s\n", glint_version, glint_build,
               isa);
        return STATUS_OK;
    }
    struct bytes out = {0};
    struct json_writer w = {.out = &out};
    json_begin_object(&w, NULL);
    json_put_string(&w, "version", glint_version);
    json_put_string(&w, "core_version", glint_version);
    json_put_string(&w, "build", glint_build);
    json_put_string(&w, "isa", isa);
    json_end_object(&w);
    printf("%s\n", out.data);
    bytes_clear(&out);
    return STATUS_OK;
}
