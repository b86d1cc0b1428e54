/* bytes.h - a growing run of bytes, always followed by a NUL.
 *
 * Zero it, append, clear. A failed allocation sets `failed` and drops further
 * appends, so a writer checks once, at the end. One owner, no threads. */
#ifndef CORE_BASE_BYTES_H
#define CORE_BASE_BYTES_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/error.h"

struct bytes {
    char *data; /* NULL while empty, else NUL-terminated */
    size_t len;
    size_t capacity;
    bool failed;
};

void
bytes_clear(struct bytes *bytes);
bool
bytes_reserve(struct bytes *bytes, size_t more);
void
bytes_append(struct bytes *bytes, const void *data, size_t len);
void
bytes_text(struct bytes *bytes, const char *text);
void
bytes_printf(struct bytes *bytes, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* The whole of a file, at most `limit` bytes (ERROR_TOO_LARGE), or of standard
 * input for path "-". ERROR_IO names path and cause. */
bool
bytes_read_file(struct bytes *bytes, const char *path, size_t limit,
                struct error *err);

/* Write a file whole or not at all: temporary file beside it, then rename.
 * "-" is standard output. */
bool
bytes_write_file(const struct bytes *bytes, const char *path,
                 struct error *err);

#endif
