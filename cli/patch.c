#include "cli/patch.h"

#include <string.h>

#include "core/base/json.h"
#include "core/base/json_write.h"

/* What is left of a pointer while it is followed. */
struct walk {
    const char *whole;     /* the pointer as given */
    const char *rest;      /* "/radius" or "" */
    const struct json *at; /* the value reached */
};

static size_t
line_breaks(const char *text, size_t len)
{
    size_t count = 0;
    for (size_t i = 0; i < len; i++) {
        if (text[i] == '\n' ||
            (text[i] == '\r' && (i + 1 == len || text[i + 1] != '\n')))
            count++;
    }
    return count;
}

void
patch_splice(struct bytes *text, size_t begin, size_t end, const char *value,
             size_t value_len)
{
    struct bytes out = {0};
    size_t breaks = line_breaks(text->data + begin, end - begin);

    bytes_append(&out, text->data, begin);
    for (size_t i = 0; i < value_len; i++)
        bytes_append(&out,
                     value[i] == '\n' || value[i] == '\r' ? " " : value + i, 1);
    for (size_t i = 0; i < breaks; i++)
        bytes_append(&out, "\n", 1);
    bytes_append(&out, text->data + end, text->len - end);
    bytes_clear(text);
    *text = out;
}

/* The next token of the pointer, ~1 and ~0 undone; NULL if malformed. */
static char *
next_token(struct walk *walk, struct arena *arena)
{
    const char *from = walk->rest + 1;
    size_t len = strcspn(from, "/");
    char *token = arena_strndup(arena, from, len);
    if (token == NULL)
        return NULL;
    char *to = token;
    for (const char *c = token; *c != '\0'; c++) {
        if (*c == '~' && c[1] != '0' && c[1] != '1')
            return NULL;
        if (*c == '~')
            *to++ = *++c == '1' ? '/' : '~';
        else
            *to++ = *c;
    }
    *to = '\0';
    walk->rest = from + len;
    return token;
}

static bool
is_index(const char *token)
{
    return *token != '\0' && strspn(token, "0123456789") == strlen(token) &&
           (token[0] != '0' || token[1] == '\0');
}

/* The pointer up to the token just read, for messages. */
static const char *
so_far(const struct walk *walk, struct arena *arena)
{
    const char *text =
        arena_strndup(arena, walk->whole, (size_t)(walk->rest - walk->whole));
    return text != NULL ? text : walk->whole;
}

/* Wrap `value` into objects for the tokens that are left: "/b/c" and 1 give
 * {"b":{"c":1}}. */
static bool
wrap(struct walk *walk, const char *value, struct arena *arena,
     struct bytes *out, struct error *err)
{
    size_t depth = 0;
    while (*walk->rest != '\0') {
        char *token = next_token(walk, arena);
        if (token == NULL)
            return error_set(err, ERROR_USAGE,
                             "'%.100s' is no JSON pointer: after ~ comes 0 or "
                             "1",
                             walk->whole);
        if (is_index(token) || strcmp(token, "-") == 0)
            return error_set(err, ERROR_NOT_FOUND,
                             "%.200s does not exist: there is no array to hold "
                             "it",
                             so_far(walk, arena));
        struct json_writer w = {.out = out};
        bytes_text(out, "{");
        json_put_string(&w, NULL, token);
        bytes_text(out, ": ");
        depth++;
    }
    bytes_text(out, value);
    while (depth-- > 0)
        bytes_text(out, "}");
    return true;
}

/* Behind the last child of a container, or behind its opening bracket. */
static void
append(struct bytes *text, const struct json *container, const char *item,
       size_t len)
{
    const struct json *last = container->child;
    while (last != NULL && last->next != NULL)
        last = last->next;
    size_t at = last != NULL ? last->end : container->begin + 1;
    struct bytes glued = {0};
    bytes_text(&glued, last != NULL ? ", " : "");
    bytes_append(&glued, item, len);
    patch_splice(text, at, at, glued.data, glued.len);
    bytes_clear(&glued);
}

static bool
make_member(struct bytes *text, struct walk *walk, const char *token,
            const char *value, struct arena *arena, struct error *err)
{
    struct bytes item = {0};
    struct json_writer w = {.out = &item};
    json_put_string(&w, NULL, token);
    bytes_text(&item, ": ");
    bool ok = wrap(walk, value, arena, &item, err);
    if (ok)
        append(text, walk->at, item.data, item.len);
    bytes_clear(&item);
    return ok;
}

static bool
follow_array(struct bytes *text, struct walk *walk, const char *token,
             const char *value, struct arena *arena, bool *made,
             struct error *err)
{
    if (strcmp(token, "-") == 0 && *walk->rest == '\0') {
        append(text, walk->at, value, strlen(value));
        *made = true;
        return true;
    }
    if (!is_index(token))
        return error_set(err, ERROR_NOT_FOUND,
                         "%.200s does not exist: its parent is an array, "
                         "which is asked by number",
                         so_far(walk, arena));
    const struct json *child = NULL;
    if (strlen(token) < 9) {
        unsigned index = 0;
        for (const char *c = token; *c != '\0'; c++)
            index = index * 10 + (unsigned)(*c - '0');
        child = walk->at->child;
        while (child != NULL && index-- > 0)
            child = child->next;
    }
    if (child == NULL)
        return error_set(err, ERROR_NOT_FOUND,
                         "%.200s does not exist: the array has %u %s",
                         so_far(walk, arena), walk->at->count,
                         walk->at->count == 1 ? "element" : "elements");
    walk->at = child;
    return true;
}

/* Follow the pointer and splice. `value` is JSON. */
static bool
put(struct bytes *text, struct walk *walk, const char *value,
    struct arena *arena, const char **place, struct error *err)
{
    while (*walk->rest != '\0') {
        char *token = next_token(walk, arena);
        if (token == NULL)
            return error_set(err, ERROR_USAGE,
                             "'%.100s' is no JSON pointer: after ~ comes 0 or "
                             "1",
                             walk->whole);
        *place = so_far(walk, arena);
        bool made = false;
        if (walk->at->type == JSON_ARRAY) {
            if (!follow_array(text, walk, token, value, arena, &made, err))
                return false;
        } else if (walk->at->type == JSON_OBJECT) {
            const struct json *child = json_member(walk->at, token);
            made = child == NULL;
            if (made && !make_member(text, walk, token, value, arena, err))
                return false;
            walk->at = child;
        } else {
            return error_set(err, ERROR_NOT_FOUND,
                             "%.200s does not exist: its parent is %s, which "
                             "has no members",
                             *place, json_describe(walk->at, arena));
        }
        if (made)
            return true;
    }
    patch_splice(text, walk->at->begin, walk->at->end, value, strlen(value));
    return true;
}

bool
patch_set(struct bytes *text, const char *assignment, struct arena *arena,
          const char **place, struct error *err)
{
    const char *equals = strchr(assignment, '=');
    if (equals == NULL)
        return error_set(err, ERROR_USAGE,
                         "'%.100s' lacks a value: write /pointer=value",
                         assignment);
    char *pointer =
        arena_strndup(arena, assignment, (size_t)(equals - assignment));
    if (pointer == NULL)
        return error_set(err, ERROR_MEMORY, "no memory for --set");
    if (*pointer != '/')
        return error_set(err, ERROR_USAGE,
                         "'%.100s' is no JSON pointer: it begins with /, like "
                         "/film/width",
                         pointer);

    /* A value is JSON if it can be, else a string: red, #ff0000, sphere. */
    struct error_list unread = {.arena = arena};
    struct bytes value = {0};
    const char *given = equals + 1;
    if (json_read(given, strlen(given), NULL, arena, &unread) != NULL) {
        bytes_text(&value, given);
    } else {
        struct json_writer w = {.out = &value};
        json_put_string(&w, NULL, given);
    }

    struct error_list errors = {.arena = arena};
    struct walk walk = {.whole = pointer, .rest = pointer};
    walk.at = json_read(text->data, text->len, NULL, arena, &errors);
    bool ok = walk.at != NULL
                  ? put(text, &walk, value.data, arena, place, err)
                  : error_set(err, ERROR_INTERNAL, "the document is no JSON");
    if (ok && (text->failed || value.failed))
        ok = error_set(err, ERROR_MEMORY, "no memory for --set");
    bytes_clear(&value);
    return ok;
}
