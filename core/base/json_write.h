/* json_write.h - value -> JSON text, compact, members in the order written.
 *
 * Numbers come out in the shortest form that reads back to the same double
 * (number.h). Zero the struct, set `out`, write; nesting at most 62. Strings
 * must be UTF-8; what is not becomes U+FFFD. A failed allocation shows in
 * out->failed. `key` is NULL inside an array and at the root.
 *
 *     struct json_writer w = {.out = &bytes};
 *     json_begin_object(&w, NULL);
 *     json_put_string(&w, "id", job->id);
 *     json_end_object(&w); */
#ifndef CORE_BASE_JSON_WRITE_H
#define CORE_BASE_JSON_WRITE_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/bytes.h"

struct json_writer {
    struct bytes *out;
    uint64_t started; /* bit d: level d has a member already */
    int depth;
};

void
json_begin_object(struct json_writer *w, const char *key);
void
json_end_object(struct json_writer *w);
void
json_begin_array(struct json_writer *w, const char *key);
void
json_end_array(struct json_writer *w);
void
json_put_string(struct json_writer *w, const char *key, const char *text);
void
json_put_stringn(struct json_writer *w, const char *key, const char *text,
                 size_t len);
void
json_put_number(struct json_writer *w, const char *key, double number);
void
json_put_integer(struct json_writer *w, const char *key, int64_t number);
void
json_put_bool(struct json_writer *w, const char *key, bool value);
void
json_put_null(struct json_writer *w, const char *key);

/* Text that is JSON already, for example a stored canonical scene. */
void
json_put_raw(struct json_writer *w, const char *key, const char *json,
             size_t len);

/* A string, or null where text is NULL. */
void
json_put_string_or_null(struct json_writer *w, const char *key,
                        const char *text);

#endif
