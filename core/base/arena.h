/* arena.h - memory with one lifetime: a scene, a request, an ask.
 *
 * Allocations are freed together by arena_clear. An arena has a byte limit, so
 * a hostile document meets an error and not the OOM killer: past the limit, or
 * when the system has no memory, every call returns NULL and `failed` stays
 * set. Not thread-safe; one owner. */
#ifndef CORE_BASE_ARENA_H
#define CORE_BASE_ARENA_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>

struct arena_block;

struct arena {
    struct arena_block *blocks; /* newest first */
    size_t limit;               /* bytes in all; 0: no limit */
    size_t used;                /* bytes taken from the system */
    bool failed;
};

void
arena_init(struct arena *arena, size_t limit);
void
arena_clear(struct arena *arena); /* of a zeroed arena too */

/* `size` zeroed bytes, aligned for any type; never a pointer shared by two
 * calls, also for size 0. */
void *
arena_alloc(struct arena *arena, size_t size) __attribute__((malloc));

/* count * size zeroed bytes; NULL also when the product overflows. */
void *
arena_array(struct arena *arena, size_t count, size_t size);

char *
arena_strdup(struct arena *arena, const char *text);
char *
arena_strndup(struct arena *arena, const char *text, size_t len);
char *
arena_printf(struct arena *arena, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
char *
arena_vprintf(struct arena *arena, const char *format, va_list args)
    __attribute__((format(printf, 2, 0)));

#endif
