/* rig.h - a pool with a store in memory and blobs in a temporary folder. */
#ifndef TESTS_UNIT_POOL_RIG_H
#define TESTS_UNIT_POOL_RIG_H

#include <stdatomic.h>
#include <stdint.h>
#include <sys/types.h>

#include "server/blobs/blobs.h"
#include "server/pool/pool.h"
#include "server/store/store.h"

struct rig {
    struct store *store;
    struct blobs *blobs;
    _Atomic(struct pool *) pool;
    char folder[64];
    struct pool_options options; /* what was asked, for a second pool */
};

/* Zero in `options` means: 1 worker, 2 threads, 60 s, 1 GiB, stall 30 s. */
void
rig_open(struct rig *rig, struct pool_options options);

/* Another pool over the same store, after pool_stop. */
void
rig_start_pool(struct rig *rig);
void
rig_stop_pool(struct rig *rig, int64_t grace_ms);
void
rig_close(struct rig *rig);

/* Submit this scene; returns the job's id in `id`. */
void
rig_submit(struct rig *rig, const char *scene, unsigned max_attempts,
           char id[ID_SIZE]);
void
rig_cancel(struct rig *rig, const char *id);
void
rig_delete(struct rig *rig, const char *id);

/* The job as soon as it is in that state; the test fails when it takes more
 * than `ms`, or when the job has ended otherwise. */
struct job
rig_wait(struct rig *rig, const char *id, enum job_state state, int64_t ms);
struct job
rig_get(struct rig *rig, const char *id);

/* Wait until the job has told some progress of its tracing. */
void
rig_wait_tracing(struct rig *rig, const char *id);

/* Wait until so many workers are ready. */
void
rig_wait_ready(struct rig *rig, unsigned count, int64_t ms);
struct pool_status
rig_status(struct rig *rig);

/* Children of this process that run, at most `max`. */
unsigned
rig_workers(pid_t *pids, unsigned max);

/* Send a signal to all workers. */
void
rig_signal_workers(int number);

/* Whether a result blob is there. */
bool
rig_has_blob(struct rig *rig, const char *sha256);

int64_t
rig_now_ms(void);
void
rig_sleep_ms(int64_t ms);

#endif
