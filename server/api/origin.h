/* origin.h - may a request with this Host and this Origin drive the service?
 *
 * A web page elsewhere must not use a service on the student's machine: neither
 * by posting to it (Origin) nor by a name that it makes point to 127.0.0.1
 * (Host). Pure; any thread. */
#ifndef SERVER_API_ORIGIN_H
#define SERVER_API_ORIGIN_H

#include <stdbool.h>

/* "localhost", "127.x.y.z", "[::1]" or `configured`, each with or without a
 * port. NULL is refused. */
bool
host_is_ours(const char *host, const char *configured);

/* http or https of exactly that Host. NULL is accepted: no browser, or one that
 * only follows a link. "null" is not. */
bool
origin_is_ours(const char *origin, const char *host);

#endif
