/* json.h - strict JSON (RFC 8259): text -> tree, every value with its place.
 *
 * A scan of our own goes first and refuses what cJSON lets pass or pays too
 * dearly for: duplicate member names, numbers beyond double range, leading
 * zeros, raw control characters, \u0000, lone surrogates, invalid UTF-8, text
 * after the document, nesting and size over the limits. It records where every
 * key and value begins; then cJSON parses, and both are walked together. The
 * tree lives in the arena; nodes are plain data and never change.
 *
 * One leading byte-order mark is accepted and is no column. Lines end with LF,
 * CR LF or CR. Columns count characters (code points), not bytes. */
#ifndef CORE_BASE_JSON_H
#define CORE_BASE_JSON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/arena.h"
#include "core/base/bytes.h"
#include "core/base/error.h"

enum json_type {
    JSON_NULL,
    JSON_FALSE,
    JSON_TRUE,
    JSON_NUMBER,
    JSON_STRING,
    JSON_ARRAY,
    JSON_OBJECT
};

struct json {
    enum json_type type;
    const char *key; /* member name, NULL in arrays and at the root */
    uint32_t key_line, key_column;
    uint32_t line, column; /* of the value's first character */
    size_t begin, end;     /* the value's bytes in the text read */
    const char *string;    /* decoded, NUL-terminated; JSON_STRING only */
    size_t string_len;     /* bytes */
    double number;         /* finite; JSON_NUMBER only */
    uint32_t count;        /* children */
    const struct json *parent, *child, *next; /* document order */
};

/* Zero means the default in brackets. */
struct json_limits {
    size_t max_bytes;   /* [1 MiB] over it: ERROR_BUDGET_BYTES, no place */
    uint32_t max_depth; /* [32] over it: ERROR_JSON_DEPTH */
    size_t max_values;  /* [2^18] over it: ERROR_BUDGET_LIST */
};

/* Read a whole text. NULL on the first error, which is added to `errors` as
 * SCENE section 8 says (json.syntax, trailing_data, utf8, control_character
 * and depth have a NULL pointer but a line and column). */
const struct json *
json_read(const char *text, size_t len, const struct json_limits *limits,
          struct arena *arena, struct error_list *errors);

/* The member of that name, or NULL; of a node that is no object: NULL. */
const struct json *
json_member(const struct json *object, const char *key);

/* RFC 6901 pointer of a node from its root ("" is the root), in `arena`. */
const char *
json_pointer(const struct json *node, struct arena *arena);

/* "an object", "the number 3", "the string \"2\"": for `got ...`; cut at 40
 * characters. */
const char *
json_describe(const struct json *node, struct arena *arena);

/* The allowed name nearest to `word` by edit distance <= 2, or NULL. `names`
 * has `count` entries. */
const char *
json_did_you_mean(const char *word, const char *const *names, size_t count);

#endif
