#include "server/api/moment.h"

#include <string.h>
#include <time.h>

/* `count` digits at *at. */
static bool
read_digits(const char **at, int count, int *value)
{
    *value = 0;
    while (count-- > 0) {
        if (**at < '0' || **at > '9')
            return false;
        *value = *value * 10 + (*(*at)++ - '0');
    }
    return true;
}

static bool
read_mark(const char **at, const char *marks)
{
    if (**at == '\0' || !strchr(marks, **at))
        return false;
    (*at)++;
    return true;
}

/* Digits after the point, as milliseconds; further ones are dropped. */
static bool
read_fraction(const char **at, int *ms)
{
    int digits = 0;

    *ms = 0;
    if (**at != '.')
        return true;
    for ((*at)++; **at >= '0' && **at <= '9'; (*at)++)
        if (digits++ < 3)
            *ms = *ms * 10 + (**at - '0');
    if (digits == 0)
        return false;
    for (; digits < 3; digits++)
        *ms *= 10;
    return true;
}

static bool
read_offset(const char **at, int *seconds)
{
    int hours, minutes, sign = **at == '-' ? -1 : 1;

    *seconds = 0;
    if (read_mark(at, "Zz"))
        return true;
    if (!read_mark(at, "+-") || !read_digits(at, 2, &hours) ||
        !read_mark(at, ":") || !read_digits(at, 2, &minutes) || hours > 23 ||
        minutes > 59)
        return false;
    *seconds = sign * (hours * 3600 + minutes * 60);
    return true;
}

bool
moment_read(const char *text, int64_t *wall_ms)
{
    struct tm tm = {0}, back;
    const char *at = text;
    int ms, offset;
    time_t seconds;

    if (!read_digits(&at, 4, &tm.tm_year) || !read_mark(&at, "-") ||
        !read_digits(&at, 2, &tm.tm_mon) || !read_mark(&at, "-") ||
        !read_digits(&at, 2, &tm.tm_mday) || !read_mark(&at, "Tt ") ||
        !read_digits(&at, 2, &tm.tm_hour) || !read_mark(&at, ":") ||
        !read_digits(&at, 2, &tm.tm_min) || !read_mark(&at, ":") ||
        !read_digits(&at, 2, &tm.tm_sec) || !read_fraction(&at, &ms) ||
        !read_offset(&at, &offset) || *at != '\0')
        return false;
    tm.tm_year -= 1900;
    tm.tm_mon -= 1;
    back = tm;
    seconds = timegm(&back);
    /* timegm makes 3 March of 31 February: that is no date. */
    if (back.tm_mday != tm.tm_mday || back.tm_mon != tm.tm_mon ||
        tm.tm_hour > 23 || tm.tm_min > 59 || tm.tm_sec > 60)
        return false;
    *wall_ms = ((int64_t)seconds - offset) * 1000 + ms;
    return true;
}
