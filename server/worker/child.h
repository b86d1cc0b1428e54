/* child.h - one worker seen from outside: start, ask, listen, stop.
 *
 * Used by the pool (many children, one poll loop) and by `glint` at a desk (one
 * child). A child is a process of the program glint-worker, which stands beside
 * the calling program unless GLINT_WORKER names it. It gets one socket as
 * descriptor 3, an empty environment but what it needs, and dies with its
 * parent. Not thread-safe: one owner per child. */
#ifndef SERVER_WORKER_CHILD_H
#define SERVER_WORKER_CHILD_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

#include "core/base/error.h"
#include "server/worker/wire.h"

struct child {
    pid_t pid;                  /* 0: none */
    int pidfd;                  /* readable when the process has ended */
    int socket;                 /* non-blocking for the pool's poll loop */
    uint32_t ask;               /* number of the last ask; 0: none yet */
    bool busy;                  /* an ask is under way */
    bool ready;                 /* READY came */
    struct message_ready about; /* valid once ready */
};

/* Fork and exec. `memory_limit` in bytes for RLIMIT_AS, 0: none. ERROR_IO. */
bool
child_start(struct child *child, uint64_t memory_limit, struct error *err);

/* Send RENDER with the canonical scene and output as sealed memory files and
 * `threads` to start with. The child must be ready and not busy. */
bool
child_render(struct child *child, const char *scene, size_t scene_len,
             const char *output, size_t output_len, unsigned threads,
             struct error *err);
bool
child_cancel(struct child *child, struct error *err);
bool
child_threads(struct child *child, unsigned threads, struct error *err);

/* The next message; keeps `ready` and `busy` up to date. A message that is out
 * of turn, or of another version or ask, is WIRE_BROKEN. */
enum wire_status
child_receive(struct child *child, bool wait, struct message *message,
              struct error *err);

/* SIGKILL, reap, close. `how` (or NULL) gets one sentence: "killed by signal 9",
 * "exited with status 1". Harmless on a child never started. */
void
child_stop(struct child *child, char how[64]);

#endif
