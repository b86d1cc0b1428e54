#include "server/jobs/job.h"

#include <string.h>

static const char *const state_names[JOB_STATE_COUNT] = {
    [JOB_QUEUED] = "queued",       [JOB_RUNNING] = "running",
    [JOB_SUCCEEDED] = "succeeded", [JOB_FAILED] = "failed",
    [JOB_CANCELED] = "canceled",
};

/* Row: from; bit: to. A state may not follow itself. */
static const unsigned followers[JOB_STATE_COUNT] = {
    [JOB_QUEUED] = 1u << JOB_RUNNING | 1u << JOB_CANCELED,
    [JOB_RUNNING] = 1u << JOB_QUEUED | 1u << JOB_SUCCEEDED | 1u << JOB_FAILED |
                    1u << JOB_CANCELED,
};

static const char *const phase_names[] = {
    [JOB_PHASE_NONE] = NULL,     [JOB_LOADING] = "loading",
    [JOB_BUILDING] = "building", [JOB_TRACING] = "tracing",
    [JOB_ENCODING] = "encoding",
};

static const char *const priority_names[] = {
    [PRIORITY_DRAFT] = "draft",
    [PRIORITY_NORMAL] = "normal",
    [PRIORITY_LOW] = "low",
};

enum {
    PHASE_COUNT = sizeof phase_names / sizeof phase_names[0],
    PRIORITY_COUNT = sizeof priority_names / sizeof priority_names[0]
};

bool
job_may(enum job_state from, enum job_state to)
{
    if ((unsigned)from >= JOB_STATE_COUNT || (unsigned)to >= JOB_STATE_COUNT)
        return false;
    return (followers[from] >> to & 1u) != 0;
}

bool
job_is_over(enum job_state state)
{
    return state == JOB_SUCCEEDED || state == JOB_FAILED ||
           state == JOB_CANCELED;
}

const char *
job_state_name(enum job_state state)
{
    return (unsigned)state < JOB_STATE_COUNT ? state_names[state] : "unknown";
}

enum job_state
job_state_find(const char *name)
{
    int i = 0;
    while (i < JOB_STATE_COUNT && strcmp(name, state_names[i]) != 0)
        i++;
    return (enum job_state)i;
}

const char *
job_phase_name(enum job_phase phase)
{
    return (unsigned)phase < PHASE_COUNT ? phase_names[phase] : NULL;
}

const char *
job_priority_name(enum job_priority priority)
{
    return (unsigned)priority < PRIORITY_COUNT ? priority_names[priority]
                                               : "unknown";
}
