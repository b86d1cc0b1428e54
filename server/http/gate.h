/* gate.h - is this byte stream a run of well-formed HTTP/1.1 requests?
 *
 * The HTTP library is lenient: it takes a bare LF for a line end, ignores the
 * second of two Content-Lengths, lets Transfer-Encoding win over
 * Content-Length, cuts a header at a NUL, unfolds folded lines. Whoever stands
 * in front of it may read such a message differently, and then one request
 * hides inside another (RFC 9112, sections 2.2, 5, 6 and 11.2). The gate sees
 * every byte of a connection before the library does and knows one reading
 * only; what has two is refused.
 *
 * A plain state machine: no memory, no sockets, no library; one per connection;
 * zero is the start. It follows the framing of every message, chunked ones
 * included, so requests in a pipeline are judged as the first one is. */
#ifndef SERVER_HTTP_GATE_H
#define SERVER_HTTP_GATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum gate_refusal {
    GATE_NONE,
    GATE_MALFORMED, /* two readings, or none */
    GATE_CODING,    /* a transfer coding that is not `chunked` */
    GATE_VERSION    /* HTTP, but neither 1.0 nor 1.1 */
};

struct gate {
    uint64_t left;      /* bytes of the body or of the chunk still to come */
    uint64_t length;    /* Content-Length */
    const char *detail; /* after a refusal: one sentence, static */
    uint32_t heads;     /* heads seen whole and found good */
    uint16_t line;      /* bytes of the chunk size line, or matched so far */
    uint8_t state;
    uint8_t refusal; /* enum gate_refusal */
    uint8_t name_len, value_len;
    uint8_t hosts, lengths, codings; /* how many of these headers, at most 2 */
    bool http10, chunked, trailer;
    bool blank;     /* an empty line came before the request line */
    bool cut;       /* the value was longer than we keep */
    char name[18];  /* lower case; longer names are cut */
    char value[24]; /* of the three headers that frame; longer ones cut */
};

/* Look at the next `n` bytes. False when they hold a violation: then `whole`
 * is how many of them belong to requests that ended before the bad one began
 * (0: none), and the gate stays shut for ever. */
bool
gate_feed(struct gate *gate, const char *data, size_t n, size_t *whole);

/* Between two requests: nothing of a next one has come yet. */
bool
gate_between(const struct gate *gate);

#endif
