/* command.h - the one table of commands, and a command line read by it.
 *
 * Parser, help, manual page, bash completion and docs/cli.md all follow from
 * the rows in main.c; a command is one row there and one cmd_*.c. Rows are
 * constant; an invocation points into argv and lives as long as main. */
#ifndef CLI_COMMAND_H
#define CLI_COMMAND_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/error.h"

struct invocation;

struct option {
    const char *name;  /* "output"; NULL ends a list */
    const char *value; /* "FILE"; NULL: a switch */
    const char *help;  /* lower case, no full stop */
    const char *const
        *choices;  /* the allowed values, NULL at the end; or NULL */
    long min, max; /* min < max: a whole number in that range */
    char letter;   /* 'o', or 0 */
    bool repeatable;
};

struct command_example {
    const char *line; /* NULL ends a list */
    const char *what;
};

struct command {
    const char *name;
    const char *arguments; /* "SCENE", "FILES...", or "" */
    const char *summary;   /* one line of the overview */
    const char *about;     /* paragraphs, parted by an empty line */
    const struct command_example *examples;
    const struct option *options;
    size_t min_args, max_args;
    /* The values its arguments may have, for completion, or NULL. */
    const char *const *argument_choices;
    int (*run)(const struct invocation *in); /* gives an enum status */
};

struct program {
    const char *name, *summary;
    const struct command *commands;
    size_t command_count;
    const struct option *common; /* options of every command */
};

struct given {
    const struct option *option;
    const char *value; /* NULL for a switch */
};

struct invocation {
    const struct program *program;
    const struct command *command; /* NULL: only common options came */
    struct given *given;           /* in the order written */
    size_t given_count;
    const char **args;
    size_t arg_count;
};

/* Read argv[1 ...]. False: ERROR_USAGE with a sentence that names the word and,
 * where one is near, what was meant. Options and arguments may be mixed; "--"
 * ends the options; "-" is an argument. Clear it in either case. */
bool
invocation_read(struct invocation *in, const struct program *program, int argc,
                char **argv, struct error *err);
void
invocation_clear(struct invocation *in);

/* The last value given, or NULL; whether a switch was given. The name must be
 * one of the command's options or a common one. */
const char *
invocation_value(const struct invocation *in, const char *name);
bool
invocation_has(const struct invocation *in, const char *name);
long
invocation_integer(const struct invocation *in, const char *name,
                   long otherwise);

const struct command *
command_find(const struct program *program, const char *name);

/* The commands, one cmd_*.c each. */
int
cmd_render(const struct invocation *in);
int
cmd_lint(const struct invocation *in);
int
cmd_examples(const struct invocation *in);
int
cmd_version(const struct invocation *in);
int
cmd_health(const struct invocation *in);
int
cmd_help(const struct invocation *in);
int
cmd_completion(const struct invocation *in);

#endif
