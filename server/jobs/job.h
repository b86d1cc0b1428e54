/* job.h - what a job is, and what may change.
 *
 *              lease                finish
 *   queued ─────────────▶ running ─────────▶ succeeded
 *     ▲  │                 │  │ │
 *     │  │ cancel          │  │ └──────────▶ failed      fail, attempts used up
 *     │  └───────▶ canceled◀──┘ cancel
 *     └────────────────────┘ lost worker with attempts left; glintd's restart
 *
 * The wish to cancel a running job is a flag. `revision` grows with every
 * change. `epoch` grows with every lease and fences out late results; `attempt`
 * grows only for a worker's crash, stall or time-out (decision 0013). Plain
 * data, copied by value; the scene's text is stored beside it. */
#ifndef SERVER_JOBS_JOB_H
#define SERVER_JOBS_JOB_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/error.h"
#include "core/base/sha256.h"
#include "core/base/ulid.h"

enum job_state {
    JOB_QUEUED,
    JOB_RUNNING,
    JOB_SUCCEEDED,
    JOB_FAILED,
    JOB_CANCELED,
    JOB_STATE_COUNT
};

enum job_phase {
    JOB_PHASE_NONE,
    JOB_LOADING,
    JOB_BUILDING,
    JOB_TRACING,
    JOB_ENCODING
};

enum job_priority { PRIORITY_DRAFT, PRIORITY_NORMAL, PRIORITY_LOW };

enum {
    JOB_TAG_MAX = 16,
    JOB_TAGS_SIZE = JOB_TAG_MAX * 65 + 1, /* names, comma separated */
    JOB_OWNER_SIZE = 64,
    JOB_ATTEMPTS_DEFAULT = 3,
    JOB_ATTEMPTS_LIMIT = 10
};

struct job_stats {
    uint64_t rays_camera, rays_shadow, rays_bounce;
    double queue_ms, load_ms, build_ms, trace_ms, encode_ms;
    uint64_t peak_bytes;
};

struct job {
    char id[ID_SIZE];
    char owner[JOB_OWNER_SIZE]; /* key id; "" with auth=none */
    enum job_state state;
    enum job_phase phase;
    bool cancel_requested;
    uint32_t revision;
    uint32_t epoch;
    uint32_t attempt; /* 1 while and after the first is running; 0 queued new */
    uint32_t max_attempts;
    enum job_priority priority;
    double progress; /* 0...1 */
    uint64_t rays_done;
    int64_t created_ms, started_ms, finished_ms; /* wall; 0: not yet */
    char scene_hash[80];
    char render_key[SHA256_HEX_SIZE];
    char output[512]; /* canonical output settings, JSON */
    char tags[JOB_TAGS_SIZE];
    char settings[1024]; /* effective settings, JSON */
    double estimate_rays, estimate_seconds, estimate_bytes;
    bool no_cache;                /* its result is never found by others */
    char result[SHA256_HEX_SIZE]; /* blob of the encoded image; "" none */
    uint64_t result_len;
    char media_type[32];
    struct job_stats stats;     /* of the attempt that succeeded */
    enum error_code error_code; /* failed: cause */
    char error_text[384];
};

/* The one place that decides what may follow what. */
bool
job_may(enum job_state from, enum job_state to);

/* succeeded, failed or canceled */
bool
job_is_over(enum job_state state);

const char *
job_state_name(enum job_state state);
/* JOB_STATE_COUNT if there is no such state. */
enum job_state
job_state_find(const char *name);
const char *
job_phase_name(enum job_phase phase); /* NULL for none */
const char *
job_priority_name(enum job_priority priority);

#endif
