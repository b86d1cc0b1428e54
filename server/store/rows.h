/* rows.h - what a backend of the store is: rows, kept and found.
 *
 * A backend decides nothing (apply.c does) and has no threads (store.c does).
 * A `struct rows` is one view of the data, used by one thread at a time: the
 * writer's, inside begin ... commit, and a reader's, which sees what was
 * committed. Memory has one view for both.
 *
 * All calls but close and rollback: false and *err on failure. In a batch,
 * ERROR_CONFLICT (insert) and ERROR_NOT_FOUND leave the batch good; after any
 * other error it must be rolled back. */
#ifndef SERVER_STORE_ROWS_H
#define SERVER_STORE_ROWS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/bytes.h"
#include "core/base/error.h"
#include "server/jobs/job.h"
#include "server/store/store.h"

/* A job as it is kept. */
struct row {
    struct job job;
    int64_t seq;            /* order of submission, given by insert */
    int64_t rank;           /* server/jobs/rank.h */
    bool is_short;          /* likewise */
    uint32_t revision_kept; /* of the row; job.revision may be ahead of it */
};

struct rows;

struct rows_ops {
    void (*close)(struct rows *rows);

    /* --- the writer's --- */
    bool (*begin)(struct rows *rows, struct error *err);
    bool (*commit)(struct rows *rows, struct error *err);
    /* NULL: a failed insert leaves the batch as it was, nothing else fails */
    void (*rollback)(struct rows *rows);
    /* After the answers of a batch: upkeep that may take a while (a
     * checkpoint). NULL: none. */
    bool (*upkeep)(struct rows *rows, struct error *err);

    /* A new row; sets row->seq. ERROR_CONFLICT: the id is taken. */
    bool (*insert)(struct rows *rows, struct row *row, const char *scene,
                   size_t scene_len, struct error *err);
    /* Everything in row->job that may change. */
    bool (*update)(struct rows *rows, const struct row *row, struct error *err);
    bool (*remove)(struct rows *rows, const struct row *row, struct error *err);
    /* The queued row that is first in order; max_seconds as in store_lease.
     * ERROR_NOT_FOUND: none. */
    bool (*first)(struct rows *rows, double max_seconds, struct row *row,
                  struct error *err);
    /* The clock of a priority, and where the owner's last turn in it ends. */
    bool (*turn)(struct rows *rows, const char *owner,
                 enum job_priority priority, int64_t *clock, int64_t *owner_end,
                 struct error *err);
    bool (*set_turn)(struct rows *rows, const char *owner,
                     enum job_priority priority, int64_t owner_end,
                     struct error *err);
    /* The clock never goes back. */
    bool (*set_clock)(struct rows *rows, enum job_priority priority,
                      int64_t clock, struct error *err);
    /* The batch's change of the number of jobs in a state. NULL: counts by
     * itself. */
    bool (*add_count)(struct rows *rows, enum job_state state, int64_t more,
                      struct error *err);

    /* --- both --- */
    bool (*get)(struct rows *rows, const char *id, struct row *row,
                struct error *err);
    bool (*scene)(struct rows *rows, const char *id, struct bytes *scene,
                  struct error *err);
    bool (*find)(struct rows *rows, const char *render_key, const char *owner,
                 struct row *row, struct error *err);
    int (*list)(struct rows *rows, const struct store_filter *filter,
                struct job *jobs, struct error *err);
    bool (*count)(struct rows *rows, uint64_t jobs[JOB_STATE_COUNT],
                  struct error *err);
    /* Queued rows before this one. */
    bool (*position)(struct rows *rows, const struct row *row,
                     uint64_t *position, struct error *err);
    bool (*blob_users)(struct rows *rows, const char *sha256, uint64_t *users,
                       struct error *err);
};

/* First member of every backend's own struct. */
struct rows {
    const struct rows_ops *ops;
};

/* store.c: run a store over these rows, which it takes over, also on failure.
 * `reader` may be the writer's own view. `describe` is copied. */
struct store *
store_start(struct rows *writer, struct rows *reader, const char *describe,
            const struct store_options *options, struct error *err);

#endif
