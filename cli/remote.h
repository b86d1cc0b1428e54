/* remote.h - HTTP to one glintd, and nothing that knows what is said over it.
 *
 * No redirect is followed and no proxy is used for this machine itself. An ask
 * ends early when glint is interrupted. One thread. */
#ifndef CLI_REMOTE_H
#define CLI_REMOTE_H

#include <stdbool.h>

#include "core/base/bytes.h"
#include "core/base/error.h"

struct remote;

struct remote_reply {
    long status; /* 200 */
    struct bytes body;
    char media_type[64]; /* "image/png", without parameters */
    char location[256];  /* path of Location, without scheme and host; or "" */
    double retry_after;  /* seconds; 0: not told */
};

/* The server to use: the option's value, else GLINT_SERVER; NULL for none. */
const char *
remote_server(const char *option);

/* `url` is http:// or https:// with an optional path before /v1. ERROR_USAGE if
 * it is not. */
struct remote *
remote_open(const char *url, struct error *err);
void
remote_close(struct remote *remote);

/* Ask and read the whole answer; any HTTP status is an answer. `body` may be
 * NULL. `headers` end with NULL. False: ERROR_IO (unreachable or broken off),
 * ERROR_TIMEOUT after timeout_s without an answer, ERROR_CANCELED
 * (interrupted grace_s ago: what must not be left half said gets that long). */
struct remote_ask {
    const char *method, *path;
    const struct bytes *body;
    const char *const *headers;
    double timeout_s;
    double grace_s;
};
bool
remote_send(struct remote *remote, const struct remote_ask *ask,
            struct remote_reply *reply, struct error *err);

void
remote_reply_clear(struct remote_reply *reply);

#endif
