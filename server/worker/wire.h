/* wire.h - the messages over the wall between those who listen and those who
 * trace. Both sides use this file and nothing else of each other.
 *
 * A message is one record on a SOCK_SEQPACKET socketpair: a fixed struct of
 * plain data, with at most WIRE_FD_MAX descriptors passed beside it. Record
 * boundaries are the socket's, so there is no framing to get wrong; a record of
 * another size, magic or version is ERROR_PROTOCOL and the peer is given up.
 * Large data (scene text, encoded image) travels as memory files sealed against
 * shrinking, growing and writing; wire_map refuses any other.
 *
 * One ask at a time per worker: RENDER, then PROGRESS (<= 10/s), then exactly
 * one DONE or FAILED with the same ask number. CANCEL and THREADS concern the
 * ask under way and have no answer of their own. READY comes once, first. */
#ifndef SERVER_WORKER_WIRE_H
#define SERVER_WORKER_WIRE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/error.h"

enum { WIRE_VERSION = 1, WIRE_FD_MAX = 2, WIRE_TEXT_SIZE = 384 };

enum message_kind {
    MESSAGE_READY = 1, /* up: protocol, core version, build, ISA class */
    MESSAGE_PROGRESS,  /* up */
    MESSAGE_DONE,      /* up: fds[0] = the encoded image */
    MESSAGE_FAILED,    /* up: code and sentence */
    MESSAGE_RENDER,    /* down: fds[0] = canonical scene, fds[1] = output */
    MESSAGE_CANCEL,    /* down */
    MESSAGE_THREADS,   /* down: crew size from the next tile on */
    MESSAGE_KIND_COUNT
};

enum render_stage {
    STAGE_LOADING,
    STAGE_BUILDING,
    STAGE_TRACING,
    STAGE_ENCODING
};

struct message_ready {
    char version[32];
    char build[72];
    char isa[32];
};

struct message_progress {
    uint32_t stage;       /* enum render_stage */
    uint32_t done, total; /* tiles */
    uint64_t rays;
};

struct message_done {
    uint32_t width, height;
    uint64_t rays[3]; /* camera, shadow, bounce */
    double load_ms, build_ms, trace_ms, encode_ms;
    uint64_t peak_bytes; /* of the worker's memory */
};

struct message_failed {
    uint32_t code; /* enum error_code */
    char text[WIRE_TEXT_SIZE];
};

struct message_threads {
    uint32_t threads; /* >= 1; RENDER: crew size to start with */
};

struct message {
    uint32_t kind; /* enum message_kind */
    uint32_t ask;  /* chosen by the asker, > 0; 0 in READY */
    union {
        struct message_ready ready;
        struct message_progress progress;
        struct message_done done;
        struct message_failed failed;
        struct message_threads threads; /* THREADS and RENDER */
    } body;
    int fds[WIRE_FD_MAX]; /* owned by the receiver; see message_clear */
    uint32_t fd_count;
};

/* Close the descriptors and zero. */
void
message_clear(struct message *message);

/* Send; the descriptors stay the caller's. ERROR_IO when the peer is gone. */
bool
wire_send(int socket, const struct message *message, struct error *err);

enum wire_status {
    WIRE_MESSAGE, /* one record, checked */
    WIRE_NOTHING, /* non-blocking and none there */
    WIRE_CLOSED,  /* the peer has gone */
    WIRE_BROKEN   /* protocol error; err says which */
};

/* Receive one record; `wait` false: do not block. Strings in it are
 * NUL-terminated, enums in range, fd_count as the kind demands. */
enum wire_status
wire_receive(int socket, bool wait, struct message *message, struct error *err);

/* A sealed memory file with a copy of data; -1 on failure. */
int
wire_memfd(const char *name, const void *data, size_t len, struct error *err);

/* Map a memory file read-only. Refuses one that is not sealed against shrink,
 * grow and write, or is over `limit` bytes. Empty files map to "". */
bool
wire_map(int fd, size_t limit, const void **data, size_t *len,
         struct error *err);
void
wire_unmap(const void *data, size_t len);

#endif
