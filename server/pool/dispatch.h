/* dispatch.h - one job on its way: lease -> ask -> finish.
 *
 * A task is one lease and what becomes of it. Its steps:
 *
 *   LEASE ──job──▶ RENDER ──DONE──▶ PUT ──durable──▶ FINISH ──▶ over
 *     │              │               │                 │
 *     │ no job       │ FAILED, lost  │ no room
 *     ▼              ▼               │
 *    over           FAIL ◀───────────┘ ──────▶ over
 *
 * LEASE and RENDER occupy a worker, the later steps do not: it gets its next
 * job while the result is still on its way to the disk. A task has at most one
 * operation of store or blobs under way; these end on the writers' threads,
 * which write the outcome into the task and hand it to `post`. Everything else
 * here runs on the pool's loop thread.
 *
 * Times are of the monotonic clock, in microseconds. */
#ifndef SERVER_POOL_DISPATCH_H
#define SERVER_POOL_DISPATCH_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/error.h"
#include "core/base/sha256.h"
#include "server/blobs/blobs.h"
#include "server/store/store.h"
#include "server/worker/child.h"

enum task_step { TASK_LEASE, TASK_RENDER, TASK_PUT, TASK_FINISH, TASK_FAIL };

struct dispatch;

struct task {
    struct dispatch *dispatch;
    struct task *next;      /* all tasks of the dispatch */
    struct task *post_next; /* the pool's mailbox */
    enum task_step step;
    bool under_way;      /* an operation of store or blobs is */
    struct child *child; /* LEASE, RENDER: who is to do it; NULL: lost */
    struct lease *lease; /* from RENDER on */
    int64_t retry_us;    /* it was refused: try again then; 0: no */

    /* RENDER */
    unsigned threads; /* the child's crew now */
    enum job_phase phase;
    int64_t started_us;
    int64_t heard_us;  /* last message */
    int64_t beat_us;   /* last heartbeat */
    int64_t cancel_us; /* CANCEL was sent; 0: not */
    double progress;
    uint64_t rays_done;

    /* PUT, FINISH */
    uint64_t len;
    uint64_t put_number;
    struct job_stats stats;
    int fd; /* the encoded image, sealed; -1: none */
    char sha256[SHA256_HEX_SIZE];

    /* FAIL */
    enum store_failure failure;
    struct error cause;

    struct error outcome; /* of the operation that ended */
};

struct deleted_blob;

/* Zero it, fill the first group. */
struct dispatch {
    struct store *store;
    struct blobs *blobs;
    int64_t render_us;     /* wall clock of one attempt */
    int64_t stall_us;      /* no message for so long: killed */
    uint64_t result_bytes; /* largest result accepted */
    /* Any thread: call dispatch_arrived(task) on the loop soon. */
    void (*post)(void *user, struct task *task);
    void *user;

    bool stopping;          /* lease nothing more; give back what comes */
    double rays_per_second; /* learned from finished jobs; 0: none yet */

    /* dispatch.c's own */
    struct task *tasks;
    int64_t lease_from_us; /* results cannot be kept: a pause */
    int64_t lease_pause_us;
    uint64_t puts;
    struct deleted_blob *deleted;
};

/* What dispatch_arrived found. */
enum dispatch_turn {
    DISPATCH_NO_JOB, /* the task is over, its child is free */
    DISPATCH_ASK,    /* a job: call dispatch_ask */
    DISPATCH_GOES_ON,
    DISPATCH_OVER /* the task is over */
};

/* Look for a job for this idle child; NULL: not now (see dispatch_due). */
struct task *
dispatch_next(struct dispatch *d, struct child *child, int64_t now_us);

/* A posted task is back on the loop. */
enum dispatch_turn
dispatch_arrived(struct dispatch *d, struct task *task, int64_t now_us);

/* Hand the leased job to its child. False: the job went back to the queue, and
 * the child is free but of doubtful health. */
bool
dispatch_ask(struct dispatch *d, struct task *task, unsigned threads,
             int64_t now_us, struct error *err);

/* The crew's new size, sent if it is one. */
void
dispatch_threads(struct task *task, unsigned threads);

/* What a message meant for the child. */
enum dispatch_news {
    NEWS_NONE, /* it works on */
    NEWS_FREE, /* the answer came: it can be asked again */
    NEWS_ILL   /* it answered, but failed by its own fault: replace it */
};

/* A message of the task's child; its descriptors are taken as needed, the
 * caller clears it. False: against the protocol; kill the child, then
 * dispatch_lost. */
bool
dispatch_message(struct dispatch *d, struct task *task, struct message *message,
                 int64_t now_us, enum dispatch_news *news, struct error *err);

/* The child is gone, and with it this attempt. */
void
dispatch_lost(struct dispatch *d, struct task *task, enum store_failure failure,
              enum error_code code, const char *text, int64_t now_us);

/* Must this child be killed now? With what to tell dispatch_lost. */
bool
dispatch_overdue(const struct dispatch *d, const struct task *task,
                 int64_t now_us, enum store_failure *failure,
                 struct error *cause);

/* Ask the store which running jobs are to be canceled, and tell them. */
void
dispatch_look(struct dispatch *d, int64_t now_us);

/* Heartbeats and second tries that are due. */
void
dispatch_tick(struct dispatch *d, int64_t now_us);

/* When dispatch_tick or dispatch_overdue is next worth a call; INT64_MAX:
 * never. */
int64_t
dispatch_due(const struct dispatch *d, int64_t now_us);

/* Nobody's result any more: delete the blob unless a job refers to it. Safe
 * beside tasks that are about to publish the same bytes: one in FINISH keeps
 * the blob; one in PUT that turns out to have had this name puts it again,
 * behind the deletion (blobs keep the order of calls). */
void
dispatch_forget(struct dispatch *d, const char *sha256);

/* Free all tasks that no writer thread will still touch; true if none is left
 * under way. */
bool
dispatch_clear(struct dispatch *d);

#endif
