/* http.c on a loopback socket, with a handler of our own behind it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/base/clock.h"
#include "core/base/log.h"
#include "server/http/http.h"
#include "tests/unit/http/shapes.h"

enum { SMALL = 1000 }; /* the limit of /small */

/* --- the application --- */

struct app {
    struct http *http;
    atomic_uint admitted, finished, gone, handled, parked;
    _Atomic uint64_t ticket; /* of the last parked one */
    int file;
};

static uint64_t
admit(void *user, struct request *request, struct reply *reply)
{
    struct app *app = user;
    atomic_fetch_add(&app->admitted, 1);
    assert_int_equal(request->turn, 0);
    assert_true(ulid_is_id("req", request->id));
    if (strcmp(request->path, "/secret") == 0) {
        reply->status = 401;
        reply->fixed = "no\n";
        reply->fixed_len = 3;
    }
    return strcmp(request->path, "/large") == 0   ? 8u << 20
           : strcmp(request->path, "/small") == 0 ? SMALL
                                                  : 1u << 20;
}

static void
put(struct bytes *out, const char *name, const char *value)
{
    bytes_printf(out, "%s=%s;", name, value);
}

static bool
put_query(void *user, const char *name, const char *value)
{
    put(user, name, value);
    return true;
}

static void
answer_query(struct request *request, struct reply *reply)
{
    const char *wait = request_query(request, "wait");
    const char *accept = request_header(request, "aCCept");
    request_each_query(request, put_query, &reply->body);
    put(&reply->body, "wait", wait != NULL ? wait : "(none)");
    put(&reply->body, "accept", accept != NULL ? accept : "(none)");
    put(&reply->body, "loopback", request->loopback_peer ? "yes" : "no");
}

static enum http_verdict
handle(void *user, struct request *request, struct reply *reply,
       int64_t *park_ms)
{
    struct app *app = user;
    atomic_fetch_add(&app->handled, 1);
    reply->status = 200;
    if (request->state == NULL)
        request->state = malloc(1);
    if (strncmp(request->path, "/park", 5) == 0 && request->turn == 0) {
        *park_ms = strcmp(request->path, "/park-short") == 0 ? 50 : 60000;
        /* Woken before it is parked: must not be lost. */
        if (strcmp(request->path, "/park-woken") == 0)
            http_wake(app->http, request->ticket);
        atomic_store(&app->ticket, request->ticket);
        atomic_fetch_add(&app->parked, 1);
        return HTTP_PARK;
    }
    if (strncmp(request->path, "/park", 5) == 0)
        bytes_printf(&reply->body, "turn %u%s", request->turn,
                     request->timed_out ? " timed out" : "");
    else if (strcmp(request->path, "/query") == 0)
        answer_query(request, reply);
    else if (strcmp(request->path, "/file") == 0) {
        reply->fd = dup(app->file);
        reply->fd_len = request_query(request, "long") != NULL ? 101 : 100;
        reply_header(request, reply, "ETag", "\"%s\"", "abc");
    } else if (strcmp(request->path, "/empty") == 0)
        reply->status = 204;
    else if (request->body_len > 0)
        bytes_append(&reply->body, request->body, request->body_len);
    else {
        reply->fixed = "hello";
        reply->fixed_len = 5;
    }
    reply_header(request, reply, "X-Method", "%s", request->method);
    return HTTP_REPLY;
}

static void
finish(void *user, struct request *request, bool gone)
{
    struct app *app = user;
    free(request->state);
    request->state = NULL;
    atomic_fetch_add(&app->finished, 1);
    if (gone)
        atomic_fetch_add(&app->gone, 1);
}

static void
refuse(void *user, struct request *request, struct reply *reply,
       enum http_refusal why, const char *detail)
{
    (void)user;
    static const unsigned status[] = {
        [HTTP_REFUSE_MALFORMED] = 400, [HTTP_REFUSE_TOO_LARGE] = 413,
        [HTTP_REFUSE_CODING] = 501,    [HTTP_REFUSE_COMPRESSED] = 415,
        [HTTP_REFUSE_BUSY] = 503,
    };
    reply->status = status[why];
    reply_header(request, reply, "Content-Type", "application/problem+json");
    bytes_printf(&reply->body, "{\"detail\":\"%s\"}", detail);
}

static void
start(struct app *app, struct http_options options)
{
    struct error err = {0};
    struct http_handler handler = {.app = app,
                                   .admit = admit,
                                   .handle = handle,
                                   .finish = finish,
                                   .refuse = refuse};
    *app = (struct app){.file = -1};
    if (options.host == NULL)
        options.host = "127.0.0.1";
    app->http = http_start(&options, &handler, &err);
    if (app->http == NULL)
        fail_msg("%s", err.text);
}

/* Every request that was admitted is finished, once. */
static void
stop(struct app *app)
{
    http_stop(app->http);
    assert_int_equal(atomic_load(&app->admitted), atomic_load(&app->finished));
}

/* --- a client made of sockets --- */

static int
dial(const struct app *app)
{
    struct sockaddr_in address = {.sin_family = AF_INET,
                                  .sin_port = htons(http_port(app->http)),
                                  .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    struct timeval limit = {.tv_sec = 20};
    int on = 1;
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    assert_true(fd >= 0);
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    assert_int_equal(connect(fd, (void *)&address, sizeof address), 0);
    return fd;
}

static bool
say(int fd, const char *text, size_t len)
{
    while (len > 0) {
        ssize_t n = send(fd, text, len, MSG_NOSIGNAL);
        if (n <= 0)
            return false;
        text += n;
        len -= (size_t)n;
    }
    return true;
}

#define SAY(fd, text) assert_true(say(fd, text, strlen(text)))

struct answer {
    unsigned status; /* 0: the connection ended without one */
    char head[4096];
    char body[8192];
    size_t body_len; /* as announced; only the first 8 KiB are kept */
};

static bool
hear_head(int fd, struct answer *answer)
{
    size_t len = 0;
    while (len < sizeof answer->head - 1) {
        ssize_t n = read(fd, answer->head + len, 1);
        if (n <= 0)
            return false;
        answer->head[++len] = '\0';
        if (len > 3 && strcmp(answer->head + len - 4, "\r\n\r\n") == 0)
            return sscanf(answer->head, "HTTP/1.1 %u", &answer->status) == 1;
    }
    return false;
}

static const char *
header(const struct answer *answer, const char *name)
{
    static char value[512];
    char pattern[64];
    snprintf(pattern, sizeof pattern, "\r\n%s: ", name);
    const char *found = strcasestr(answer->head, pattern);
    if (found == NULL)
        return NULL;
    found += strlen(pattern);
    snprintf(value, sizeof value, "%.*s", (int)strcspn(found, "\r"), found);
    return value;
}

static struct answer
hear(int fd, bool body)
{
    struct answer answer = {0};
    if (!hear_head(fd, &answer)) {
        answer.status = 0;
        return answer;
    }
    const char *length = header(&answer, "Content-Length");
    answer.body_len = length != NULL ? strtoul(length, NULL, 10) : 0;
    for (size_t i = 0; body && i < answer.body_len;) {
        char piece[65536];
        size_t want = answer.body_len - i;
        ssize_t n = read(fd, piece, want < sizeof piece ? want : sizeof piece);
        if (n <= 0) {
            answer.status = 0;
            break;
        }
        for (ssize_t k = 0; k < n; k++, i++)
            if (i < sizeof answer.body - 1)
                answer.body[i] = piece[k];
    }
    return answer;
}

/* The other side has closed, and not by a reset. */
static bool
closed(int fd)
{
    char byte;
    return read(fd, &byte, 1) == 0;
}

static struct answer
ask(const struct app *app, const char *text, size_t len)
{
    int fd = dial(app);
    say(fd, text, len);
    struct answer answer = hear(fd, true);
    close(fd);
    return answer;
}

#define ASK(app, text) ask(app, text, sizeof text - 1)

static bool
wait_for(atomic_uint *counter, unsigned value, int64_t ms)
{
    int64_t end = clock_monotonic_us() + ms * 1000;
    while (atomic_load(counter) < value) {
        if (clock_monotonic_us() > end)
            return false;
        usleep(1000);
    }
    return true;
}

/* --- tests --- */

static void
test_malformed(void **state)
{
    (void)state;
    struct app app;
    start(&app, (struct http_options){0});
    for (size_t i = 0; i < MALFORMED_COUNT; i++) {
        int fd = dial(&app);
        say(fd, malformed[i].text, malformed[i].len);
        struct answer answer = hear(fd, true);
        if (answer.status != malformed[i].status)
            fail_msg("%s: %u", malformed[i].name, answer.status);
        if (answer.status != 505)
            assert_non_null(strstr(answer.head, "application/problem+json"));
        assert_string_equal(header(&answer, "Connection"), "close");
        if (!closed(fd))
            fail_msg("%s: left open", malformed[i].name);
        close(fd);
    }
    /* No such request has reached the handler but those with bad chunks, and
     * of these none had its turn. */
    assert_int_equal(atomic_load(&app.handled), 0);
    /* The service goes on. */
    assert_int_equal(ASK(&app, GET H "\r\n").status, 200);
    stop(&app);
}

/* A good request, then a malformed one in the same packet, or cut at any
 * place: the good one is answered, the other one refused. */
static void
test_malformed_in_a_pipeline(void **state)
{
    (void)state;
    struct app app;
    start(&app, (struct http_options){0});
    for (size_t i = 0; i < MALFORMED_COUNT; i++) {
        static const char good[] = POST "Content-Length: 5\r\n\r\nworld";
        struct bytes text = {0};
        bytes_append(&text, good, sizeof good - 1);
        bytes_append(&text, malformed[i].text, malformed[i].len);
        size_t len = text.len;
        size_t cut = i % 3 == 0 ? len : i % 3 == 1 ? sizeof good + 8 : 40;
        if (cut > len)
            cut = len;
        int fd = dial(&app);
        say(fd, text.data, cut);
        if (cut < len)
            usleep(3000);
        say(fd, text.data + cut, len - cut);
        struct answer first = hear(fd, true);
        assert_int_equal(first.status, 200);
        assert_string_equal(first.body, "world");
        struct answer second = hear(fd, true);
        if (second.status != malformed[i].status)
            fail_msg("%s: %u", malformed[i].name, second.status);
        assert_true(closed(fd));
        close(fd);
        bytes_clear(&text);
    }
    assert_int_equal(atomic_load(&app.handled), MALFORMED_COUNT);
    stop(&app);
}

/* The first one is parked when the malformed one is found behind it. */
static void
test_malformed_behind_a_parked_one(void **state)
{
    (void)state;
    struct app app;
    start(&app, (struct http_options){0});
    int fd = dial(&app);
    SAY(fd, "GET /park HTTP/1.1\r\n" H "\r\nGET / HTTP/1.1\n");
    assert_true(wait_for(&app.parked, 1, 5000));
    usleep(1500000); /* a look for hang-ups goes by */
    assert_int_equal(atomic_load(&app.gone), 0);
    http_wake(app.http, atomic_load(&app.ticket));
    struct answer first = hear(fd, true);
    assert_int_equal(first.status, 200);
    assert_string_equal(first.body, "turn 1");
    assert_int_equal(hear(fd, true).status, 400);
    assert_true(closed(fd));
    close(fd);
    stop(&app);
}

static void
test_wellformed(void **state)
{
    (void)state;
    struct app app;
    start(&app, (struct http_options){0});
    for (size_t i = 0; i < WELLFORMED_COUNT; i++) {
        int fd = dial(&app);
        say(fd, wellformed[i].text, wellformed[i].len);
        for (unsigned k = 0; k < wellformed[i].requests; k++) {
            struct answer answer = hear(fd, true);
            if (answer.status != 200)
                fail_msg("%s: %u", wellformed[i].name, answer.status);
            assert_true(ulid_is_id("req", header(&answer, "Request-Id")));
        }
        close(fd);
    }
    stop(&app);
}

static void
test_keep_alive(void **state)
{
    (void)state;
    struct app app;
    start(&app, (struct http_options){0});
    int fd = dial(&app);
    for (unsigned i = 0; i < 2000; i++) {
        SAY(fd, GET H "\r\n");
        assert_int_equal(hear(fd, true).status, 200);
    }
    close(fd);
    assert_int_equal(atomic_load(&app.handled), 2000);
    stop(&app);
}

static void
test_pipeline(void **state)
{
    (void)state;
    enum { N = 300 };
    struct app app;
    struct bytes text = {0};
    start(&app, (struct http_options){0});
    for (unsigned i = 0; i < N; i++)
        bytes_printf(&text, "%s%x\r\n%05u\r\n0\r\n\r\n", CHUNKED, 5, i);
    int fd = dial(&app);
    assert_true(say(fd, text.data, text.len));
    for (unsigned i = 0; i < N; i++) {
        char expected[8];
        struct answer answer = hear(fd, true);
        snprintf(expected, sizeof expected, "%05u", i);
        assert_int_equal(answer.status, 200);
        assert_string_equal(answer.body, expected);
    }
    close(fd);
    bytes_clear(&text);
    stop(&app);
}

static void
test_methods(void **state)
{
    (void)state;
    struct app app;
    start(&app, (struct http_options){0});

    /* HEAD is GET without the body: the next answer follows at once. */
    int fd = dial(&app);
    SAY(fd, "HEAD /hello HTTP/1.1\r\n" H "\r\n" GET H "\r\n");
    struct answer answer = hear(fd, false);
    assert_int_equal(answer.status, 200);
    assert_string_equal(header(&answer, "Content-Length"), "5");
    assert_string_equal(header(&answer, "X-Method"), "GET");
    answer = hear(fd, true);
    assert_string_equal(answer.body, "hello");

    SAY(fd, "DELETE /empty HTTP/1.1\r\n" H "\r\n" GET H "\r\n");
    answer = hear(fd, false);
    assert_int_equal(answer.status, 204);
    assert_string_equal(header(&answer, "X-Method"), "DELETE");
    assert_int_equal(hear(fd, true).status, 200);
    close(fd);
    stop(&app);
}

static void
test_query_and_headers(void **state)
{
    (void)state;
    struct app app;
    start(&app, (struct http_options){0});
    struct answer answer =
        ASK(&app, "GET /query?a=%41+b&wait=5&flag&Wait=6 HTTP/1.1\r\n" H
                  "Accept: image/png\r\n\r\n");
    assert_string_equal(answer.body, "a=A b;wait=5;flag=;Wait=6;wait=5;"
                                     "accept=image/png;loopback=yes;");
    answer = ASK(&app, "GET /%71uery HTTP/1.1\r\n" H "\r\n");
    assert_string_equal(answer.body, "wait=(none);accept=(none);loopback=yes;");
    stop(&app);
}

/* --- bodies --- */

static struct answer
post(const struct app *app, const char *path, const char *headers,
     size_t announced, size_t sent)
{
    struct bytes text = {0};
    bytes_printf(&text,
                 "POST %s HTTP/1.1\r\n" H "%sContent-Length: %zu\r\n\r\n", path,
                 headers, announced);
    for (size_t i = 0; i < sent; i++)
        bytes_append(&text, "x", 1);
    int fd = dial(app);
    say(fd, text.data, text.len);
    struct answer answer = hear(fd, true);
    close(fd);
    bytes_clear(&text);
    return answer;
}

static void
test_body_limits(void **state)
{
    (void)state;
    struct app app;
    start(&app, (struct http_options){0});
    assert_int_equal(post(&app, "/small", "", SMALL, SMALL).status, 200);
    struct answer answer = post(&app, "/small", "", SMALL + 1, SMALL + 1);
    assert_int_equal(answer.status, 413);
    assert_non_null(strstr(answer.body, "at most 1000 bytes"));
    assert_string_equal(header(&answer, "Connection"), "close");
    /* Answered before the body comes, and also while it comes. */
    assert_int_equal(post(&app, "/small", "", 1u << 30, 0).status, 413);
    assert_int_equal(post(&app, "/small", "", 30u << 20, 30u << 20).status,
                     413);
    assert_int_equal(post(&app, "/large", "", 8u << 20, 8u << 20).status, 200);
    assert_int_equal(
        post(&app, "/large", "", 1 + (8u << 20), 1 + (8u << 20)).status, 413);
    assert_int_equal(
        post(&app, "/echo", "Content-Encoding: gzip\r\n", 5, 5).status, 415);
    assert_int_equal(
        post(&app, "/echo", "Content-Encoding: identity\r\n", 5, 5).status,
        200);
    assert_int_equal(atomic_load(&app.gone), 0);
    stop(&app);
}

/* Nobody said how long it will be. */
static void
test_chunked_limit(void **state)
{
    (void)state;
    struct app app;
    start(&app, (struct http_options){0});
    int fd = dial(&app);
    struct bytes block = {0};
    bytes_text(&block, "1000\r\n");
    for (int i = 0; i < 4096; i++)
        bytes_text(&block, "x");
    bytes_text(&block, "\r\n");
    SAY(fd, "POST /small HTTP/1.1\r\n" H "Transfer-Encoding: chunked\r\n\r\n");
    for (int i = 0; i < 5000; i++) /* 20 MiB, whatever comes back */
        if (!say(fd, block.data, block.len))
            break;
    struct answer answer = hear(fd, true);
    assert_int_equal(answer.status, 413);
    assert_non_null(strstr(answer.body, "at most 1000 bytes"));
    bytes_clear(&block);
    assert_true(closed(fd));
    close(fd);
    assert_int_equal(atomic_load(&app.gone), 0);
    stop(&app);
}

static void
test_refused_before_the_body(void **state)
{
    (void)state;
    struct app app;
    start(&app, (struct http_options){0});
    /* A small body is dropped and the connection lives on. */
    int fd = dial(&app);
    SAY(fd, "POST /secret HTTP/1.1\r\n" H "Content-Length: 5\r\n\r\nhello" GET H
            "\r\n");
    assert_int_equal(hear(fd, true).status, 401);
    assert_int_equal(hear(fd, true).status, 200);
    close(fd);
    /* A large one is not waited for. */
    assert_int_equal(post(&app, "/secret", "", 1u << 30, 0).status, 401);
    assert_int_equal(post(&app, "/secret", "", 20u << 20, 20u << 20).status,
                     401);
    assert_int_equal(atomic_load(&app.handled), 1);
    stop(&app);
}

static void
test_continue(void **state)
{
    (void)state;
    struct app app;
    start(&app, (struct http_options){0});

    int fd = dial(&app);
    SAY(fd, POST "Content-Length: 5\r\nExpect: 100-continue\r\n\r\n");
    assert_int_equal(hear(fd, false).status, 100);
    SAY(fd, "hello");
    struct answer answer = hear(fd, true);
    assert_int_equal(answer.status, 200);
    assert_string_equal(answer.body, "hello");
    close(fd);

    /* The final answer comes instead of 100. */
    fd = dial(&app);
    SAY(fd, "POST /secret HTTP/1.1\r\n" H
            "Content-Length: 5\r\nExpect: 100-continue\r\n\r\n");
    assert_int_equal(hear(fd, true).status, 401);
    assert_true(closed(fd));
    close(fd);

    fd = dial(&app);
    SAY(fd, "POST /small HTTP/1.1\r\n" H
            "Content-Length: 5000\r\nExpect: 100-continue\r\n\r\n");
    assert_int_equal(hear(fd, true).status, 413);
    close(fd);
    stop(&app);
}

static void
test_bodies_budget(void **state)
{
    (void)state;
    struct app app;
    start(&app, (struct http_options){.max_bodies_bytes = 1u << 20});
    struct bytes half = {0};
    bytes_printf(&half,
                 "POST /large HTTP/1.1\r\n" H "Content-Length: 700000\r\n\r\n");
    for (size_t i = 0; i < 600000; i++)
        bytes_append(&half, "x", 1);

    int first = dial(&app), second = dial(&app);
    assert_true(say(first, half.data, half.len));
    usleep(300000);
    say(second, half.data, half.len);
    assert_int_equal(hear(second, true).status, 503);
    close(second);

    /* Given back when the first one has gone. */
    close(first);
    assert_true(wait_for(&app.gone, 1, 5000));
    assert_int_equal(post(&app, "/large", "", 600000, 600000).status, 200);
    bytes_clear(&half);
    stop(&app);
}

/* A body that hangs up in the middle: finished, and gone. */
static void
test_half_a_body(void **state)
{
    (void)state;
    struct app app;
    start(&app, (struct http_options){0});
    int fd = dial(&app);
    SAY(fd, POST "Content-Length: 100\r\n\r\nhello");
    usleep(50000);
    close(fd);
    assert_true(wait_for(&app.gone, 1, 5000));
    assert_int_equal(atomic_load(&app.handled), 0);
    stop(&app);
}

/* --- deadlines --- */

/* One byte each 50 ms never looks idle, and is late all the same. */
static void
test_drip(void **state)
{
    (void)state;
    static const char *const heads[] = {
        "GET /hello HTTP/1.1\r\nX: ",
        POST "Content-Length: 1000000\r\n\r\n",
        CHUNKED "100000\r\n",
    };
    struct app app;
    start(&app, (struct http_options){.receive_timeout_ms = 700});
    for (size_t i = 0; i < 3; i++) {
        int fd = dial(&app);
        int64_t begin = clock_monotonic_us();
        SAY(fd, heads[i]);
        struct pollfd wait = {.fd = fd, .events = POLLIN};
        while (poll(&wait, 1, 50) == 0 &&
               clock_monotonic_us() - begin < 5000000)
            say(fd, "x", 1);
        int64_t took_ms = (clock_monotonic_us() - begin) / 1000;
        struct answer answer = hear(fd, true);
        assert_int_equal(answer.status, 400);
        assert_non_null(strstr(answer.body, "within 0.7 s"));
        assert_in_range(took_ms, 600, 2000);
        close(fd);
    }
    stop(&app);
}

static void
test_silence(void **state)
{
    (void)state;
    struct app app;
    start(&app, (struct http_options){.receive_timeout_ms = 300});
    /* Half a request, then nothing. */
    int fd = dial(&app);
    SAY(fd, "GET /hel");
    assert_int_equal(hear(fd, true).status, 400);
    assert_true(closed(fd));
    close(fd);
    /* Not a byte: closed without a word. */
    fd = dial(&app);
    assert_true(closed(fd));
    close(fd);
    /* The second request of a connection has its own time, and the pause
     * before it is not part of it. */
    fd = dial(&app);
    SAY(fd, GET H "\r\n");
    assert_int_equal(hear(fd, true).status, 200);
    usleep(600000);
    SAY(fd, GET H "\r\nGET /h");
    assert_int_equal(hear(fd, true).status, 200);
    assert_int_equal(hear(fd, true).status, 400);
    assert_true(closed(fd));
    close(fd);
    stop(&app);
}

/* --- parks --- */

static void
test_park(void **state)
{
    (void)state;
    struct app app;
    start(&app, (struct http_options){0});
    int fd = dial(&app);
    SAY(fd, "GET /park HTTP/1.1\r\n" H "\r\n");
    assert_true(wait_for(&app.parked, 1, 5000));
    uint64_t ticket = atomic_load(&app.ticket);
    http_wake(app.http, ticket + 1); /* nobody's */
    http_wake(app.http, 0);
    http_wake(app.http, UINT64_MAX);
    usleep(100000);
    assert_int_equal(atomic_load(&app.handled), 1);
    http_wake(app.http, ticket);
    assert_string_equal(hear(fd, true).body, "turn 1");
    http_wake(app.http, ticket); /* over */

    int64_t begin = clock_monotonic_us();
    SAY(fd, "GET /park-short HTTP/1.1\r\n" H "\r\n");
    assert_string_equal(hear(fd, true).body, "turn 1 timed out");
    assert_in_range((clock_monotonic_us() - begin) / 1000, 45, 1000);
    http_wake(app.http, ticket);
    close(fd);
    stop(&app);
}

/* A wake between handler and park, thousands of times. */
static void
test_wake_before_park(void **state)
{
    (void)state;
    struct app app;
    start(&app, (struct http_options){0});
    int fd = dial(&app);
    for (int i = 0; i < 5000; i++) {
        SAY(fd, "GET /park-woken HTTP/1.1\r\n" H "\r\n");
        assert_string_equal(hear(fd, true).body, "turn 1");
    }
    close(fd);
    stop(&app);
}

static void *
waker(void *user)
{
    struct app *app = user;
    uint64_t last = 0;
    while (atomic_load(&app->parked) < 1000000) {
        uint64_t ticket = atomic_load(&app->ticket);
        if (ticket != last)
            http_wake(app->http, ticket);
        last = ticket;
    }
    return NULL;
}

/* The same from another thread, as the store and the pool do it. */
static void
test_wake_race(void **state)
{
    (void)state;
    struct app app;
    pthread_t thread;
    start(&app, (struct http_options){0});
    pthread_create(&thread, NULL, waker, &app);
    int fd = dial(&app);
    for (int i = 0; i < 3000; i++) {
        SAY(fd, "GET /park HTTP/1.1\r\n" H "\r\n");
        assert_string_equal(hear(fd, true).body, "turn 1");
    }
    close(fd);
    atomic_store(&app.parked, 1000000);
    pthread_join(thread, NULL);
    stop(&app);
}

static void
test_hang_up_while_parked(void **state)
{
    (void)state;
    struct app app;
    start(&app, (struct http_options){0});
    int closing = dial(&app), half = dial(&app), staying = dial(&app);
    SAY(closing, "GET /park HTTP/1.1\r\n" H "\r\n");
    SAY(half, "GET /park HTTP/1.1\r\n" H "\r\n");
    SAY(staying, "GET /park HTTP/1.1\r\n" H "\r\n");
    assert_true(wait_for(&app.parked, 3, 5000));
    close(closing);
    shutdown(half, SHUT_WR); /* a socket cannot tell this from close() */
    assert_true(wait_for(&app.gone, 2, 2000));
    assert_true(closed(half));
    usleep(1200000);
    assert_int_equal(atomic_load(&app.gone), 2);
    assert_int_equal(atomic_load(&app.handled), 3);
    close(half);
    close(staying);
    assert_true(wait_for(&app.gone, 3, 2000));
    stop(&app);
}

static void
test_many_parked(void **state)
{
    (void)state;
    enum { N = 400 };
    static int fds[N];
    struct app app;
    start(&app, (struct http_options){0});
    for (int i = 0; i < N; i++) {
        fds[i] = dial(&app);
        SAY(fds[i], "GET /park HTTP/1.1\r\n" H "\r\n");
    }
    assert_true(wait_for(&app.parked, N, 10000));
    /* They cost the others nothing. */
    int64_t begin = clock_monotonic_us();
    assert_int_equal(ASK(&app, GET H "\r\n").status, 200);
    assert_in_range(clock_monotonic_us() - begin, 0, 500000);
    /* A last turn for each. */
    http_quiesce(app.http);
    for (int i = 0; i < N; i++) {
        assert_int_equal(hear(fds[i], true).status, 200);
        close(fds[i]);
    }
    /* And no new ones. */
    struct sockaddr_in address = {.sin_family = AF_INET,
                                  .sin_port = htons(http_port(app.http)),
                                  .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    int fd = socket(AF_INET, SOCK_STREAM, 0);
    assert_int_not_equal(connect(fd, (void *)&address, sizeof address), 0);
    close(fd);
    stop(&app);
}

static void
test_stop_while_parked(void **state)
{
    (void)state;
    struct app app;
    for (int round = 0; round < 5; round++) {
        int fds[20];
        start(&app, (struct http_options){0});
        for (int i = 0; i < 20; i++) {
            fds[i] = dial(&app);
            SAY(fds[i], i % 2 == 0 ? "GET /park HTTP/1.1\r\n" H "\r\n"
                                   : POST "Content-Length: 100\r\n\r\nhello");
        }
        if (round % 2 == 0)
            assert_true(wait_for(&app.parked, 10, 5000));
        stop(&app);
        for (int i = 0; i < 20; i++)
            close(fds[i]);
    }
}

/* --- many at once --- */

static void
soak(unsigned clients, unsigned rounds)
{
    struct app app;
    int *fds = calloc(clients, sizeof *fds);
    start(&app, (struct http_options){0});
    for (unsigned i = 0; i < clients; i++)
        fds[i] = dial(&app);
    for (unsigned round = 0; round < rounds; round++) {
        for (unsigned i = 0; i < clients; i++)
            SAY(fds[i], GET H "\r\n");
        for (unsigned i = 0; i < clients; i++)
            assert_int_equal(hear(fds[i], true).status, 200);
    }
    for (unsigned i = 0; i < clients; i++)
        close(fds[i]);
    free(fds);
    assert_int_equal(atomic_load(&app.handled), clients * rounds);
    stop(&app);
}

/* 128 ready sockets are where the library's other mode stalls. */
static void
test_soak(void **state)
{
    (void)state;
    soak(127, 20);
    soak(128, 40);
    soak(129, 20);
    soak(256, 40);
}

/* Over the limit they wait in the backlog, and have their turn later. */
static void
test_max_connections(void **state)
{
    (void)state;
    struct app app;
    int fds[12];
    start(&app, (struct http_options){.max_connections = 8});
    for (int i = 0; i < 12; i++) {
        fds[i] = dial(&app);
        SAY(fds[i], GET H "\r\n");
    }
    for (int i = 0; i < 8; i++) {
        assert_int_equal(hear(fds[i], true).status, 200);
        close(fds[i]);
    }
    for (int i = 8; i < 12; i++) {
        assert_int_equal(hear(fds[i], true).status, 200);
        close(fds[i]);
    }
    stop(&app);
}

/* --- files --- */

static struct answer
get_file(const struct app *app, const char *headers)
{
    char text[256];
    snprintf(text, sizeof text, "GET /file HTTP/1.1\r\n" H "%s\r\n", headers);
    return ask(app, text, strlen(text));
}

static void
test_files(void **state)
{
    (void)state;
    struct app app;
    start(&app, (struct http_options){0});
    app.file = open("/tmp", O_TMPFILE | O_RDWR, 0600);
    assert_true(app.file >= 0);
    for (int i = 0; i < 25; i++)
        assert_int_equal(dprintf(app.file, "%04d", i), 4);

    struct answer answer = get_file(&app, "");
    assert_int_equal(answer.status, 200);
    assert_int_equal(answer.body_len, 100);
    assert_string_equal(header(&answer, "Accept-Ranges"), "bytes");
    assert_memory_equal(answer.body + 96, "0024", 4);

    answer = get_file(&app, "Range: bytes=4-11\r\n");
    assert_int_equal(answer.status, 206);
    assert_string_equal(answer.body, "00010002");
    assert_string_equal(header(&answer, "Content-Range"), "bytes 4-11/100");

    answer = get_file(&app, "Range: bytes=-4\r\nIf-Range: \"abc\"\r\n");
    assert_int_equal(answer.status, 206);
    assert_string_equal(answer.body, "0024");
    assert_int_equal(
        get_file(&app, "Range: bytes=-4\r\nIf-Range: \"old\"\r\n").status, 200);
    assert_int_equal(get_file(&app, "Range: bytes=1-2,5-6\r\n").status, 200);

    answer = get_file(&app, "Range: bytes=100-\r\n");
    assert_int_equal(answer.status, 416);
    assert_string_equal(header(&answer, "Content-Range"), "bytes */100");

    /* A file that is shorter than its reply says is no answer. */
    answer = ASK(&app, "GET /file?long HTTP/1.1\r\n" H "\r\n");
    assert_int_equal(answer.status, 0);
    stop(&app);
    close(app.file);
}

static void
test_start_errors(void **state)
{
    (void)state;
    struct app app;
    struct error err = {0};
    struct http_handler handler = {0};
    start(&app, (struct http_options){.host = "::1"});
    stop(&app);
    start(&app, (struct http_options){0});
    struct http_options taken = {.host = "127.0.0.1",
                                 .port = http_port(app.http)};
    assert_null(http_start(&taken, &handler, &err));
    assert_int_equal(err.code, ERROR_IO);
    assert_non_null(strstr(err.text, "127.0.0.1 port"));
    stop(&app);
    err = (struct error){0};
    struct http_options name = {.host = "example.org"};
    assert_null(http_start(&name, &handler, &err));
    assert_non_null(strstr(err.text, "example.org"));
}

int
main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_malformed),
        cmocka_unit_test(test_malformed_in_a_pipeline),
        cmocka_unit_test(test_malformed_behind_a_parked_one),
        cmocka_unit_test(test_wellformed),
        cmocka_unit_test(test_keep_alive),
        cmocka_unit_test(test_pipeline),
        cmocka_unit_test(test_methods),
        cmocka_unit_test(test_query_and_headers),
        cmocka_unit_test(test_body_limits),
        cmocka_unit_test(test_chunked_limit),
        cmocka_unit_test(test_refused_before_the_body),
        cmocka_unit_test(test_continue),
        cmocka_unit_test(test_bodies_budget),
        cmocka_unit_test(test_half_a_body),
        cmocka_unit_test(test_drip),
        cmocka_unit_test(test_silence),
        cmocka_unit_test(test_park),
        cmocka_unit_test(test_wake_before_park),
        cmocka_unit_test(test_wake_race),
        cmocka_unit_test(test_hang_up_while_parked),
        cmocka_unit_test(test_many_parked),
        cmocka_unit_test(test_stop_while_parked),
        cmocka_unit_test(test_soak),
        cmocka_unit_test(test_max_connections),
        cmocka_unit_test(test_files),
        cmocka_unit_test(test_start_errors),
    };
    if (argc > 1)
        cmocka_set_test_filter(argv[1]);
    log_setup(LOG_ERROR, LOG_TEXT);
    struct rlimit files;
    getrlimit(RLIMIT_NOFILE, &files);
    files.rlim_cur = files.rlim_max;
    setrlimit(RLIMIT_NOFILE, &files);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
