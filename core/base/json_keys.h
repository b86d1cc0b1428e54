/* json_keys.h - member names of the objects that a scan has open, and whether
 * one of them is given twice. Only json_scan.c calls it. */
#ifndef CORE_BASE_JSON_KEYS_H
#define CORE_BASE_JSON_KEYS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/bytes.h"

/* A member name, decoded when it holds escapes. */
struct json_key {
    const char *text; /* in the document, or `decoded` */
    char *decoded;    /* heap, or NULL */
    uint32_t len;
    uint32_t offset; /* of its opening quote */
    uint32_t line, column;
};

struct json_keys {
    struct json_key *items; /* heap */
    size_t count, capacity;
};

/* Takes key->decoded over, also when memory ends and it returns false. */
bool
json_keys_add(struct json_keys *keys, const struct json_key *key);

/* Forget all from `first` on. */
void
json_keys_drop(struct json_keys *keys, size_t first);

/* In keys [first, end): *key is the earliest that repeats another one, which is
 * *original; NULL if all differ. Sorts, so n log n whatever the names are.
 * False without memory. */
bool
json_keys_duplicate(const struct json_keys *keys, size_t first, size_t end,
                    const struct json_key **key,
                    const struct json_key **original);

/* The name in text[begin, end), which a scan has checked, without its quotes
 * and with its escapes resolved: heap, `*len` bytes; NULL without memory. */
char *
json_key_decode(const char *text, size_t begin, size_t end, uint32_t *len);

/* The name as a token of a JSON pointer (RFC 6901). */
void
json_key_token(const struct json_key *key, struct bytes *out);

/* Four hexadecimal digits at text[at], or -1. */
int32_t
json_hex4(const char *text, size_t len, size_t at);

#endif
