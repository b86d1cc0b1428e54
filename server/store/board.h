/* board.h - progress of running jobs, in memory only.
 *
 * A heartbeat is no durable write: it is chalked here and laid over the row
 * when somebody reads. Revisions never go back for a reader who looks at the
 * board first and at the row second, if the writer commits a row first and
 * wipes the board second: board_lay takes an entry only where it is ahead of
 * the row and of the same lease, and every durable change of a running job
 * writes the chalked values with a revision above the chalked one.
 *
 * No locks: store.c guards it. */
#ifndef SERVER_STORE_BOARD_H
#define SERVER_STORE_BOARD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "server/jobs/job.h"

struct board_entry {
    char id[ID_SIZE];
    uint32_t epoch;
    uint32_t revision;
    enum job_phase phase;
    double progress;
    uint64_t rays_done;
};

/* Zero it, use it, clear it. One entry per running job. */
struct board {
    struct board_entry *entries;
    size_t count, capacity;
};

void
board_clear(struct board *board);

/* Note the job's progress and revision. A heartbeat that finds no memory is
 * dropped. */
void
board_note(struct board *board, const struct job *job);

/* Forget a job, if it is there. */
void
board_wipe(struct board *board, const char *id);

/* A copy of the entry; false: there is none. */
bool
board_find(const struct board *board, const char *id,
           struct board_entry *entry);

/* Lay an entry over a row read after it. */
void
board_lay(const struct board_entry *entry, struct job *job);

#endif
