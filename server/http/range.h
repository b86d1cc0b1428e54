/* range.h - which bytes of a file a Range header asks for (RFC 9110, 14.2).
 *
 * Pure; any thread. One range only: a list of ranges, another unit or a text
 * that is none means the whole file, as the standard allows. */
#ifndef SERVER_HTTP_RANGE_H
#define SERVER_HTTP_RANGE_H

#include <stdint.h>

enum range_kind {
    RANGE_WHOLE, /* 200 */
    RANGE_PART,  /* 206: `first` to `last`, both included */
    RANGE_NONE   /* 416: it lies behind the end */
};

/* `first` and `last` mean something for RANGE_PART only. */
enum range_kind
range_read(const char *text, uint64_t size, uint64_t *first, uint64_t *last);

#endif
