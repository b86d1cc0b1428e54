/* json_scan.h - the strict scan that goes before cJSON: grammar, UTF-8,
 * duplicate names, depth and number range; and the place of every value.
 *
 * Only json.c calls it. One pass, no recursion; memory grows with the number
 * of values and is given back by json_places_clear. */
#ifndef CORE_BASE_JSON_SCAN_H
#define CORE_BASE_JSON_SCAN_H

#include "core/base/json.h"

/* Where a value and its member name begin, in document order (a container
 * before what it holds). Bytes from the start of the text. */
struct json_place {
    uint32_t begin, end;
    uint32_t line, column;
    uint32_t key_line, key_column; /* 0 in arrays and at the root */
};

struct json_places {
    struct json_place *items; /* heap */
    size_t count, capacity;
};

/* False after the first error was added. `limits` has no zeros. */
bool
json_scan(const char *text, size_t len, const struct json_limits *limits,
          struct json_places *places, struct error_list *errors);

void
json_places_clear(struct json_places *places);

#endif
