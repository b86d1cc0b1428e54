/* rank.h - fair order between owners, fixed when a job is submitted.
 *
 * Start-time fair queueing (Goyal, Vin and Cheng, SIGCOMM 1996): a job's rank
 * is the virtual time at which its owner's earlier jobs would have ended had
 * every owner had an equal share of one worker, but never earlier than the
 * clock of its priority, which stands at the greatest rank leased so far. So
 * one owner's thousand jobs line up behind each other, another's single job
 * goes to the front, and who has been idle saves up nothing. Within one owner
 * and priority the order is that of submission.
 *
 * Order of leases: priority (draft, normal, low), then rank, then submission.
 * A job that is queued again keeps its rank and so is among the first.
 *
 * Virtual times are microseconds of estimated work. Pure; any thread. */
#ifndef SERVER_JOBS_RANK_H
#define SERVER_JOBS_RANK_H

#include <stdbool.h>
#include <stdint.h>

#include "server/jobs/job.h"

enum {
    RANK_SHORT_SECONDS = 2 /* estimated below it: a job for the short lane */
};

/* Where a job stands: [start, end) of its owner's virtual time. */
struct rank_turn {
    int64_t start; /* the rank */
    int64_t end;   /* its owner's next job starts here, or later */
};

/* `clock` is that of the job's priority; `owner_end` the end of the owner's
 * last turn in that priority, 0 if he never had one. The turn is as long as
 * the estimate, at least 0.1 s and at most 600 s, so that a job without an
 * estimate counts too and a wrong one cannot shut its owner out. */
struct rank_turn
rank_next(int64_t clock, int64_t owner_end, double estimate_seconds);

/* A draft, or estimated below RANK_SHORT_SECONDS. */
bool
rank_is_short(const struct job *job);

#endif
