/* pool.h - N supervised workers, and the loop that feeds them.
 *
 * One thread polls the workers' sockets and process descriptors. A worker that
 * exits, stalls or breaks the protocol is killed and replaced: the first
 * successor at once, then with a pause from 0.1 to 10 s. An idle worker makes
 * the loop lease the best job (dispatch.c); its result goes to `blobs`, then
 * store_finish. Only dispatch.c calls store_lease, store_heartbeat,
 * store_finish and store_fail.
 *
 * A worker that reports another build or ISA class than this program's is
 * refused. Any thread may call. */
#ifndef SERVER_POOL_POOL_H
#define SERVER_POOL_POOL_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/error.h"
#include "server/blobs/blobs.h"
#include "server/store/store.h"

struct pool;

struct pool_options {
    unsigned workers;          /* >= 1 */
    unsigned threads;          /* shared out among running jobs, >= 1 */
    double max_render_seconds; /* wall clock of one attempt */
    uint64_t max_render_bytes; /* data that a worker may map beyond itself
                                  and its libraries (RLIMIT_DATA), and the
                                  largest result; 0: no limit */
    int64_t stall_ms;          /* [60000] no message for so long: killed */
    struct store *store;
    struct blobs *blobs;
};

struct pool *
pool_start(const struct pool_options *options, struct error *err);

/* A job may be waiting, or wants to be canceled: look. */
void
pool_kick(struct pool *pool);

struct pool_status {
    unsigned workers, ready, busy;
    uint64_t exits;         /* workers lost since start */
    double rays_per_second; /* learned from finished jobs; 0: none yet */
};
void
pool_status(struct pool *pool, struct pool_status *status);

/* A job that had this result blob was deleted: delete the blob too if no other
 * job refers to it or is about to (dispatch.h says why the pool decides). */
void
pool_forget_blob(struct pool *pool, const char *sha256);

/* pool_stop but for the freeing: afterwards the calls above are still allowed
 * and do nothing, so that whoever holds the pool may go later. */
void
pool_drain(struct pool *pool, int64_t grace_ms);

/* Stop leasing; running jobs have `grace_ms` to end, the rest is released
 * (attempt unchanged); then stop workers, join, free. NULL is fine. */
void
pool_stop(struct pool *pool, int64_t grace_ms);

#endif
