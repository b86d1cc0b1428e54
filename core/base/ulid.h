/* ulid.h - sortable names for jobs and requests: 48 bits of wall time in
 * milliseconds and 80 random bits, in Crockford base 32, 26 characters (the
 * ULID specification). Any thread. */
#ifndef CORE_BASE_ULID_H
#define CORE_BASE_ULID_H

#include <stdbool.h>

enum {
    ULID_SIZE = 27,   /* with the NUL */
    ID_SIZE = 5 + 27, /* "job_" or "hook_" and a ULID, with the NUL */
};

/* "job" -> "job_01JDC8Q4M5...". `kind` has 3 or 4 letters. */
void
ulid_id(const char *kind, char id[ID_SIZE]);

/* Is `text` an id of that kind, well formed? */
bool
ulid_is_id(const char *kind, const char *text);

#endif
