/* glint examples [NAME] */
#include <stdio.h>

#include "cli/command.h"
#include "cli/examples.h"
#include "cli/exit.h"
#include "cli/output.h"
#include "core/base/json.h"

static void
print_row(const struct example *example)
{
    struct arena arena;
    arena_init(&arena, 0);
    struct error_list errors = {.arena = &arena};
    const struct json *root =
        json_read(example->text, example->len, NULL, &arena, &errors);
    const struct json *about = json_member(root, "description");
    const struct json *objects = json_member(root, "objects");
    if (about != NULL && about->type == JSON_STRING)
        printf("%-28s%s\n", example->name, about->string);
    else
        printf("%-28s%u object%s, no description\n", example->name,
               objects != NULL ? objects->count : 0,
               objects != NULL && objects->count == 1 ? "" : "s");
    arena_clear(&arena);
}

int
cmd_examples(const struct invocation *in)
{
    bool names = invocation_has(in, "names");
    for (size_t i = 0; in->arg_count == 0 && i < example_count; i++) {
        if (names)
            printf("%s\n", examples[i].name);
        else
            print_row(&examples[i]);
    }
    if (in->arg_count == 0)
        return STATUS_OK;

    const struct example *example = example_find(in->args[0]);
    if (example != NULL) {
        fwrite(example->text, 1, example->len, stdout);
        return STATUS_OK;
    }
    struct channel to = channel_open(stderr, invocation_has(in, "no-color"));
    const char *near = example_near(in->args[0]);
    if (near != NULL)
        say_error(&to, "glint examples",
                  "there is no example '%s', did you "
                  "mean '%s'?",
                  in->args[0], near);
    else
        say_error(&to, "glint examples",
                  "there is no example '%s'; 'glint "
                  "examples' lists them",
                  in->args[0]);
    return STATUS_USAGE;
}
