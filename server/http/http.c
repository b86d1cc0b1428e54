#include "server/http/http.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/base/clock.h"
#include "core/base/log.h"
#include "core/base/must.h"
#include "server/http/gate.h"
#include "server/http/range.h"
#include "server/http/tap.h"

enum {
    POOL_BYTES = 8 * 1024, /* the library's memory per connection: the
                                    head of a request must fit */
    POOL_STEP = 1024,
    BACKLOG = 1024,
    IDLE_S = 60,             /* between requests, and for a reader who
                                    takes no byte of his answer */
    SWALLOW_MAX = 64 * 1024, /* a refused body of so many bytes is read to
                                    keep the connection; a larger one is not */
    BODY_STEP = 16 * 1024,
    LOOK_US = 1000000, /* between two looks for hang-ups */
    DRAIN_MAX = 64,    /* connections being drained at a time */
    DRAIN_US = 5000000,
    DRAIN_BYTES = 64 * 1024 * 1024,
    REQUEST_BYTES = 256 * 1024 * 1024, /* a request's arena */
    SLOT_BITS = 20
};

/* Whatever a handler allows. */
#define BODY_MAX (UINT64_C(1) << 40)

enum place { NOWHERE, RECEIVING, PARKED, PLACE_COUNT };

/* One connection, and the request it carries. The loop thread owns it; only
 * what stands under `lock` is shared with the watchman and with http_wake. */
struct conn {
    struct http *http;
    struct MHD_Connection *mhd;
    int fd;
    uint32_t slot;
    struct gate gate;
    uint32_t heads;      /* how many of the gate's heads became requests */
    bool timed;          /* stands, or stood until it was late, in RECEIVING */
    bool linger;         /* its peer may still be sending when it is closed */
    struct bytes unsent; /* of an answer that bypassed the library */
    size_t sent;
    atomic_bool late; /* the deadline of receiving has passed */

    /* the request */
    struct request request;
    struct arena arena;
    struct reply *early; /* decided before the body was read */
    uint64_t limit;      /* of the body */
    size_t capacity;     /* of request.body */
    bool busy;           /* the request is whole and has not been answered */
    bool admitted, answered, head_only;

    /* guarded by http->lock */
    uint64_t ticket; /* of the request; 0: none */
    enum place place;
    struct conn *prev, *next;
    int64_t deadline_us;
    bool woken;     /* named by http_wake while it was not parked */
    bool gone;      /* hung up while it was parked */
    bool timed_out; /* the park's deadline came */
    bool doomed;    /* a malformed request follows the one under way */
};

struct list {
    struct conn *first, *last;
};

/* A connection that the library has closed and whose peer may still be
 * sending: closing it at once would reset it, and the peer might never read
 * its answer. It is drained for a while. The watchman's. */
struct drain {
    int fd;
    int64_t deadline_us;
    uint64_t drained;
    struct bytes unsent;
    size_t sent;
};

struct http {
    struct http_handler handler;
    struct http_options options;
    struct MHD_Daemon *daemon;
    int listen_fd;
    uint16_t port;
    bool quiet; /* http_quiesce was called */

    /* the loop thread's */
    struct conn **by_fd;
    size_t by_fd_count;
    uint64_t bodies; /* bytes held for bodies, together */

    pthread_t watchman;
    int kick; /* eventfd: the watchman should look at the clock again */
    struct pollfd *look_fds;
    uint64_t *look_tickets;

    /* Guards what follows and the shared part of every connection. Taken
     * before the library's own lock, never after it. */
    pthread_mutex_t lock;
    struct list lists[PLACE_COUNT];
    struct conn **slots; /* by the low bits of a ticket */
    uint32_t slot_count, next_slot;
    uint64_t serial;
    int64_t sleep_until_us;          /* when the watchman looks next */
    struct drain closing[DRAIN_MAX]; /* on their way to the watchman */
    size_t closing_count;
    bool stopping, watchman_off;
};

/* --- lists and tickets, under the lock --- */

static void
list_remove(struct conn *conn)
{
    struct list *list = &conn->http->lists[conn->place];
    if (conn->place == NOWHERE)
        return;
    *(conn->prev != NULL ? &conn->prev->next : &list->first) = conn->next;
    *(conn->next != NULL ? &conn->next->prev : &list->last) = conn->prev;
    conn->prev = conn->next = NULL;
    conn->place = NOWHERE;
}

static void
list_add(struct conn *conn, enum place place, int64_t deadline_us)
{
    struct list *list = &conn->http->lists[place];
    list_remove(conn);
    conn->place = place;
    conn->deadline_us = deadline_us;
    conn->prev = list->last;
    *(list->last != NULL ? &list->last->next : &list->first) = conn;
    list->last = conn;
}

static struct conn *
find_ticket(struct http *http, uint64_t ticket)
{
    uint32_t slot = (uint32_t)(ticket & ((1u << SLOT_BITS) - 1));
    struct conn *conn =
        ticket != 0 && slot < http->slot_count ? http->slots[slot] : NULL;
    return conn != NULL && conn->ticket == ticket ? conn : NULL;
}

static void
unpark(struct conn *conn)
{
    list_remove(conn);
    MHD_resume_connection(conn->mhd);
}

static void
kick_watchman(struct http *http)
{
    uint64_t one = 1;
    ssize_t n = write(http->kick, &one, sizeof one);
    (void)n; /* a full counter wakes him as well */
}

/* --- the time in which a request must be whole --- */

static void
start_timing(struct conn *conn)
{
    struct http *http = conn->http;
    if (conn->timed)
        return;
    conn->timed = true;
    pthread_mutex_lock(&http->lock);
    list_add(conn, RECEIVING,
             clock_monotonic_us() + http->options.receive_timeout_ms * 1000);
    if (conn->deadline_us < http->sleep_until_us)
        kick_watchman(http);
    pthread_mutex_unlock(&http->lock);
}

static void
stop_timing(struct conn *conn)
{
    if (!conn->timed)
        return;
    conn->timed = false;
    pthread_mutex_lock(&conn->http->lock);
    list_remove(conn);
    pthread_mutex_unlock(&conn->http->lock);
}

/* --- a request's life --- */

static void
request_begin(struct conn *conn, const char *method, const char *path)
{
    struct http *http = conn->http;
    arena_init(&conn->arena, REQUEST_BYTES);
    conn->head_only = strcmp(method, "HEAD") == 0;
    conn->request = (struct request){
        .method = conn->head_only ? "GET" : method,
        .path = path,
        .body = "",
        .started_us = clock_monotonic_us(),
        .arena = &conn->arena,
        .connection = conn,
    };
    ulid_id("req", conn->request.id);
    pthread_mutex_lock(&http->lock);
    conn->ticket = ++http->serial << SLOT_BITS | conn->slot;
    conn->request.ticket = conn->ticket;
    conn->woken = conn->gone = conn->timed_out = false;
    pthread_mutex_unlock(&http->lock);
}

static void
reply_clear(struct reply *reply)
{
    bytes_clear(&reply->body);
    if (reply->fd > 0)
        close(reply->fd);
    reply->fd = 0;
}

static void
request_end(struct conn *conn, bool gone)
{
    struct http *http = conn->http;
    pthread_mutex_lock(&http->lock);
    list_remove(conn);
    conn->ticket = 0;
    pthread_mutex_unlock(&http->lock);
    if (conn->request.ticket == 0)
        return;
    conn->timed = false;
    if (conn->admitted)
        http->handler.finish(http->handler.app, &conn->request, gone);
    if (conn->early != NULL)
        reply_clear(conn->early);
    if (conn->capacity > 0)
        free((char *)conn->request.body);
    http->bodies -= conn->capacity;
    arena_clear(&conn->arena);
    conn->request = (struct request){0};
    conn->early = NULL;
    conn->capacity = 0;
    conn->admitted = conn->answered = conn->busy = false;
}

/* --- answers that bypass the library --- */

/* The library takes an answer before the body or after it, and none for a
 * request that it has not understood. The rest is written here, straight to
 * the socket; the caller then lets the library close the connection, and the
 * watchman sends what did not fit. Only while no other answer is under way on
 * this connection: all callers come from reading. */
static void
write_raw(struct conn *conn, const struct reply *reply)
{
    struct bytes *out = &conn->unsent;
    bytes_printf(out, "HTTP/1.1 %u %s\r\n", reply->status,
                 MHD_get_reason_phrase_for(reply->status));
    for (unsigned i = 0; i < reply->header_count; i++)
        bytes_printf(out, "%s: %s\r\n", reply->headers[i].name,
                     reply->headers[i].value);
    if (conn->request.id[0] != '\0')
        bytes_printf(out, "Request-Id: %s\r\n", conn->request.id);
    size_t len = reply->fixed != NULL ? reply->fixed_len : reply->body.len;
    bytes_printf(out, "Content-Length: %zu\r\nConnection: close\r\n\r\n", len);
    bytes_append(out, reply->fixed != NULL ? reply->fixed : reply->body.data,
                 len);
    conn->answered = true;
    conn->linger = true;
    if (out->failed)
        return;
    ssize_t n =
        send(conn->fd, out->data, out->len, MSG_DONTWAIT | MSG_NOSIGNAL);
    conn->sent = n > 0 ? (size_t)n : 0;
}

/* 505 and 500 have no problem document, as the library's own refusals. */
static void
write_html(struct conn *conn, unsigned status, const char *text)
{
    struct reply reply = {.status = status,
                          .fixed = text,
                          .fixed_len = strlen(text),
                          .header_count = 1,
                          .headers = {{"Content-Type", "text/html"}}};
    write_raw(conn, &reply);
}

static void
answer_raw(struct conn *conn, enum http_refusal why, const char *detail)
{
    struct http *http = conn->http;
    struct reply reply = {0};
    bool stranger = conn->request.ticket == 0;
    if (stranger)
        request_begin(conn, "", "");
    http->handler.refuse(http->handler.app, &conn->request, &reply, why,
                         detail);
    MUST(reply.status >= 400);
    write_raw(conn, &reply);
    reply_clear(&reply);
    if (stranger)
        request_end(conn, false);
}

static void
answer_gate(struct conn *conn)
{
    if (conn->gate.refusal == GATE_VERSION)
        write_html(conn, 505,
                   "<html><body>HTTP Version Not Supported: HTTP/1.0 and "
                   "HTTP/1.1 only</body></html>\n");
    else
        answer_raw(conn,
                   conn->gate.refusal == GATE_CODING ? HTTP_REFUSE_CODING
                                                     : HTTP_REFUSE_MALFORMED,
                   conn->gate.detail);
}

static void
answer_late(struct conn *conn)
{
    char detail[96];
    snprintf(detail, sizeof detail, "the request was not complete within %g s",
             (double)conn->http->options.receive_timeout_ms / 1000);
    if (conn->request.ticket != 0 || !gate_between(&conn->gate))
        answer_raw(conn, HTTP_REFUSE_MALFORMED, detail);
}

/* --- the gate --- */

/* Each byte of a connection comes by here before the library sees it (tap.h).
 * Were it ever bypassed, begin_request() would find no head that the gate let
 * through and serve nobody. */
static ssize_t
pass_gate(struct conn *conn, void *data, size_t len, int flags)
{
    /* After a park the library reads once although it has a request to serve.
     * Its bytes, or what the gate has to say, come behind the answer. */
    if (conn->busy) {
        errno = EAGAIN;
        return -1;
    }
    if (conn->doomed) {
        answer_gate(conn);
        return 0;
    }
    if (atomic_load(&conn->late)) {
        answer_late(conn);
        return 0;
    }
    ssize_t n = recvfrom(conn->fd, data, len, flags, NULL, NULL);
    if (n <= 0)
        return n;
    size_t whole;
    if (gate_feed(&conn->gate, data, (size_t)n, &whole)) {
        start_timing(conn);
        return n;
    }
    if (whole == 0) {
        answer_gate(conn);
        return 0;
    }
    /* Let the good ones through, and make the socket readable for ever, so
     * that the library comes back after it has answered them. */
    pthread_mutex_lock(&conn->http->lock);
    conn->doomed = true;
    pthread_mutex_unlock(&conn->http->lock);
    shutdown(conn->fd, SHUT_RD);
    return (ssize_t)whole;
}

static ssize_t
on_receive(void *user, int fd, void *data, size_t len, int flags)
{
    struct http *http = user;
    struct conn *conn =
        fd >= 0 && (size_t)fd < http->by_fd_count ? http->by_fd[fd] : NULL;
    return conn != NULL ? pass_gate(conn, data, len, flags)
                        : recvfrom(fd, data, len, flags, NULL, NULL);
}

/* --- replies through the library --- */

static const char *
reply_find(const struct reply *reply, const char *name)
{
    for (unsigned i = 0; i < reply->header_count; i++)
        if (strcasecmp(reply->headers[i].name, name) == 0)
            return reply->headers[i].value;
    return NULL;
}

/* A file, or the part of it that a Range header asks for. */
static struct MHD_Response *
file_response(struct conn *conn, struct reply *reply)
{
    uint64_t first = 0, last = 0;
    enum range_kind kind = RANGE_WHOLE;
    if (reply->status == 200 && !conn->head_only &&
        strcmp(conn->request.method, "GET") == 0) {
        const char *only_if = request_header(&conn->request, "If-Range");
        const char *etag = reply_find(reply, "ETag");
        reply_header(&conn->request, reply, "Accept-Ranges", "bytes");
        if (only_if == NULL ||
            (etag != NULL && strcmp(only_if, etag) == 0 && etag[0] == '"'))
            kind = range_read(request_header(&conn->request, "Range"),
                              reply->fd_len, &first, &last);
    }
    /* The library would spin on a file that ends too early. */
    struct stat about;
    if (fstat(reply->fd, &about) != 0 || about.st_size < 0 ||
        (uint64_t)about.st_size < reply->fd_len) {
        log_write(LOG_ERROR, "http", "a file is shorter than its reply says");
        return NULL;
    }
    uint64_t offset = 0, len = reply->fd_len;
    if (kind == RANGE_PART) {
        reply->status = 206;
        offset = first;
        len = last - first + 1;
        reply_header(&conn->request, reply, "Content-Range",
                     "bytes %llu-%llu/%llu", (unsigned long long)first,
                     (unsigned long long)last,
                     (unsigned long long)reply->fd_len);
    }
    if (kind == RANGE_NONE) {
        static const char text[] =
            "{\"type\":\"about:blank\",\"title\":\"Range Not Satisfiable\","
            "\"status\":416}\n";
        unsigned long long size = (unsigned long long)reply->fd_len;
        reply_clear(reply);
        *reply = (struct reply){.status = 416};
        reply_header(&conn->request, reply, "Content-Range", "bytes */%llu",
                     size);
        reply_header(&conn->request, reply, "Content-Type",
                     "application/problem+json");
        return MHD_create_response_from_buffer(sizeof text - 1, (void *)text,
                                               MHD_RESPMEM_PERSISTENT);
    }
    struct MHD_Response *response =
        MHD_create_response_from_fd_at_offset64(len, reply->fd, offset);
    if (response != NULL)
        reply->fd = 0;
    return response;
}

static struct MHD_Response *
make_response(struct conn *conn, struct reply *reply)
{
    if (reply->fd > 0)
        return file_response(conn, reply);
    if (reply->fixed != NULL)
        return MHD_create_response_from_buffer(
            reply->fixed_len, (void *)reply->fixed, MHD_RESPMEM_PERSISTENT);
    if (reply->body.data == NULL)
        return MHD_create_response_from_buffer(0, (void *)"",
                                               MHD_RESPMEM_PERSISTENT);
    if (reply->body.failed)
        return NULL;
    struct MHD_Response *response = MHD_create_response_from_buffer(
        reply->body.len, reply->body.data, MHD_RESPMEM_MUST_FREE);
    if (response != NULL)
        reply->body = (struct bytes){0};
    return response;
}

/* MHD_NO makes the library close the connection without an answer: there was
 * no memory for one. */
static enum MHD_Result
send_reply(struct conn *conn, struct reply *reply)
{
    enum MHD_Result result = MHD_NO;
    struct MHD_Response *response = make_response(conn, reply);
    if (response == NULL)
        goto out;
    for (unsigned i = 0; i < reply->header_count; i++)
        MHD_add_response_header(response, reply->headers[i].name,
                                reply->headers[i].value);
    MHD_add_response_header(response, "Request-Id", conn->request.id);
    if (reply->close)
        MHD_add_response_header(response, "Connection", "close");
    result = MHD_queue_response(conn->mhd, reply->status, response);
    MHD_destroy_response(response);
out:
    reply_clear(reply);
    return result;
}

/* --- first call: the head is there --- */

static bool
is_loopback(const struct sockaddr *address)
{
    if (address->sa_family == AF_INET) {
        const struct sockaddr_in *v4 = (const void *)address;
        return ntohl(v4->sin_addr.s_addr) >> 24 == 127;
    }
    if (address->sa_family != AF_INET6)
        return false;
    const struct in6_addr *v6 =
        &((const struct sockaddr_in6 *)(const void *)address)->sin6_addr;
    return IN6_IS_ADDR_LOOPBACK(v6) ||
           (IN6_IS_ADDR_V4MAPPED(v6) && v6->s6_addr[12] == 127);
}

static void
refuse(struct conn *conn, struct reply *reply, enum http_refusal why,
       const char *detail)
{
    struct http *http = conn->http;
    http->handler.refuse(http->handler.app, &conn->request, reply, why, detail);
    MUST(reply->status >= 400);
}

/* What the head alone forbids. `length` is UINT64_MAX for a chunked body. */
static void
check_head(struct conn *conn, struct reply *reply, uint64_t length)
{
    const char *coding = request_header(&conn->request, "Content-Encoding");
    if (reply->status != 0 || length == 0)
        return;
    if (coding != NULL && strcasecmp(coding, "identity") != 0)
        refuse(conn, reply, HTTP_REFUSE_COMPRESSED,
               "request bodies are sent without Content-Encoding");
    else if (length != UINT64_MAX && length > conn->limit) {
        char detail[96];
        snprintf(detail, sizeof detail, "the body may have at most %llu bytes",
                 (unsigned long long)conn->limit);
        refuse(conn, reply, HTTP_REFUSE_TOO_LARGE, detail);
        reply->close = true;
    }
}

static enum MHD_Result
begin_request(struct conn *conn, const char *method, const char *path)
{
    struct http *http = conn->http;
    if (conn->heads == conn->gate.heads) {
        log_write(LOG_ERROR, "http",
                  "a request reached the HTTP library past the header gate; "
                  "the connection is closed");
        return MHD_NO;
    }
    conn->heads++;
    request_begin(conn, method, path);
    start_timing(conn);
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(conn->mhd, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
    conn->request.loopback_peer = info != NULL && info->client_addr != NULL &&
                                  is_loopback((const void *)info->client_addr);

    struct reply reply = {0};
    conn->admitted = true;
    conn->limit =
        http->handler.admit(http->handler.app, &conn->request, &reply);
    if (conn->limit > BODY_MAX)
        conn->limit = BODY_MAX;
    const char *text = request_header(&conn->request, "Content-Length");
    uint64_t length = text != NULL ? strtoull(text, NULL, 10) : 0;
    if (request_header(&conn->request, "Transfer-Encoding") != NULL)
        length = UINT64_MAX;
    check_head(conn, &reply, length);
    if (reply.status == 0)
        return MHD_YES;

    /* Decided already. A small body is read all the same, so that the
     * connection lives on; a large one, or one that its client holds back
     * until told, is not. */
    if (length <= SWALLOW_MAX &&
        request_header(&conn->request, "Expect") == NULL) {
        conn->early = arena_alloc(&conn->arena, sizeof *conn->early);
        if (conn->early == NULL) {
            reply_clear(&reply);
            return MHD_NO;
        }
        *conn->early = reply;
        return MHD_YES;
    }
    reply.close = true;
    conn->linger = true;
    return send_reply(conn, &reply);
}

/* --- further calls: bytes of the body --- */

static bool
grow_body(struct conn *conn, size_t needed)
{
    struct http *http = conn->http;
    if (needed <= conn->capacity)
        return true;
    size_t capacity = conn->capacity * 2;
    if (capacity < needed + BODY_STEP)
        capacity = needed + BODY_STEP;
    if (capacity > conn->limit + 1)
        capacity = (size_t)conn->limit + 1;
    MUST(capacity >= needed);
    uint64_t more = capacity - conn->capacity;
    if (more > http->options.max_bodies_bytes ||
        http->bodies > http->options.max_bodies_bytes - more)
        return false;
    void *old = conn->capacity > 0 ? (void *)conn->request.body : NULL;
    char *body = realloc(old, capacity);
    if (body == NULL)
        return false;
    http->bodies += more;
    conn->request.body = body;
    conn->capacity = capacity;
    return true;
}

static enum MHD_Result
take_body(struct conn *conn, const char *data, size_t len)
{
    struct request *request = &conn->request;
    if (conn->early != NULL)
        return MHD_YES;
    if (len > conn->limit - request->body_len) {
        char detail[96];
        snprintf(detail, sizeof detail, "the body may have at most %llu bytes",
                 (unsigned long long)conn->limit);
        answer_raw(conn, HTTP_REFUSE_TOO_LARGE, detail);
        return MHD_NO;
    }
    if (!grow_body(conn, request->body_len + len + 1)) {
        answer_raw(conn, HTTP_REFUSE_BUSY,
                   "too many request bodies are being received");
        return MHD_NO;
    }
    char *body = (char *)request->body;
    memcpy(body + request->body_len, data, len);
    request->body_len += len;
    body[request->body_len] = '\0';
    return MHD_YES;
}

/* --- last calls: turns --- */

/* False when the server is stopping. */
static bool
park(struct conn *conn, int64_t park_ms)
{
    struct http *http = conn->http;
    pthread_mutex_lock(&http->lock);
    bool open = !http->stopping;
    if (open) {
        MHD_suspend_connection(conn->mhd);
        list_add(conn, PARKED, clock_monotonic_us() + park_ms * 1000);
        if (conn->woken)
            unpark(conn);
        else if (conn->deadline_us < http->sleep_until_us)
            kick_watchman(http);
    }
    pthread_mutex_unlock(&http->lock);
    return open;
}

static enum MHD_Result
take_turn(struct conn *conn)
{
    struct http *http = conn->http;
    struct request *request = &conn->request;
    stop_timing(conn);
    conn->busy = true;
    pthread_mutex_lock(&http->lock);
    bool leave = conn->gone || http->stopping;
    request->timed_out = conn->timed_out;
    conn->timed_out = conn->woken = false;
    pthread_mutex_unlock(&http->lock);
    if (leave)
        return MHD_NO;
    if (conn->early != NULL)
        return send_reply(conn, conn->early);

    struct reply reply = {0};
    int64_t park_ms = 0;
    enum http_verdict verdict =
        http->handler.handle(http->handler.app, request, &reply, &park_ms);
    request->turn++;
    if (verdict == HTTP_REPLY)
        return send_reply(conn, &reply);
    MUST(park_ms >= 0);
    reply_clear(&reply);
    return park(conn, park_ms) ? MHD_YES : MHD_NO;
}

/* --- the library's callbacks, all on the loop thread --- */

static enum MHD_Result
on_request(void *user, struct MHD_Connection *mhd, const char *path,
           const char *method, const char *version, const char *data,
           size_t *len, void **context)
{
    (void)user, (void)version;
    struct conn *conn = *context;
    if (conn == NULL) {
        const union MHD_ConnectionInfo *info =
            MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
        conn = info != NULL ? info->socket_context : NULL;
        *context = conn;
        return conn != NULL ? begin_request(conn, method, path) : MHD_NO;
    }
    if (*len > 0) {
        enum MHD_Result result = take_body(conn, data, *len);
        *len = 0;
        return result;
    }
    return take_turn(conn);
}

static void
on_completed(void *user, struct MHD_Connection *mhd, void **context,
             enum MHD_RequestTerminationCode how)
{
    (void)user, (void)mhd;
    struct conn *conn = *context;
    *context = NULL;
    if (conn == NULL)
        return;
    request_end(conn,
                how != MHD_REQUEST_TERMINATED_COMPLETED_OK && !conn->answered);
    /* The next one in the pipeline has begun to come. */
    if (how == MHD_REQUEST_TERMINATED_COMPLETED_OK &&
        !gate_between(&conn->gate))
        start_timing(conn);
}

static bool
remember_fd(struct http *http, struct conn *conn)
{
    size_t count = http->by_fd_count;
    if ((size_t)conn->fd >= count) {
        while ((size_t)conn->fd >= count)
            count = count == 0 ? 64 : count * 2;
        struct conn **by_fd = realloc(http->by_fd, count * sizeof(void *));
        if (by_fd == NULL)
            return false;
        memset(by_fd + http->by_fd_count, 0,
               (count - http->by_fd_count) * sizeof(void *));
        http->by_fd = by_fd;
        http->by_fd_count = count;
    }
    http->by_fd[conn->fd] = conn;
    return true;
}

/* A connection without a `conn` is closed by on_request at its first word. */
static struct conn *
conn_new(struct http *http, struct MHD_Connection *mhd)
{
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_CONNECTION_FD);
    struct conn *conn = calloc(1, sizeof *conn);
    if (conn == NULL || info == NULL)
        goto fail;
    conn->http = http;
    conn->mhd = mhd;
    conn->fd = info->connect_fd;
    if (!remember_fd(http, conn))
        goto fail;
    pthread_mutex_lock(&http->lock);
    bool found = false;
    for (uint32_t i = 0; i < http->slot_count && !found; i++) {
        conn->slot = http->next_slot++ % http->slot_count;
        found = http->slots[conn->slot] == NULL;
    }
    if (found)
        http->slots[conn->slot] = conn;
    pthread_mutex_unlock(&http->lock);
    if (found)
        return conn;
    http->by_fd[conn->fd] = NULL;
fail:
    free(conn);
    return NULL;
}

/* Hand the socket over to the watchman if its peer may still be sending. */
static void
linger(struct conn *conn)
{
    struct http *http = conn->http;
    int unread = 0;
    if (!conn->linger &&
        (ioctl(conn->fd, FIONREAD, &unread) != 0 || unread == 0))
        return;
    pthread_mutex_lock(&http->lock);
    int fd = http->closing_count < DRAIN_MAX && !http->stopping
                 ? fcntl(conn->fd, F_DUPFD_CLOEXEC, 0)
                 : -1;
    if (fd >= 0) {
        http->closing[http->closing_count++] = (struct drain){
            .fd = fd,
            .deadline_us = clock_monotonic_us() + DRAIN_US,
            .unsent = conn->unsent,
            .sent = conn->sent,
        };
        conn->unsent = (struct bytes){0};
        kick_watchman(http);
    }
    pthread_mutex_unlock(&http->lock);
}

static void
conn_free(struct conn *conn)
{
    struct http *http = conn->http;
    request_end(conn, true);
    linger(conn);
    pthread_mutex_lock(&http->lock);
    list_remove(conn);
    http->slots[conn->slot] = NULL;
    pthread_mutex_unlock(&http->lock);
    http->by_fd[conn->fd] = NULL;
    bytes_clear(&conn->unsent);
    free(conn);
}

static void
on_connection(void *user, struct MHD_Connection *mhd, void **context,
              enum MHD_ConnectionNotificationCode code)
{
    if (code == MHD_CONNECTION_NOTIFY_STARTED) {
        tap_install(on_receive, user);
        *context = conn_new(user, mhd);
        if (*context != NULL)
            start_timing(*context);
    } else if (*context != NULL) {
        conn_free(*context);
        *context = NULL;
    }
}

static void
on_log(void *user, const char *format, va_list args)
{
    (void)user;
    char text[256];
    vsnprintf(text, sizeof text, format, args);
    text[strcspn(text, "\n")] = '\0';
    log_write(LOG_DEBUG, "http", "%s", text);
}

/* --- the watchman: deadlines, hang-ups, lingering --- */

/* The library forgets a connection while it is suspended: no time-out, no look
 * at its socket. And it measures silence, not the time a request takes. Both
 * are this thread's work; it calls no handler. */

static void
expire(struct http *http, int64_t now)
{
    struct conn *conn, *next;
    while ((conn = http->lists[RECEIVING].first) != NULL &&
           conn->deadline_us <= now) {
        list_remove(conn);
        atomic_store(&conn->late, true);
        shutdown(conn->fd, SHUT_RD); /* makes the loop read, and find out */
    }
    for (conn = http->lists[PARKED].first; conn != NULL; conn = next) {
        next = conn->next;
        if (conn->deadline_us <= now) {
            conn->timed_out = true;
            unpark(conn);
        }
    }
}

static int64_t
next_deadline(const struct http *http, int64_t until)
{
    const struct conn *conn = http->lists[RECEIVING].first;
    if (conn != NULL && conn->deadline_us < until)
        until = conn->deadline_us;
    for (conn = http->lists[PARKED].first; conn != NULL; conn = conn->next)
        if (conn->deadline_us < until)
            until = conn->deadline_us;
    return until;
}

static void
look_for_hangups(struct http *http)
{
    nfds_t n = 0;
    pthread_mutex_lock(&http->lock);
    for (struct conn *conn = http->lists[PARKED].first; conn != NULL;
         conn = conn->next) {
        if (conn->doomed)
            continue; /* its reading side is shut by ourselves */
        http->look_fds[n] =
            (struct pollfd){.fd = conn->fd, .events = POLLRDHUP};
        http->look_tickets[n++] = conn->ticket;
    }
    pthread_mutex_unlock(&http->lock);

    /* A descriptor closed meanwhile, even taken again, does no harm: its
     * ticket is over, and the look-up below finds nobody. */
    if (n == 0 || poll(http->look_fds, n, 0) <= 0)
        return;
    pthread_mutex_lock(&http->lock);
    for (nfds_t i = 0; i < n; i++) {
        struct conn *conn = http->look_fds[i].revents != 0
                                ? find_ticket(http, http->look_tickets[i])
                                : NULL;
        if (conn != NULL && conn->place == PARKED) {
            conn->gone = true;
            unpark(conn);
        }
    }
    pthread_mutex_unlock(&http->lock);
}

static void
drain_clear(struct drain *drain)
{
    close(drain->fd);
    bytes_clear(&drain->unsent);
}

/* Send what is left, then say that it was all, and drop what comes. False when
 * it is over. */
static bool
drain_on(struct drain *drain, int64_t now)
{
    char waste[16 * 1024];
    while (drain->sent < drain->unsent.len) {
        ssize_t n =
            send(drain->fd, drain->unsent.data + drain->sent,
                 drain->unsent.len - drain->sent, MSG_DONTWAIT | MSG_NOSIGNAL);
        if (n < 0 && errno != EAGAIN)
            return false;
        if (n <= 0)
            break;
        drain->sent += (size_t)n;
    }
    if (drain->sent == drain->unsent.len)
        shutdown(drain->fd, SHUT_WR);
    for (int i = 0; i < 64; i++) {
        ssize_t n =
            recvfrom(drain->fd, waste, sizeof waste, MSG_DONTWAIT, NULL, NULL);
        if (n < 0 && errno == EAGAIN)
            break;
        if (n <= 0)
            return false;
        drain->drained += (uint64_t)n;
    }
    return now < drain->deadline_us && drain->drained < DRAIN_BYTES;
}

struct watch {
    struct drain drains[DRAIN_MAX];
    size_t count;
    int64_t next_look_us;
};

/* Sleep until something is due; false when it is time to go. */
static bool
watch_sleep(struct http *http, struct watch *watch)
{
    struct pollfd fds[DRAIN_MAX + 1];
    pthread_mutex_lock(&http->lock);
    while (http->closing_count > 0 && watch->count < DRAIN_MAX)
        watch->drains[watch->count++] = http->closing[--http->closing_count];
    bool on = !http->watchman_off;
    int64_t until = next_deadline(http, watch->next_look_us);
    http->sleep_until_us = until;
    pthread_mutex_unlock(&http->lock);
    if (!on)
        return false;
    int64_t wait_us = until - clock_monotonic_us();
    fds[0] = (struct pollfd){.fd = http->kick, .events = POLLIN};
    for (size_t i = 0; i < watch->count; i++) {
        const struct drain *one = &watch->drains[i];
        fds[i + 1] = (struct pollfd){
            .fd = one->fd,
            .events = (short)(one->sent < one->unsent.len ? POLLIN | POLLOUT
                                                          : POLLIN)};
    }
    poll(fds, (nfds_t)watch->count + 1,
         wait_us > 0 ? (int)((wait_us + 999) / 1000) : 0);
    uint64_t kicks;
    if (fds[0].revents != 0 && read(http->kick, &kicks, sizeof kicks) < 0)
        return true;
    return true;
}

static void *
watchman(void *user)
{
    struct http *http = user;
    struct watch *watch = calloc(1, sizeof *watch);
    MUST(watch != NULL);
    pthread_setname_np(pthread_self(), "http-watch");
    while (watch_sleep(http, watch)) {
        int64_t now = clock_monotonic_us();
        pthread_mutex_lock(&http->lock);
        expire(http, now);
        pthread_mutex_unlock(&http->lock);
        for (size_t i = watch->count; i-- > 0;) {
            if (drain_on(&watch->drains[i], now))
                continue;
            drain_clear(&watch->drains[i]);
            watch->drains[i] = watch->drains[--watch->count];
        }
        if (now >= watch->next_look_us) {
            look_for_hangups(http);
            watch->next_look_us = now + LOOK_US;
        }
    }
    for (size_t i = 0; i < watch->count; i++)
        drain_clear(&watch->drains[i]);
    free(watch);
    return NULL;
}

/* --- start and stop --- */

static int
listen_on(struct http *http, struct error *err)
{
    const char *host = http->options.host;
    struct sockaddr_in v4 = {.sin_family = AF_INET,
                             .sin_port = htons(http->options.port)};
    struct sockaddr_in6 v6 = {.sin6_family = AF_INET6,
                              .sin6_port = htons(http->options.port)};
    const void *address = &v4;
    socklen_t len = sizeof v4;
    if (inet_pton(AF_INET6, host, &v6.sin6_addr) == 1) {
        address = &v6;
        len = sizeof v6;
    } else if (inet_pton(AF_INET, host, &v4.sin_addr) != 1) {
        error_set(err, ERROR_IO, "%s is no IPv4 or IPv6 address", host);
        return -1;
    }
    int on = 1;
    int fd = socket(len == sizeof v4 ? AF_INET : AF_INET6,
                    SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0 ||
        setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0 ||
        bind(fd, address, len) != 0 || listen(fd, BACKLOG) != 0) {
        error_errno(err, ERROR_IO, errno, "cannot listen on %s port %u", host,
                    http->options.port);
        if (fd >= 0)
            close(fd);
        return -1;
    }
    len = sizeof v6;
    MUST(getsockname(fd, (struct sockaddr *)&v6, &len) == 0);
    http->port = ntohs(v6.sin6_port); /* both families keep it there */
    return fd;
}

static struct MHD_Daemon *
start_daemon(struct http *http)
{
    int64_t idle_s = http->options.receive_timeout_ms / 1000 + IDLE_S / 2;
    return MHD_start_daemon(
        MHD_USE_POLL_INTERNAL_THREAD | MHD_USE_ITC | MHD_ALLOW_SUSPEND_RESUME |
            MHD_USE_ERROR_LOG,
        0, NULL, NULL, on_request, http, MHD_OPTION_EXTERNAL_LOGGER, on_log,
        NULL, MHD_OPTION_LISTEN_SOCKET, http->listen_fd,
        MHD_OPTION_CONNECTION_LIMIT, http->options.max_connections,
        MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)POOL_BYTES,
        MHD_OPTION_CONNECTION_MEMORY_INCREMENT, (size_t)POOL_STEP,
        MHD_OPTION_CONNECTION_TIMEOUT,
        (unsigned)(idle_s > IDLE_S ? idle_s : IDLE_S),
        MHD_OPTION_NOTIFY_CONNECTION, on_connection, http,
        MHD_OPTION_NOTIFY_COMPLETED, on_completed, http,
        MHD_OPTION_STRICT_FOR_CLIENT, 1, MHD_OPTION_END);
}

static void
watchman_stop(struct http *http)
{
    pthread_mutex_lock(&http->lock);
    http->watchman_off = true;
    kick_watchman(http);
    pthread_mutex_unlock(&http->lock);
    pthread_join(http->watchman, NULL);
}

static void
http_free(struct http *http)
{
    for (size_t i = 0; i < http->closing_count; i++)
        drain_clear(&http->closing[i]);
    if (http->kick >= 0)
        close(http->kick);
    if (http->listen_fd >= 0)
        close(http->listen_fd);
    pthread_mutex_destroy(&http->lock);
    free(http->slots);
    free(http->look_fds);
    free(http->look_tickets);
    free(http->by_fd);
    free(http);
}

struct http *
http_start(const struct http_options *options,
           const struct http_handler *handler, struct error *err)
{
    struct http *http = calloc(1, sizeof *http);
    if (http == NULL) {
        error_set(err, ERROR_MEMORY, "no memory for the HTTP server");
        return NULL;
    }
    http->handler = *handler;
    http->options = *options;
    http->kick = http->listen_fd = -1;
    if (http->options.max_connections == 0)
        http->options.max_connections = 1024;
    if (http->options.receive_timeout_ms == 0)
        http->options.receive_timeout_ms = 30000;
    if (http->options.max_bodies_bytes == 0)
        http->options.max_bodies_bytes = 64 * 1024 * 1024;
    pthread_mutex_init(&http->lock, NULL);
    http->slot_count = http->options.max_connections;
    if (http->slot_count >= 1u << SLOT_BITS) {
        error_set(err, ERROR_USAGE, "at most %u connections, got %u",
                  (1u << SLOT_BITS) - 1, http->slot_count);
        goto fail;
    }
    http->slots = calloc(http->slot_count, sizeof(void *));
    http->look_fds = calloc(http->slot_count, sizeof *http->look_fds);
    http->look_tickets = calloc(http->slot_count, sizeof(uint64_t));
    if (http->slots == NULL || http->look_fds == NULL ||
        http->look_tickets == NULL) {
        error_set(err, ERROR_MEMORY, "no memory for %u connections",
                  http->slot_count);
        goto fail;
    }
    http->kick = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (http->kick < 0) {
        error_errno(err, ERROR_IO, errno, "no eventfd");
        goto fail;
    }
    http->listen_fd = listen_on(http, err);
    if (http->listen_fd < 0)
        goto fail;
    if (pthread_create(&http->watchman, NULL, watchman, http) != 0) {
        error_set(err, ERROR_IO, "no thread for the HTTP watchman");
        goto fail;
    }
    http->daemon = start_daemon(http);
    if (http->daemon == NULL) {
        watchman_stop(http);
        error_set(err, ERROR_IO, "cannot serve HTTP on %s port %u",
                  http->options.host, http->port);
        goto fail;
    }
    return http;
fail:
    http_free(http);
    return NULL;
}

uint16_t
http_port(const struct http *http)
{
    return http->port;
}

void
http_wake(struct http *http, uint64_t ticket)
{
    pthread_mutex_lock(&http->lock);
    struct conn *conn = find_ticket(http, ticket);
    if (conn != NULL && conn->place == PARKED)
        unpark(conn);
    else if (conn != NULL)
        conn->woken = true;
    pthread_mutex_unlock(&http->lock);
}

static void
wake_all(struct http *http)
{
    while (http->lists[PARKED].first != NULL)
        unpark(http->lists[PARKED].first);
}

void
http_quiesce(struct http *http)
{
    if (http->quiet)
        return;
    http->quiet = true;
    /* Shut, not closed: the loop may be polling it this moment. */
    MHD_quiesce_daemon(http->daemon);
    shutdown(http->listen_fd, SHUT_RDWR);
    pthread_mutex_lock(&http->lock);
    wake_all(http);
    pthread_mutex_unlock(&http->lock);
}

void
http_stop(struct http *http)
{
    if (http == NULL)
        return;
    /* The library aborts when it is stopped with a suspended connection. */
    pthread_mutex_lock(&http->lock);
    http->stopping = true;
    wake_all(http);
    pthread_mutex_unlock(&http->lock);
    MHD_stop_daemon(http->daemon);
    if (!http->quiet)
        http->listen_fd = -1; /* closed by the library */
    watchman_stop(http);
    http_free(http);
}

/* --- what handlers ask about a request --- */

const char *
request_header(const struct request *request, const char *name)
{
    const struct conn *conn = request->connection;
    return conn == NULL || conn->mhd == NULL || request->method[0] == '\0'
               ? NULL
               : MHD_lookup_connection_value(conn->mhd, MHD_HEADER_KIND, name);
}

struct query_walk {
    bool (*each)(void *user, const char *name, const char *value);
    void *user;
};

static enum MHD_Result
query_step(void *user, enum MHD_ValueKind kind, const char *name,
           const char *value)
{
    (void)kind;
    const struct query_walk *walk = user;
    return walk->each(walk->user, name, value != NULL ? value : "") ? MHD_YES
                                                                    : MHD_NO;
}

void
request_each_query(const struct request *request,
                   bool (*each)(void *user, const char *name,
                                const char *value),
                   void *user)
{
    struct query_walk walk = {.each = each, .user = user};
    const struct conn *conn = request->connection;
    if (conn != NULL && request->method[0] != '\0')
        MHD_get_connection_values(conn->mhd, MHD_GET_ARGUMENT_KIND, query_step,
                                  &walk);
}

struct query_find {
    const char *name, *value;
};

static bool
query_match(void *user, const char *name, const char *value)
{
    struct query_find *find = user;
    if (strcmp(name, find->name) != 0)
        return true;
    find->value = value;
    return false;
}

const char *
request_query(const struct request *request, const char *name)
{
    struct query_find find = {.name = name};
    request_each_query(request, query_match, &find);
    return find.value;
}
