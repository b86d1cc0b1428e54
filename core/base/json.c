#include "core/base/json.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <string.h>

#include "core/base/json_scan.h"
#include "core/base/must.h"
#include "core/base/number.h"
#include "core/base/utf8.h"

enum {
    MAX_DEPTH = 512, /* below cJSON's own limit of 1000, which recurses */
    DESCRIBE_CHARACTERS = 40
};

static bool
no_memory(struct error_list *errors, size_t len)
{
    return error_list_add(errors, ERROR_MEMORY, NULL, 0, 0, NULL, NULL,
                          "no memory to read a document of %zu bytes", len);
}

/* --- text -> tree ---------------------------------------------------------- */

/* One node from cJSON's item and the scan's place; NULL without memory. */
static struct json *
node_new(const cJSON *item, const struct json_place *place, struct arena *arena)
{
    struct json *node = arena_alloc(arena, sizeof *node);
    if (node == NULL)
        return NULL;
    *node = (struct json){.line = place->line,
                          .column = place->column,
                          .key_line = place->key_line,
                          .key_column = place->key_column,
                          .begin = place->begin,
                          .end = place->end};
    if (item->string != NULL) {
        node->key = arena_strdup(arena, item->string);
        if (node->key == NULL)
            return NULL;
    }
    switch (item->type & 0xff) {
    case cJSON_False: node->type = JSON_FALSE; break;
    case cJSON_True: node->type = JSON_TRUE; break;
    case cJSON_Number:
        node->type = JSON_NUMBER;
        node->number = item->valuedouble;
        break;
    case cJSON_String:
        node->type = JSON_STRING;
        node->string_len = strlen(item->valuestring);
        node->string =
            arena_strndup(arena, item->valuestring, node->string_len);
        if (node->string == NULL)
            return NULL;
        break;
    case cJSON_Array: node->type = JSON_ARRAY; break;
    case cJSON_Object: node->type = JSON_OBJECT; break;
    default: node->type = JSON_NULL; break;
    }
    return node;
}

/* Walk cJSON's tree and the places together: both are in document order, a
 * container before its content. The depth is limited, so recursion is. */
static struct json *
convert(const cJSON *item, const struct json_places *places, size_t *at,
        struct arena *arena)
{
    MUST(*at < places->count);
    struct json *node = node_new(item, &places->items[(*at)++], arena);
    if (node == NULL)
        return NULL;
    const struct json **link = &node->child;
    for (const cJSON *child = item->child; child != NULL; child = child->next) {
        struct json *copy = convert(child, places, at, arena);
        if (copy == NULL)
            return NULL;
        copy->parent = node;
        *link = copy;
        link = &copy->next;
        node->count++;
    }
    return node;
}

static const struct json *
parse(const char *text, size_t len, const struct json_places *places,
      struct arena *arena, struct error_list *errors)
{
    size_t at = 0;
    cJSON *item = cJSON_ParseWithLengthOpts(text, len, NULL, false);
    if (item == NULL) {
        no_memory(errors, len);
        return NULL;
    }
    const struct json *root = convert(item, places, &at, arena);
    cJSON_Delete(item);
    if (root == NULL)
        no_memory(errors, len);
    else
        MUST(at == places->count);
    return root;
}

const struct json *
json_read(const char *text, size_t len, const struct json_limits *limits,
          struct arena *arena, struct error_list *errors)
{
    struct json_limits most =
        limits != NULL ? *limits : (struct json_limits){0};
    if (most.max_bytes == 0)
        most.max_bytes = 1024 * 1024;
    if (most.max_bytes > UINT32_MAX / 2)
        most.max_bytes = UINT32_MAX / 2;
    if (most.max_depth == 0)
        most.max_depth = 32;
    if (most.max_depth > MAX_DEPTH)
        most.max_depth = MAX_DEPTH;
    if (most.max_values == 0)
        most.max_values = 256 * 1024;

    if (len > most.max_bytes) {
        error_list_add(errors, ERROR_BUDGET_BYTES, NULL, 0, 0, NULL, NULL,
                       "the document has %zu bytes, at most %zu", len,
                       most.max_bytes);
        return NULL;
    }
    struct json_places places = {0};
    const struct json *root = NULL;
    if (json_scan(text, len, &most, &places, errors))
        root = parse(text, len, &places, arena, errors);
    json_places_clear(&places);
    return root;
}

/* --- questions about a tree ------------------------------------------------ */

const struct json *
json_member(const struct json *object, const char *key)
{
    if (object == NULL || object->type != JSON_OBJECT)
        return NULL;
    for (const struct json *m = object->child; m != NULL; m = m->next) {
        if (strcmp(m->key, key) == 0)
            return m;
    }
    return NULL;
}

static uint32_t
index_of(const struct json *node)
{
    uint32_t index = 0;
    const struct json *n = node->parent->child;
    while (n != node) {
        n = n->next;
        index++;
    }
    return index;
}

static void
put_pointer(const struct json *node, struct bytes *out)
{
    if (node->parent == NULL)
        return;
    put_pointer(node->parent, out);
    if (node->key == NULL) {
        bytes_printf(out, "/%u", index_of(node));
        return;
    }
    bytes_append(out, "/", 1);
    for (const char *c = node->key; *c != '\0'; c++) {
        if (*c == '~')
            bytes_append(out, "~0", 2);
        else if (*c == '/')
            bytes_append(out, "~1", 2);
        else
            bytes_append(out, c, 1);
    }
}

const char *
json_pointer(const struct json *node, struct arena *arena)
{
    struct bytes out = {0};
    bytes_append(&out, "", 0);
    put_pointer(node, &out);
    const char *pointer = NULL;
    if (!out.failed)
        pointer = arena_strndup(arena, out.data, out.len);
    bytes_clear(&out);
    return pointer != NULL ? pointer : "";
}

const char *
json_describe(const struct json *node, struct arena *arena)
{
    char number[NUMBER_SIZE];
    const char *text = NULL;
    size_t shown = 0;
    switch (node->type) {
    case JSON_NULL: return "null";
    case JSON_FALSE: return "false";
    case JSON_TRUE: return "true";
    case JSON_ARRAY: return "an array";
    case JSON_OBJECT: return "an object";
    case JSON_NUMBER:
        number_text(node->number, number);
        text = arena_printf(arena, "the number %s", number);
        break;
    case JSON_STRING:
        for (int i = 0; i < DESCRIBE_CHARACTERS && shown < node->string_len;
             i++)
            shown +=
                utf8_length(node->string + shown, node->string_len - shown);
        text = arena_printf(arena, "the string \"%.*s%s\"", (int)shown,
                            node->string, shown < node->string_len ? "…" : "");
        break;
    }
    return text != NULL ? text : "another value";
}

/* --- did you mean ------------------------------------------------------------ */

enum { WORD_MAX = 64, DISTANCE_MAX = 2 };

/* Levenshtein distance in bytes, or DISTANCE_MAX + 1 if it is more. */
static size_t
distance(const char *a, size_t a_len, const char *b, size_t b_len)
{
    size_t row[WORD_MAX + 1];
    size_t gap = a_len > b_len ? a_len - b_len : b_len - a_len;
    if (gap > DISTANCE_MAX || b_len > WORD_MAX)
        return DISTANCE_MAX + 1;
    for (size_t j = 0; j <= b_len; j++)
        row[j] = j;
    for (size_t i = 1; i <= a_len; i++) {
        size_t diagonal = row[0], least = i;
        row[0] = i;
        for (size_t j = 1; j <= b_len; j++) {
            size_t change = diagonal + (a[i - 1] != b[j - 1]);
            size_t drop = row[j] + 1, add = row[j - 1] + 1;
            diagonal = row[j];
            row[j] = change < drop ? change : drop;
            if (add < row[j])
                row[j] = add;
            if (row[j] < least)
                least = row[j];
        }
        if (least > DISTANCE_MAX)
            return least; /* it never shrinks again */
    }
    return row[b_len];
}

const char *
json_did_you_mean(const char *word, const char *const *names, size_t count)
{
    size_t len = strlen(word);
    size_t best = DISTANCE_MAX + 1;
    const char *nearest = NULL;
    for (size_t i = 0; i < count; i++) {
        size_t d = distance(word, len, names[i], strlen(names[i]));
        /* A word of which nothing is left is no misspelling. */
        if (d < best && d < len) {
            best = d;
            nearest = names[i];
        }
    }
    return nearest;
}
