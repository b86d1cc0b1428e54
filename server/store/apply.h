/* apply.h - what each write does: the decisions of the store.
 *
 * A batch is the run of writes of one transaction. batch_apply takes them in
 * order; a write that is refused (another epoch, unknown id, a state that may
 * not follow) changes nothing and does not touch its neighbours. What the
 * batch changed is to be published after its commit only. Writer thread; no
 * locks, no callbacks. */
#ifndef SERVER_STORE_APPLY_H
#define SERVER_STORE_APPLY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "server/store/board.h"
#include "server/store/rows.h"
#include "server/store/store.h"

enum {
    BATCH_MAX = 512,
    BATCH_BYTES_MAX = 4 << 20, /* of scene text */
    BATCH_SLOTS = 2048,        /* > 2 * BATCH_MAX, a power of two */

    /* A running job's revision may be this far ahead of its row; then a
     * heartbeat is written through. After a restart a job found running goes
     * on above any revision that anybody can have seen. */
    REVISION_LEAP = 1 << 16
};

enum write_kind {
    WRITE_SUBMIT,
    WRITE_LEASE,
    WRITE_HEARTBEAT,
    WRITE_FINISH,
    WRITE_FAIL,
    WRITE_CANCEL,
    WRITE_DELETE,
    WRITE_KIND_COUNT
};

/* One call of store.h on its way: what was asked, and what came of it. */
struct write {
    struct write *next;
    size_t index; /* in batch->writes */
    enum write_kind kind;
    char id[ID_SIZE];
    uint32_t epoch;
    store_done_fn done;
    store_lease_fn lease_done;
    void *user;

    struct bytes scene;   /* submit */
    double max_seconds;   /* lease */
    enum job_phase phase; /* heartbeat */
    double progress;
    uint64_t rays_done;
    char result[SHA256_HEX_SIZE]; /* finish */
    uint64_t result_len;
    struct job_stats stats;
    enum store_failure failure; /* fail */
    struct error cause;

    struct error err; /* the answer */
    bool changed;     /* row holds the job as this write left it */
    bool deleted;
    bool latest;    /* the batch's last change of that job */
    struct row row; /* submit: the job asked for, too */
    struct lease *lease;
};

void
write_free(struct write *write);

struct batch {
    struct rows *rows;
    const struct board *board;
    int64_t now_ms; /* wall clock of the batch */
    struct write *writes[BATCH_MAX];
    size_t count;
    int64_t counted[JOB_STATE_COUNT]; /* change of the number of jobs */
    uint16_t slots[BATCH_SLOTS];      /* hash of id -> 1 + index in writes */
};

/* False: the batch must be rolled back, *err says why (ERROR_STORAGE_FULL,
 * ERROR_MEMORY, ERROR_IO). Can be called again after the rollback, with fewer
 * writes. */
bool
batch_apply(struct batch *batch, struct error *err);

#endif
