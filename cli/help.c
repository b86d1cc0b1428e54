#include "cli/help.h"

#include <ctype.h>
#include <string.h>

#include "cli/exit.h"

enum { WIDTH = 79, OPTION_INDENT = 26 };

static const struct {
    int number;
    const char *text;
} exits[] = {
#define X(name, number, text) {number, text},
    EXIT_TABLE(X)
#undef X
};

enum { EXIT_COUNT = sizeof exits / sizeof *exits };

static const struct {
    const char *name, *text;
} environment[] = {
    {"GLINT_SERVER", "the server to use where --server is not given"},
    {"GLINT_WORKER",
     "the worker program, where it does not stand beside glint"},
    {"NO_COLOR", "no colours, if it is not empty"},
    {"TERM", "'dumb' turns off colours and the progress bar"},
};

enum { ENVIRONMENT_COUNT = sizeof environment / sizeof *environment };

/* Words filled into lines. `column` is where the text starts now; further lines
 * start at `indent`. "\n\n" parts paragraphs. */
static void
put_filled(FILE *to, const char *text, int column, int indent)
{
    int at = column;
    bool fresh = true;
    while (*text != '\0') {
        if (text[0] == '\n') {
            fprintf(to, "\n\n%*s", indent, "");
            at = indent;
            fresh = true;
            text += strspn(text, "\n");
        }
        int len = (int)strcspn(text, " \n");
        if (!fresh && at + 1 + len > WIDTH) {
            fprintf(to, "\n%*s", indent, "");
            at = indent;
            fresh = true;
        }
        at += fprintf(to, "%s%.*s", fresh ? "" : " ", len, text);
        fresh = false;
        text += len;
        text += strspn(text, " ");
    }
    fputc('\n', to);
}

static void
put_option(FILE *to, const struct option *option)
{
    int at = option->letter != 0
                 ? fprintf(to, "  -%c, --%s", option->letter, option->name)
                 : fprintf(to, "      --%s", option->name);
    if (option->value != NULL)
        at += fprintf(to, " %s", option->value);
    if (at + 2 > OPTION_INDENT) {
        fputc('\n', to);
        at = 0;
    }
    fprintf(to, "%*s", OPTION_INDENT - at, "");
    put_filled(to, option->help, OPTION_INDENT, OPTION_INDENT);
}

static void
put_options(FILE *to, const struct option *options)
{
    for (; options->name != NULL; options++)
        put_option(to, options);
}

void
help_overview(FILE *to, const struct program *program)
{
    fprintf(to, "%s\n\nExamples\n", program->summary);
    for (size_t i = 0; i < program->command_count; i++)
        fprintf(to, "  %s\n", program->commands[i].examples[0].line);
    fprintf(to, "\nCommands\n");
    for (size_t i = 0; i < program->command_count; i++)
        fprintf(to, "  %-12s%s\n", program->commands[i].name,
                program->commands[i].summary);
    fprintf(to,
            "\n'%s help COMMAND' shows the options of a command, "
            "'%s help exit-codes'\nwhat the exit status says.\n",
            program->name, program->name);
}

void
help_command(FILE *to, const struct program *program,
             const struct command *command)
{
    fprintf(to, "%s %s: %s\n\nExamples\n", program->name, command->name,
            command->summary);
    for (const struct command_example *e = command->examples; e->line; e++)
        fprintf(to, "  %s\n      %s\n", e->line, e->what);
    fprintf(to, "\nUsage\n  %s %s%s%s%s\n\n", program->name, command->name,
            *command->arguments ? " " : "", command->arguments,
            command->options->name ? " [options]" : "");
    put_filled(to, command->about, 0, 0);
    fprintf(to, "\nOptions\n");
    put_options(to, command->options);
    put_options(to, program->common);
}

void
help_exit_codes(FILE *to)
{
    fprintf(to, "The exit status of glint\n\n");
    for (size_t i = 0; i < EXIT_COUNT; i++) {
        int at = fprintf(to, "  %3d  ", exits[i].number);
        put_filled(to, exits[i].text, at, at);
    }
}

/* ---- docs/cli.md ---- */

static void
markdown_options(FILE *to, const struct option *options)
{
    for (; options->name != NULL; options++) {
        fputs("| `", to);
        if (options->letter != 0)
            fprintf(to, "-%c`, `", options->letter);
        fprintf(to, "--%s%s%s` | %s |\n", options->name,
                options->value ? " " : "", options->value ? options->value : "",
                options->help);
    }
}

static void
markdown_command(FILE *to, const struct program *program,
                 const struct command *command)
{
    fprintf(to, "\n## %s %s%s%s\n\n%c%s.\n\n```sh\n", program->name,
            command->name, *command->arguments ? " " : "", command->arguments,
            toupper((unsigned char)*command->summary), command->summary + 1);
    for (const struct command_example *e = command->examples; e->line; e++)
        fprintf(to, "%s   # %s\n", e->line, e->what);
    fprintf(to, "```\n\n%s\n", command->about);
    if (command->options->name != NULL) {
        fprintf(to, "\n| Option | Does |\n|---|---|\n");
        markdown_options(to, command->options);
    }
}

void
help_markdown(FILE *to, const struct program *program)
{
    fprintf(to,
            "<!-- Written by `ninja cli_docs` from the table in cli/main.c; a "
            "test compares them. -->\n# The command line\n\n%s. Data goes to "
            "standard output, messages go to standard error.\n\n"
            "| Command | Does |\n|---|---|\n",
            program->summary);
    for (size_t i = 0; i < program->command_count; i++)
        fprintf(to, "| `%s` | %s |\n", program->commands[i].name,
                program->commands[i].summary);
    fprintf(to, "\nEvery command knows these too:\n\n"
                "| Option | Does |\n|---|---|\n");
    markdown_options(to, program->common);
    for (size_t i = 0; i < program->command_count; i++)
        markdown_command(to, program, &program->commands[i]);
    fprintf(to, "\n## Exit status\n\n| Status | Says |\n|---|---|\n");
    for (size_t i = 0; i < EXIT_COUNT; i++)
        fprintf(to, "| %d | %s |\n", exits[i].number, exits[i].text);
    fprintf(to, "\n## Environment\n\n| Variable | Does |\n|---|---|\n");
    for (size_t i = 0; i < ENVIRONMENT_COUNT; i++)
        fprintf(to, "| `%s` | %s |\n", environment[i].name,
                environment[i].text);
}

/* ---- docs/man/glint.1 ---- */

/* troff reads a leading . or ' as a request, \ as an escape, - as a hyphen. */
static void
man_text(FILE *to, const char *text)
{
    if (*text == '.' || *text == '\'')
        fputs("\\&", to);
    for (; *text != '\0'; text++) {
        if (*text == '\\')
            fputs("\\e", to);
        else if (*text == '-')
            fputs("\\-", to);
        else if (*text == '\'')
            fputs("\\(aq", to);
        else if (*text == '\n') {
            fputs("\n.PP\n", to);
            text += strspn(text, "\n") - 1;
        } else
            fputc(*text, to);
    }
}

static void
man_tagged(FILE *to, const char *tag, const char *text)
{
    fputs(".TP\n.B ", to);
    man_text(to, tag);
    fputc('\n', to);
    man_text(to, text);
    fputc('\n', to);
}

static void
man_options(FILE *to, const struct option *options)
{
    for (; options->name != NULL; options++) {
        char tag[96], letter[8] = "";
        if (options->letter != 0)
            snprintf(letter, sizeof letter, "-%c, ", options->letter);
        snprintf(tag, sizeof tag, "%s--%s%s%s", letter, options->name,
                 options->value ? " " : "",
                 options->value ? options->value : "");
        man_tagged(to, tag, options->help);
    }
}

static void
man_command(FILE *to, const struct program *program,
            const struct command *command)
{
    fprintf(to, ".SS \"%s %s %s\"\n", program->name, command->name,
            command->arguments);
    man_text(to, command->about);
    fputc('\n', to);
    man_options(to, command->options);
    for (const struct command_example *e = command->examples; e->line; e++) {
        fputs(".PP\nExample, ", to);
        man_text(to, e->what);
        fputs(":\n.PP\n.RS\n.nf\n", to);
        man_text(to, e->line);
        fputs("\n.fi\n.RE\n", to);
    }
}

void
help_man(FILE *to, const struct program *program, const char *version)
{
    fprintf(to,
            ".\\\" Written by `ninja cli_docs` from the table in cli/main.c.\n"
            ".TH GLINT 1 \"\" \"Glint %s\" \"User commands\"\n"
            ".SH NAME\nglint \\- render scenes to pictures\n"
            ".SH SYNOPSIS\n.B glint\n.I COMMAND\n[\\fIARGUMENTS\\fR] "
            "[\\fIOPTIONS\\fR]\n.SH DESCRIPTION\n",
            version);
    man_text(to, program->summary);
    fputs(". Data goes to standard output, messages go to standard error.\n"
          ".SH COMMANDS\n",
          to);
    for (size_t i = 0; i < program->command_count; i++)
        man_command(to, program, &program->commands[i]);
    fputs(".SH \"COMMON OPTIONS\"\n", to);
    man_options(to, program->common);
    fputs(".SH \"EXIT STATUS\"\n", to);
    for (size_t i = 0; i < EXIT_COUNT; i++) {
        char number[16];
        snprintf(number, sizeof number, "%d", exits[i].number);
        man_tagged(to, number, exits[i].text);
    }
    fputs(".SH ENVIRONMENT\n", to);
    for (size_t i = 0; i < ENVIRONMENT_COUNT; i++)
        man_tagged(to, environment[i].name, environment[i].text);
    fputs(".SH \"SEE ALSO\"\n.BR glintd (1)\n", to);
}

/* ---- bash ---- */

static void
bash_choices(FILE *to, const struct option *options)
{
    for (; options->name != NULL; options++) {
        if (options->choices == NULL)
            continue;
        fprintf(to, "        --%s)\n            words='", options->name);
        for (size_t i = 0; options->choices[i] != NULL; i++)
            fprintf(to, "%s%s", i > 0 ? " " : "", options->choices[i]);
        fprintf(to, "' ;;\n");
    }
}

static void
bash_command(FILE *to, const struct program *program,
             const struct command *command)
{
    fprintf(to, "    %s)\n        case $before in\n", command->name);
    bash_choices(to, command->options);
    fprintf(to, "        *)\n            words='");
    const struct option *lists[] = {command->options, program->common};
    for (size_t i = 0; i < 2; i++) {
        for (const struct option *o = lists[i]; o->name != NULL; o++)
            fprintf(to, "--%s ", o->name);
    }
    for (size_t i = 0;
         command->argument_choices && command->argument_choices[i]; i++)
        fprintf(to, "%s ", command->argument_choices[i]);
    if (command->run == cmd_help) {
        for (size_t i = 0; i < program->command_count; i++)
            fprintf(to, "%s ", program->commands[i].name);
        fprintf(to, "exit-codes ");
    }
    fprintf(to, "' ;;\n        esac ;;\n");
}

void
help_bash(FILE *to, const struct program *program)
{
    fprintf(to,
            "# bash completion for %s; written by '%s completion bash'\n"
            "_%s() {\n"
            "    local word=${COMP_WORDS[COMP_CWORD]}\n"
            "    local before=${COMP_WORDS[COMP_CWORD-1]}\n"
            "    local words=\n"
            "    if [ \"$COMP_CWORD\" -eq 1 ]; then\n"
            "        words='",
            program->name, program->name, program->name);
    for (size_t i = 0; i < program->command_count; i++)
        fprintf(to, "%s ", program->commands[i].name);
    fprintf(to, "'\n    else\n    case ${COMP_WORDS[1]} in\n");
    for (size_t i = 0; i < program->command_count; i++)
        bash_command(to, program, &program->commands[i]);
    fprintf(to,
            "    esac\n"
            "    fi\n"
            "    if [ \"${COMP_WORDS[1]}\" = examples ] && "
            "[ \"$COMP_CWORD\" -eq 2 ]; then\n"
            "        words=\"$words $(%s examples --names 2>/dev/null)\"\n"
            "    fi\n"
            "    mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$word\")\n"
            "}\n"
            "complete -o default -F _%s %s\n",
            program->name, program->name, program->name);
}
