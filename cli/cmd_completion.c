/* glint completion bash */
#include <stdio.h>
#include <string.h>

#include "cli/command.h"
#include "cli/exit.h"
#include "cli/help.h"
#include "cli/output.h"

int
cmd_completion(const struct invocation *in)
{
    if (strcmp(in->args[0], "bash") == 0) {
        help_bash(stdout, in->program);
        return STATUS_OK;
    }
    struct channel to = channel_open(stderr, invocation_has(in, "no-color"));
    say_error(&to, "glint completion",
              "there is a script for bash, none for "
              "'%s'",
              in->args[0]);
    return STATUS_USAGE;
}
