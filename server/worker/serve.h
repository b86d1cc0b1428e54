/* serve.h - the worker's side of the talk: READY, then one ask after another.
 *
 * `serve` reads asks from the socket and lets run.c do them. While an ask is
 * under way its `struct turn` is how run.c speaks up the line and hears what
 * comes down it. One thread: the one that called serve. */
#ifndef SERVER_WORKER_SERVE_H
#define SERVER_WORKER_SERVE_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "server/worker/wire.h"

/* The ask under way. */
struct turn {
    int socket;
    uint32_t ask;
    atomic_uint threads; /* crew members wanted now; THREADS changes it, the
                            crew reads it */
    bool canceled;
    int64_t next_progress_us; /* monotonic; not before it */
};

/* Read what came down the line, without waiting. False once the ask is
 * canceled. Ends the process when the parent has gone: nobody would read the
 * answer. */
bool
turn_listen(struct turn *turn);

/* PROGRESS up the line, at most ten a second; the rest is dropped, and so is
 * one that the parent has no room for. */
void
turn_progress(struct turn *turn, const struct message_progress *progress);

/* Serve until the parent goes: status 0, or breaks the protocol: status 1. */
int
serve(int socket);

#endif
