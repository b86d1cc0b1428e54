#include "server/http/range.h"

#include <stdbool.h>
#include <string.h>

/* Digits up to 10^18; false if there is none or too many. */
static bool
read_number(const char **text, uint64_t *number)
{
    const char *p = *text;
    *number = 0;
    while (*p >= '0' && *p <= '9' && p - *text < 18)
        *number = *number * 10 + (uint64_t)(*p++ - '0');
    bool ok = p > *text && !(*p >= '0' && *p <= '9');
    *text = p;
    return ok;
}

enum range_kind
range_read(const char *text, uint64_t size, uint64_t *first, uint64_t *last)
{
    if (text == NULL || strncmp(text, "bytes=", 6) != 0)
        return RANGE_WHOLE;
    text += 6;

    /* The last n bytes. */
    if (*text == '-') {
        uint64_t n;
        text++;
        if (!read_number(&text, &n) || *text != '\0')
            return RANGE_WHOLE;
        if (n == 0 || size == 0)
            return RANGE_NONE;
        *first = n < size ? size - n : 0;
        *last = size - 1;
        return RANGE_PART;
    }

    /* From here to there, or to the end. */
    if (!read_number(&text, first) || *text++ != '-')
        return RANGE_WHOLE;
    *last = UINT64_MAX;
    if (*text != '\0' && !read_number(&text, last))
        return RANGE_WHOLE;
    if (*text != '\0' || *last < *first)
        return RANGE_WHOLE;
    if (*first >= size)
        return RANGE_NONE;
    if (*last >= size)
        *last = size - 1;
    return RANGE_PART;
}
