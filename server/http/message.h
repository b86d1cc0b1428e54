/* message.h - question and answer without a library and without sockets.
 *
 * A request lives for its connection's turn; everything it points to is in its
 * arena, which dies after the reply was sent. */
#ifndef SERVER_HTTP_MESSAGE_H
#define SERVER_HTTP_MESSAGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/arena.h"
#include "core/base/bytes.h"
#include "core/base/ulid.h"

struct request {
    uint64_t ticket;    /* names this request to http_wake; never reused */
    char id[ID_SIZE];   /* "req_...", sent back as Request-Id */
    const char *method; /* "GET" */
    const char *path;   /* percent-decoded, without query: "/v1/jobs" */
    const char *body;   /* whole; "" if none */
    size_t body_len;
    int64_t started_us; /* monotonic, when the headers were complete */
    bool loopback_peer; /* the client's address is of this machine */
    struct arena *arena;
    void *state;      /* the handler's own, from one turn to the next */
    unsigned turn;    /* 0 at the first call, then 1, 2, ... */
    bool timed_out;   /* this turn comes from the park's deadline */
    void *connection; /* http.c's */
};

/* Header by case-insensitive name; NULL if absent. */
const char *
request_header(const struct request *request, const char *name);

/* Query parameter, decoded; NULL if absent, "" for `?name`. */
const char *
request_query(const struct request *request, const char *name);

/* Calls `each` for every query parameter until it returns false. */
void
request_each_query(const struct request *request,
                   bool (*each)(void *user, const char *name,
                                const char *value),
                   void *user);

enum { REPLY_HEADER_MAX = 24 };

struct reply_header {
    const char *name, *value; /* in the request's arena, or static */
};

/* Zeroed before the handler runs. The body is one of: `body` (malloc'ed bytes,
 * taken over), `fd` (a file of `fd_len` bytes, taken over, sent from offset 0;
 * fd_len 0 and fd <= 0 mean none), `fixed` (static). */
struct reply {
    unsigned status;
    struct reply_header headers[REPLY_HEADER_MAX];
    unsigned header_count;
    struct bytes body;
    const char *fixed;
    size_t fixed_len;
    int fd;
    uint64_t fd_len;
    bool close; /* close the connection after this answer */
};

/* Copies value into the request's arena. Drops the header when the table is
 * full. */
void
reply_header(struct request *request, struct reply *reply, const char *name,
             const char *format, ...) __attribute__((format(printf, 4, 5)));

#endif
