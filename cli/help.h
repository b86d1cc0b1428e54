/* help.h - the table of commands as text for people: help pages, docs/cli.md,
 * the manual page, a completion script. All of it is derived; nothing is said
 * here that the rows do not say. One thread. */
#ifndef CLI_HELP_H
#define CLI_HELP_H

#include <stdio.h>

#include "cli/command.h"

void
help_overview(FILE *to, const struct program *program);

/* Examples first, then usage, then options. */
void
help_command(FILE *to, const struct program *program,
             const struct command *command);
void
help_exit_codes(FILE *to);

/* docs/cli.md and docs/man/glint.1, whole. */
void
help_markdown(FILE *to, const struct program *program);
void
help_man(FILE *to, const struct program *program, const char *version);

void
help_bash(FILE *to, const struct program *program);

#endif
