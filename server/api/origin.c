#include "server/api/origin.h"

#include <stddef.h>
#include <string.h>
#include <strings.h>

/* Length of the name part; (size_t)-1 if what follows is no port. */
static size_t
name_len(const char *host)
{
    const char *end = host[0] == '[' ? strchr(host, ']') : NULL;
    size_t len = host[0] == '[' ? (end ? (size_t)(end - host) + 1 : 0)
                                : strcspn(host, ":");
    size_t digits;

    if (len == 0 || host[len] == '\0')
        return len ? len : (size_t)-1;
    digits = strspn(host + len + 1, "0123456789");
    if (host[len] != ':' || digits > 5 || host[len + 1 + digits] != '\0')
        return (size_t)-1;
    return len;
}

/* 127.x.y.z, each 0...255 */
static bool
is_loopback_v4(const char *text, size_t len)
{
    unsigned part = 0, parts = 0, digits = 0;
    size_t i;

    if (len < 4 || strncmp(text, "127.", 4) != 0)
        return false;
    for (i = 0; i <= len; i++) {
        if (i == len || text[i] == '.') {
            if (digits == 0 || part > 255)
                return false;
            parts++;
            part = digits = 0;
        } else if (text[i] >= '0' && text[i] <= '9' && digits < 3) {
            part = part * 10 + (unsigned)(text[i] - '0');
            digits++;
        } else {
            return false;
        }
    }
    return parts == 4;
}

static bool
same_name(const char *text, size_t len, const char *name)
{
    return name && name[0] && strlen(name) == len &&
           strncasecmp(text, name, len) == 0;
}

bool
host_is_ours(const char *host, const char *configured)
{
    size_t len;

    if (!host)
        return false;
    len = name_len(host);
    if (len == (size_t)-1)
        return false;
    if (same_name(host, len, "localhost") || same_name(host, len, "[::1]") ||
        is_loopback_v4(host, len) || same_name(host, len, configured))
        return true;
    /* An IPv6 address is configured without its brackets. */
    return host[0] == '[' && len > 2 &&
           same_name(host + 1, len - 2, configured);
}

bool
origin_is_ours(const char *origin, const char *host)
{
    const char *rest;

    if (!origin)
        return true;
    if (strncasecmp(origin, "http://", 7) == 0)
        rest = origin + 7;
    else if (strncasecmp(origin, "https://", 8) == 0)
        rest = origin + 8;
    else
        return false;
    return host && strcasecmp(rest, host) == 0;
}
