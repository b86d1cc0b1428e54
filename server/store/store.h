/* store.h - where jobs survive: the contract of every backend.
 *
 * Reads return at once, on the caller's thread, and see every change whose
 * `done` was called. Writes are queued to one writer thread, which takes all
 * that is pending into one transaction; `done` is called on that thread after
 * the commit is durable (synchronous=FULL), and only wakes someone. The queue
 * holds STORE_PENDING_MAX writes: one more is ERROR_QUEUE_FULL at the call.
 *
 * Whoever changes a running job names the epoch of his lease; with an older
 * epoch nothing changes and `done` gets ERROR_CONFLICT. A write that is refused
 * does not touch the others of its transaction.
 *
 * On a full disk (also a quota or file size limit) submissions get
 * ERROR_STORAGE_FULL, what ends or deletes jobs is tried again without them.
 * Any other failed write, commit or fsync stops the process with status
 * STORE_EXIT_STATUS: nothing was acknowledged, and the next start recovers
 * from disk. At open every lease of an earlier life is void: running jobs are
 * queued again with `attempt` unchanged, or canceled if that was wished, and
 * their revision leaps above all that anybody can have seen.
 *
 * All functions may be called from any thread. */
#ifndef SERVER_STORE_STORE_H
#define SERVER_STORE_STORE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/bytes.h"
#include "core/base/error.h"
#include "server/jobs/job.h"

enum {
    STORE_PENDING_MAX = 4096,
    /* Places beyond it for those who hold leases (lease, heartbeat, finish,
     * fail): submissions cannot keep a result out. */
    STORE_PENDING_RESERVE = 1024,
    STORE_PENDING_BYTES_MAX = 64 << 20, /* scene text waiting; over it
                                           ERROR_QUEUE_FULL, too */
    STORE_LIST_MAX = 200,
    STORE_EXIT_STATUS = 70 /* of the process after a failed write or fsync */
};

struct store;

/* err->code is ERROR_NONE on success. `job` is the job as committed, or NULL;
 * both die when the call returns. */
typedef void (*store_done_fn)(void *user, const struct job *job,
                              const struct error *err);

/* A job changed. On the writer thread, after the commit, once per job and
 * commit. Calls no store function that writes. */
typedef void (*store_change_fn)(void *user, const struct job *job,
                                bool deleted);

struct store_options {
    const char *path; /* SQLite: the file; memory: unused */
    store_change_fn on_change;
    void *user;
};

/* ERROR_IO: cannot open, locked by another glintd, or a network file system. */
struct store *
store_open_sqlite(const struct store_options *options, struct error *err);

/* For tests and as documentation: the same promises but durability. */
struct store *
store_open_memory(const struct store_options *options, struct error *err);

/* Commits what is pending, checkpoints, closes. */
void
store_close(struct store *store);

/* --- writes: false (and no `done`) only if the write was not queued --- */

/* A new job, state queued, with its canonical scene text. The store sets
 * created_ms and revision 1. */
bool
store_submit(struct store *store, const struct job *job, const char *scene,
             size_t scene_len, store_done_fn done, void *user,
             struct error *err);

/* A lease is the right to work on one job. */
struct lease {
    struct job job;     /* state running, epoch and attempt of this lease */
    struct bytes scene; /* canonical text; lease_free frees it */
};

/* lease is NULL when no job fits; else taken over by the callee, who calls
 * lease_free. On the writer thread. */
typedef void (*store_lease_fn)(void *user, struct lease *lease,
                               const struct error *err);

/* The next queued job of best rank: priority, then fair between owners, then
 * oldest. `max_seconds` > 0: only jobs estimated below it, or drafts. */
bool
store_lease(struct store *store, double max_seconds, store_lease_fn done,
            void *user, struct error *err);
void
lease_free(struct lease *lease);

/* Progress of a running job; renews the lease. Not acknowledged. The change is
 * seen by readers and on_change; it need not survive a crash. */
bool
store_heartbeat(struct store *store, const char *id, uint32_t epoch,
                enum job_phase phase, double progress, uint64_t rays_done,
                struct error *err);

/* running -> succeeded. The result blob is durable already. */
bool
store_finish(struct store *store, const char *id, uint32_t epoch,
             const char *result, uint64_t result_len,
             const struct job_stats *stats, store_done_fn done, void *user,
             struct error *err);

enum store_failure {
    FAILURE_FINAL,   /* failed now: invalid, out of memory */
    FAILURE_ATTEMPT, /* the worker died, stalled or timed out: queued again
                         while attempts are left, else failed */
    FAILURE_RELEASE, /* nobody's fault (drain): queued again, attempt as before */
    FAILURE_CANCELED /* the worker stopped as wished: canceled */
};

/* The end of a lease without a result. A job with cancel_requested becomes
 * canceled whatever the failure. */
bool
store_fail(struct store *store, const char *id, uint32_t epoch,
           enum store_failure failure, enum error_code code, const char *text,
           store_done_fn done, void *user, struct error *err);

/* queued -> canceled at once; running -> cancel_requested; canceled: nothing;
 * succeeded or failed: ERROR_CONFLICT; unknown: ERROR_NOT_FOUND. */
bool
store_cancel(struct store *store, const char *id, store_done_fn done,
             void *user, struct error *err);

/* Forget a job that is over. Running or queued: ERROR_CONFLICT. */
bool
store_delete(struct store *store, const char *id, store_done_fn done,
             void *user, struct error *err);

/* --- reads --- */

/* ERROR_NOT_FOUND, ERROR_IO. */
bool
store_get(struct store *store, const char *id, struct job *job,
          struct error *err);

/* The canonical scene text of a job, appended. */
bool
store_scene(struct store *store, const char *id, struct bytes *scene,
            struct error *err);

/* A succeeded job with this render key that `owner` may see, the newest. */
bool
store_find(struct store *store, const char *render_key, const char *owner,
           struct job *job, struct error *err);

struct store_filter {
    const char *owner;  /* NULL: everybody's */
    const char *tag;    /* NULL or "": any */
    const char *before; /* id: only older ones (the cursor); NULL: from the
                             newest */
    int64_t since_ms;   /* created at or after; 0: any */
    unsigned states;    /* bit (1 << state); 0: any */
    unsigned limit;     /* 1...200 */
};

/* Newest first; returns the number written to jobs[limit], -1 on ERROR_IO. */
int
store_list(struct store *store, const struct store_filter *filter,
           struct job *jobs, struct error *err);

struct store_counts {
    uint64_t jobs[JOB_STATE_COUNT];
    uint64_t pending_writes;
};
bool
store_count(struct store *store, struct store_counts *counts,
            struct error *err);

/* Jobs waiting before this queued one, 0 for the next to start. */
bool
store_position(struct store *store, const char *id, uint64_t *position,
               struct error *err);

/* How many jobs refer to this blob as their result. */
bool
store_blob_users(struct store *store, const char *sha256, uint64_t *users,
                 struct error *err);

/* "memory", "sqlite 3.40.1" */
const char *
store_describe(const struct store *store);

#endif
