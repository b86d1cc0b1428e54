/* http.h - sockets <-> messages; the only libmicrohttpd.
 *
 * One loop thread (libmicrohttpd's internal poll thread, never epoll: it stalls
 * at exactly 128 ready sockets) reads requests, calls the handler and sends
 * replies. The handler must not block: it answers, or parks the request and is
 * called again when http_wake names its ticket or the deadline comes. A second
 * thread, the watchman, keeps the deadlines and looks for peers that hung up,
 * which the library does not; it calls no handler.
 *
 * Every byte received passes the header gate (gate.h) before the library sees
 * it (tap.h), and no request is served whose head the gate did not see. HEAD
 * comes to the handler as GET and is answered without a body. A 200 with a file
 * honours Range.
 *
 * Refused here, before the handler, with problem+json from `refuse`: a request
 * with Content-Length and Transfer-Encoding, with two Content-Lengths, HTTP/1.1
 * without exactly one Host, bare LF, NUL or control bytes in headers
 * (400 request-malformed, then close), likewise a request line, an escape in the
 * target or a chunk that is not as RFC 9112 writes it; an unknown transfer
 * coding (501); a compressed body (415); a body over the handler's limit (413
 * with the limit, then close); bodies in flight over the budget (503). Headers
 * and body must be whole within 30 s (else 400 and close; without a byte, only
 * close). A parked client that hangs up is noticed within 2 s; one that only
 * ends its sending cannot be told from it and counts as gone.
 *
 * A request without a known method and path (malformed, late) comes to
 * `refuse` with both empty, and to no other call. */
#ifndef SERVER_HTTP_HTTP_H
#define SERVER_HTTP_HTTP_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/error.h"
#include "server/http/message.h"

struct http;

enum http_verdict {
    HTTP_REPLY, /* the reply is filled */
    HTTP_PARK   /* call again at http_wake or after park_ms */
};

enum http_refusal {
    HTTP_REFUSE_MALFORMED,  /* 400 request-malformed */
    HTTP_REFUSE_TOO_LARGE,  /* 413 too-large */
    HTTP_REFUSE_CODING,     /* 501 not-implemented */
    HTTP_REFUSE_COMPRESSED, /* 415 unsupported-media-type */
    HTTP_REFUSE_BUSY        /* 503 queue-full: too many bodies in flight */
};

/* All calls come on the loop thread. `app` is the handler's own. */
struct http_handler {
    void *app;

    /* Headers are there, the body is not. Return the largest body accepted for
     * this method and path, in bytes. May fill `reply` (status != 0) to answer
     * before the body is read: authorization, wrong method, unknown path. */
    uint64_t (*admit)(void *app, struct request *request, struct reply *reply);

    /* A turn. On HTTP_PARK, *park_ms is how long at most. */
    enum http_verdict (*handle)(void *app, struct request *request,
                                struct reply *reply, int64_t *park_ms);

    /* The request is over; free request->state. `gone`: the client left before
     * the answer was sent. */
    void (*finish)(void *app, struct request *request, bool gone);

    /* Make the answer to a request refused by http itself. */
    void (*refuse)(void *app, struct request *request, struct reply *reply,
                   enum http_refusal why, const char *detail);
};

struct http_options {
    const char *host;           /* "127.0.0.1", "::1", "0.0.0.0" */
    uint16_t port;              /* 0: any free one, see http_port */
    unsigned max_connections;   /* [1024] */
    int64_t receive_timeout_ms; /* [30000] headers and body */
    uint64_t max_bodies_bytes; /* [64 MiB] request bodies in flight, together */
};

/* Listen and start the loop. ERROR_IO names the address. */
struct http *
http_start(const struct http_options *options,
           const struct http_handler *handler, struct error *err);

uint16_t
http_port(const struct http *http);

/* Give the parked request of that ticket its next turn. Any thread; harmless
 * for a ticket that is over, and remembered if it has not parked yet. */
void
http_wake(struct http *http, uint64_t ticket);

/* Refuse new connections; parked requests get a last turn. */
void
http_quiesce(struct http *http);

/* Close everything, join the loop, free. */
void
http_stop(struct http *http);

#endif
