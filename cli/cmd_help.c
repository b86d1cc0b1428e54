/* glint help [COMMAND|exit-codes] */
#include <stdio.h>
#include <string.h>

#include "cli/command.h"
#include "cli/exit.h"
#include "cli/help.h"
#include "cli/output.h"
#include "core/base/isa.h"
#include "core/base/json.h"

static int
unknown(const struct invocation *in, const char *topic)
{
    const char *names[64];
    size_t count = 0;
    for (; count < in->program->command_count && count < 63; count++)
        names[count] = in->program->commands[count].name;
    names[count++] = "exit-codes";
    const char *near = json_did_you_mean(topic, names, count);
    struct channel to = channel_open(stderr, invocation_has(in, "no-color"));
    if (near != NULL)
        say_error(&to, "glint help",
                  "there is no help on '%s', did you mean "
                  "'%s'?",
                  topic, near);
    else
        say_error(&to, "glint help",
                  "there is no help on '%s'; 'glint help' "
                  "lists the commands",
                  topic);
    return STATUS_USAGE;
}

int
cmd_help(const struct invocation *in)
{
    const char *format = invocation_value(in, "format");
    if (format != NULL && strcmp(format, "markdown") == 0) {
        help_markdown(stdout, in->program);
        return STATUS_OK;
    }
    if (format != NULL && strcmp(format, "man") == 0) {
        help_man(stdout, in->program, glint_version);
        return STATUS_OK;
    }
    if (in->arg_count == 0) {
        help_overview(stdout, in->program);
        return STATUS_OK;
    }
    if (strcmp(in->args[0], "exit-codes") == 0) {
        help_exit_codes(stdout);
        return STATUS_OK;
    }
    const struct command *command = command_find(in->program, in->args[0]);
    if (command == NULL)
        return unknown(in, in->args[0]);
    help_command(stdout, in->program, command);
    return STATUS_OK;
}
