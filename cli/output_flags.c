#include "cli/output_flags.h"

#include <string.h>
#include <strings.h>

#include "core/base/json_write.h"

/* "png", "exr", or NULL: what the file name says. */
static const char *
format_of_path(const char *path)
{
    static const char *const endings[] = {"png", "exr"};
    const char *name = strrchr(path, '/');
    const char *dot = strrchr(name != NULL ? name : path, '.');
    for (size_t i = 0; dot != NULL && i < 2; i++) {
        if (strcasecmp(dot + 1, endings[i]) == 0)
            return endings[i];
    }
    return NULL;
}

bool
output_flags_check(const struct invocation *in, const char *path,
                   struct error *err)
{
    const char *asked = invocation_value(in, "format");
    const char *named = format_of_path(path);
    if (asked == NULL && named == NULL && strcmp(path, "-") != 0)
        return error_set(err, ERROR_USAGE,
                         "'%.200s' does not say a format: end it in .png or "
                         ".exr, or give --format",
                         path);
    if (asked != NULL && named != NULL && strcmp(asked, named) != 0)
        return error_set(err, ERROR_USAGE,
                         "'%.200s' and --format %s contradict each other", path,
                         asked);
    return true;
}

/* A member of the job's own output, as it stands in its text. */
static void
put_own(struct json_writer *w, const struct document *document,
        const char *name)
{
    const struct json *m = json_member(document->output_root, name);
    if (m != NULL)
        json_put_raw(w, name, document->text.data + m->begin,
                     m->end - m->begin);
}

static void
put_layers(struct json_writer *w, const struct invocation *in)
{
    json_begin_array(w, "layers");
    for (size_t i = 0; i < in->given_count; i++) {
        if (strcmp(in->given[i].option->name, "layer") == 0)
            json_put_string(w, NULL, in->given[i].value);
    }
    json_end_array(w);
}

/* The merged settings as an output document, for the one reader of those. */
static void
merge(const struct invocation *in, const char *path,
      const struct document *document, struct bytes *text)
{
    struct json_writer w = {.out = text};
    const struct json *own = json_member(document->output_root, "format");
    const char *own_format =
        own != NULL && own->type == JSON_STRING ? own->string : "png";
    const char *format = invocation_value(in, "format");
    if (format == NULL)
        format = format_of_path(path);
    if (format == NULL)
        format = own_format;
    bool own_counts = strcmp(format, own_format) == 0;

    json_begin_object(&w, NULL);
    json_put_string(&w, "format", format);
    if (invocation_has(in, "layer"))
        put_layers(&w, in);
    else
        put_own(&w, document, "layers");
    static const char *const pairs[][2] = {{"bit-depth", "bit_depth"},
                                           {"color-space", "color_space"}};
    for (size_t i = 0; i < 2; i++) {
        const char *given = invocation_value(in, pairs[i][0]);
        if (given != NULL)
            json_put_string(&w, pairs[i][1], given);
        else if (own_counts)
            put_own(&w, document, pairs[i][1]);
    }
    json_end_object(&w);
}

/* "/bit_depth" -> "--bit-depth". */
static const char *
option_of(const char *pointer)
{
    static const char *const pairs[][2] = {
        {"/layers", "--layer"},
        {"/bit_depth", "--bit-depth"},
        {"/color_space", "--color-space"},
    };
    for (size_t i = 0; pointer != NULL && i < 3; i++) {
        if (strncmp(pointer, pairs[i][0], strlen(pairs[i][0])) == 0)
            return pairs[i][1];
    }
    return "-o";
}

bool
output_flags_read(const struct invocation *in, const char *path,
                  const struct document *document, struct output *output,
                  struct error *err)
{
    struct bytes text = {0};
    struct arena arena;
    arena_init(&arena, 0);
    struct error_list errors = {.arena = &arena};

    merge(in, path, document, &text);
    const struct json *root =
        json_read(text.data ? text.data : "", text.len, NULL, &arena, &errors);
    bool ok = root != NULL && output_read(root, output, &errors);
    if (!ok) {
        const struct error_item *first = &errors.items[0];
        error_set(err, ERROR_USAGE, "%s: %s%s%s", option_of(first->pointer),
                  first->detail, first->hint ? "; " : "",
                  first->hint ? first->hint : "");
    }
    bytes_clear(&text);
    arena_clear(&arena);
    return ok;
}
