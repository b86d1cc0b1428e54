#include "cli/command.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json.h"
#include "core/base/must.h"

enum {
    NAMES_MAX = 64 /* commands, or options of one command */
};

const struct command *
command_find(const struct program *program, const char *name)
{
    for (size_t i = 0; i < program->command_count; i++) {
        if (strcmp(program->commands[i].name, name) == 0)
            return &program->commands[i];
    }
    return NULL;
}

static bool
no_such_command(const struct program *program, const char *word,
                struct error *err)
{
    const char *names[NAMES_MAX];
    MUST(program->command_count <= NAMES_MAX);
    for (size_t i = 0; i < program->command_count; i++)
        names[i] = program->commands[i].name;
    const char *near = json_did_you_mean(word, names, program->command_count);
    if (near != NULL)
        return error_set(err, ERROR_USAGE,
                         "there is no command '%.60s', did you mean '%s'?",
                         word, near);
    return error_set(err, ERROR_USAGE,
                     "there is no command '%.60s'; '%s help' lists them", word,
                     program->name);
}

/* Both lists of options as one sequence: the command's, then the common ones. */
static const struct option *
option_at(const struct invocation *in, size_t index)
{
    if (in->command != NULL) {
        for (const struct option *o = in->command->options; o->name; o++) {
            if (index-- == 0)
                return o;
        }
    }
    for (const struct option *o = in->program->common; o->name; o++) {
        if (index-- == 0)
            return o;
    }
    return NULL;
}

static const struct option *
option_find(const struct invocation *in, const char *name, size_t len)
{
    const struct option *o;
    for (size_t i = 0; (o = option_at(in, i)) != NULL; i++) {
        if (strlen(o->name) == len && memcmp(o->name, name, len) == 0)
            return o;
    }
    return NULL;
}

static bool
no_such_option(const struct invocation *in, const char *word, size_t len,
               struct error *err)
{
    const char *names[NAMES_MAX];
    size_t count = 0;
    const struct option *o;
    while ((o = option_at(in, count)) != NULL) {
        MUST(count < NAMES_MAX);
        names[count++] = o->name;
    }
    char typed[64];
    if (len >= sizeof typed)
        len = sizeof typed - 1;
    memcpy(typed, word, len);
    typed[len] = '\0';
    const char *near = json_did_you_mean(typed, names, count);
    if (near != NULL)
        return error_set(err, ERROR_USAGE,
                         "there is no option --%s, did you mean --%s?", typed,
                         near);
    if (in->command == NULL)
        return error_set(err, ERROR_USAGE,
                         "there is no option --%s; '%s help' lists what there "
                         "is",
                         typed, in->program->name);
    return error_set(err, ERROR_USAGE,
                     "there is no option --%s; '%s help %s' lists what there "
                     "is",
                     typed, in->program->name, in->command->name);
}

/* One of the choices, or an error that lists them. */
static bool
choice_check(const struct option *option, const char *value, struct error *err)
{
    struct bytes list = {0};
    size_t count = 0;
    bool ok = false;
    for (; option->choices[count] != NULL; count++) {
        if (strcmp(option->choices[count], value) == 0)
            ok = true;
        bytes_printf(&list, "%s%s", count > 0 ? ", " : "",
                     option->choices[count]);
    }
    const char *near = json_did_you_mean(value, option->choices, count);
    if (!ok && near != NULL)
        error_set(err, ERROR_USAGE, "--%s knows no '%.60s', did you mean '%s'?",
                  option->name, value, near);
    else if (!ok)
        error_set(err, ERROR_USAGE, "--%s takes one of %s, got '%.60s'",
                  option->name, list.data ? list.data : "", value);
    bytes_clear(&list);
    return ok;
}

static bool
value_check(const struct option *option, const char *value, struct error *err)
{
    if (option->choices != NULL)
        return choice_check(option, value, err);
    if (option->min < option->max) {
        char *end;
        errno = 0;
        long number = strtol(value, &end, 10);
        if (end == value || *end != '\0' || errno != 0 ||
            number < option->min || number > option->max)
            return error_set(err, ERROR_USAGE,
                             "--%s takes a whole number from %ld to %ld, got "
                             "'%.60s'",
                             option->name, option->min, option->max, value);
    }
    if (*value == '\0')
        return error_set(err, ERROR_USAGE, "--%s needs a %s, got nothing",
                         option->name, option->value);
    return true;
}

static bool
take(struct invocation *in, const struct option *option, const char *value,
     struct error *err)
{
    if (option->value != NULL && !value_check(option, value, err))
        return false;
    for (size_t i = 0; i < in->given_count; i++) {
        if (in->given[i].option == option && option->value != NULL &&
            !option->repeatable)
            return error_set(err, ERROR_USAGE,
                             "--%s is given twice: '%.60s' and '%.60s'",
                             option->name, in->given[i].value, value);
    }
    in->given[in->given_count++] = (struct given){option, value};
    return true;
}

/* "--name", "--name=value" or "--name" "value". `next` is the word after it, or
 * NULL; *used tells whether that was taken. */
static bool
read_long(struct invocation *in, const char *word, const char *next, bool *used,
          struct error *err)
{
    const char *name = word + 2;
    const char *equals = strchr(name, '=');
    size_t len = equals ? (size_t)(equals - name) : strlen(name);
    const struct option *option = option_find(in, name, len);
    if (option == NULL)
        return no_such_option(in, name, len, err);
    if (option->value == NULL) {
        if (equals != NULL)
            return error_set(err, ERROR_USAGE, "--%s takes no value",
                             option->name);
        return take(in, option, NULL, err);
    }
    if (equals != NULL)
        return take(in, option, equals + 1, err);
    if (next == NULL)
        return error_set(err, ERROR_USAGE, "--%s needs a %s", option->name,
                         option->value);
    *used = true;
    return take(in, option, next, err);
}

/* "-q", "-oFILE", "-o" "FILE", "-qo" "FILE". */
static bool
read_letters(struct invocation *in, const char *word, const char *next,
             bool *used, struct error *err)
{
    for (const char *c = word + 1; *c != '\0'; c++) {
        const struct option *option = NULL, *o;
        for (size_t i = 0; (o = option_at(in, i)) != NULL; i++) {
            if (o->letter == *c)
                option = o;
        }
        if (option == NULL)
            return error_set(err, ERROR_USAGE,
                             "there is no option -%.1s in "
                             "'%.60s'",
                             c, word);
        if (option->value == NULL) {
            if (!take(in, option, NULL, err))
                return false;
            continue;
        }
        if (c[1] != '\0')
            return take(in, option, c + 1, err);
        if (next == NULL)
            return error_set(err, ERROR_USAGE, "-%c needs a %s", *c,
                             option->value);
        *used = true;
        return take(in, option, next, err);
    }
    return true;
}

static bool
count_check(const struct invocation *in, struct error *err)
{
    const struct command *command = in->command;
    if (command == NULL || invocation_has(in, "help"))
        return true;
    if (in->arg_count < command->min_args)
        return error_set(err, ERROR_USAGE, "an argument is missing: %s %s %s",
                         in->program->name, command->name, command->arguments);
    if (in->arg_count > command->max_args)
        return error_set(err, ERROR_USAGE,
                         "'%.60s' is one argument too many: "
                         "%s %s %s",
                         in->args[command->max_args], in->program->name,
                         command->name, command->arguments);
    return true;
}

bool
invocation_read(struct invocation *in, const struct program *program, int argc,
                char **argv, struct error *err)
{
    size_t room = 1;
    for (int i = 1; i < argc; i++)
        room += strlen(argv[i]) + 1; /* one word may hold many letters */
    *in = (struct invocation){.program = program};
    in->given = calloc(room, sizeof *in->given);
    in->args = calloc((size_t)argc + 1, sizeof *in->args);
    if (in->given == NULL || in->args == NULL)
        return error_set(err, ERROR_MEMORY, "no memory for the command line");

    bool only_args = false;
    for (int i = 1; i < argc; i++) {
        const char *word = argv[i];
        const char *next = i + 1 < argc ? argv[i + 1] : NULL;
        bool used = false;
        if (!only_args && strcmp(word, "--") == 0) {
            only_args = true;
        } else if (!only_args && word[0] == '-' && word[1] == '-') {
            if (!read_long(in, word, next, &used, err))
                return false;
        } else if (!only_args && word[0] == '-' && word[1] != '\0') {
            if (!read_letters(in, word, next, &used, err))
                return false;
        } else if (in->command == NULL) {
            in->command = command_find(program, word);
            if (in->command == NULL)
                return no_such_command(program, word, err);
        } else {
            in->args[in->arg_count++] = word;
        }
        if (used)
            i++;
    }
    return count_check(in, err);
}

void
invocation_clear(struct invocation *in)
{
    free(in->given);
    free(in->args);
    *in = (struct invocation){0};
}

const char *
invocation_value(const struct invocation *in, const char *name)
{
    MUST(option_find(in, name, strlen(name)) != NULL);
    for (size_t i = in->given_count; i-- > 0;) {
        if (strcmp(in->given[i].option->name, name) == 0)
            return in->given[i].value;
    }
    return NULL;
}

bool
invocation_has(const struct invocation *in, const char *name)
{
    MUST(option_find(in, name, strlen(name)) != NULL);
    for (size_t i = 0; i < in->given_count; i++) {
        if (strcmp(in->given[i].option->name, name) == 0)
            return true;
    }
    return false;
}

long
invocation_integer(const struct invocation *in, const char *name,
                   long otherwise)
{
    const char *value = invocation_value(in, name);
    return value != NULL ? strtol(value, NULL, 10) : otherwise;
}
