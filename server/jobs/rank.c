#include "server/jobs/rank.h"

static const double turn_min_us = 0.1e6, turn_max_us = 600e6;

struct rank_turn
rank_next(int64_t clock, int64_t owner_end, double estimate_seconds)
{
    double turn_us = estimate_seconds * 1e6;
    if (!(turn_us > turn_min_us)) /* also for NaN */
        turn_us = turn_min_us;
    if (turn_us > turn_max_us)
        turn_us = turn_max_us;
    int64_t start = owner_end > clock ? owner_end : clock;
    return (struct rank_turn){.start = start, .end = start + (int64_t)turn_us};
}

bool
rank_is_short(const struct job *job)
{
    return job->priority == PRIORITY_DRAFT ||
           job->estimate_seconds < RANK_SHORT_SECONDS;
}
