#include "server/api/examples.h"

#include <string.h>

#include "core/base/json_write.h"

static const char folder[] = "schemas/examples/";

enum { EXAMPLES_MAX = 256 };

const struct file *
example_find(const char *name)
{
    struct bytes path = {0};
    const struct file *file = NULL;

    if (!strchr(name, '/')) {
        bytes_printf(&path, "%s%s.json", folder, name);
        file = path.failed ? NULL : file_find(path.data);
    }
    bytes_clear(&path);
    return file;
}

const struct file *
example_at(size_t i, struct arena *arena, const char **name)
{
    size_t at = file_first(folder) + i, skip = strlen(folder);

    if (at >= file_count || strncmp(files[at].name, folder, skip) != 0)
        return NULL;
    *name = arena_strndup(arena, files[at].name + skip,
                          strlen(files[at].name) - skip - strlen(".json"));
    return &files[at];
}

const char *
json_quoted(const char *text, struct arena *arena)
{
    struct bytes out = {0};
    struct json_writer w = {.out = &out};
    const char *quoted;

    json_put_string(&w, NULL, text);
    quoted = arena_strdup(arena, out.data ? out.data : "\"\"");
    bytes_clear(&out);
    return quoted;
}

static const struct json *
refuse_name(const struct json *named, struct error_list *errors)
{
    struct arena *arena = errors->arena;
    const char *names[EXAMPLES_MAX], *near, *hint, *fix = NULL;
    const char *pointer = json_pointer(named, arena);
    size_t n = 0;

    while (n < EXAMPLES_MAX && example_at(n, arena, &names[n]))
        n++;
    near = json_did_you_mean(named->string, names, n);
    hint = "GET /v1/scenes/examples lists them";
    if (near) {
        hint = arena_printf(arena, "Did you mean '%s'?", near);
        fix = arena_printf(
            arena, "[{\"op\":\"replace\",\"path\":\"%s\",\"value\":\"%s\"}]",
            pointer, near);
    }
    error_list_add(errors, ERROR_REFERENCE_UNKNOWN, pointer, named->line,
                   named->column, hint, fix, "there is no example %s",
                   json_describe(named, arena));
    return NULL;
}

const struct json *
example_read(const struct json *node, const struct json *named,
             struct error_list *errors, const char **name)
{
    struct arena *arena = errors->arena;
    const struct json *member;
    const struct file *file;

    for (member = node->child; member; member = member->next)
        if (member != named)
            error_list_add(errors, ERROR_PROPERTY_UNKNOWN,
                           json_pointer(member, arena), member->key_line,
                           member->key_column,
                           "beside $example there is nothing else", NULL,
                           "unknown property '%.64s'", member->key);
    if (named->type != JSON_STRING) {
        error_list_add(errors, ERROR_TYPE_MISMATCH, json_pointer(named, arena),
                       named->line, named->column, NULL, NULL,
                       "must be a string, got %s", json_describe(named, arena));
        return NULL;
    }
    file = example_find(named->string);
    if (!file)
        return refuse_name(named, errors);
    *name = named->string;
    return json_read((const char *)file->data, file->len, NULL, arena, errors);
}
