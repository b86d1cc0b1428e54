#include "server/pool/dispatch.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/base/clock.h"
#include "core/base/log.h"
#include "core/base/must.h"

enum {
    RETRY_US = 20 * 1000,        /* a full queue empties in milliseconds */
    RETRY_SLOW_US = 1000 * 1000, /* a full disk does not */
    PAUSE_MIN_US = 1000 * 1000,  /* no leasing after a result was lost ... */
    PAUSE_MAX_US = 30 * 1000 * 1000,
    BEAT_MIN_US = 250 * 1000,      /* heartbeats: at most 4/s ... */
    BEAT_MAX_US = 5 * 1000 * 1000, /* ... and at least this often */
    CANCEL_US = 2 * 1000 * 1000,   /* a worker that does not stop by itself */
    RATE_RAYS_MIN = 1000 * 1000    /* smaller renders say nothing about speed */
};

/* Deleted while some results were on their way to the disk, names unknown. */
struct deleted_blob {
    struct deleted_blob *next;
    char sha256[SHA256_HEX_SIZE];
    uint64_t puts; /* concerns the puts numbered below */
};

static void
step_begin(struct dispatch *d, struct task *task, int64_t now_us);

/* --- on the writers' threads: note the outcome, hand the task back --- */

static void
arrive(struct task *task, const struct error *err)
{
    task->outcome = err != NULL ? *err : (struct error){0};
    task->dispatch->post(task->dispatch->user, task);
}

static void
on_lease(void *user, struct lease *lease, const struct error *err)
{
    struct task *task = user;
    task->lease = lease;
    arrive(task, err);
}

static void
on_put(void *user, const char sha256[SHA256_HEX_SIZE], uint64_t len,
       const struct error *err)
{
    struct task *task = user;
    (void)len;
    if (sha256 != NULL)
        memcpy(task->sha256, sha256, SHA256_HEX_SIZE);
    arrive(task, err);
}

static void
on_done(void *user, const struct job *job, const struct error *err)
{
    (void)job;
    arrive(user, err);
}

/* --- tasks --- */

static void
task_free(struct dispatch *d, struct task *task)
{
    struct task **place = &d->tasks;
    while (*place != task)
        place = &(*place)->next;
    *place = task->next;
    if (task->fd >= 0)
        close(task->fd);
    if (task->lease != NULL)
        lease_free(task->lease);
    free(task);
}

static const char *
task_id(const struct task *task)
{
    return task->lease->job.id;
}

/* From now on no worker is concerned. */
static void
step_set(struct dispatch *d, struct task *task, enum task_step step,
         int64_t now_us)
{
    task->step = step;
    task->child = NULL;
    step_begin(d, task, now_us);
}

static void
task_fail(struct dispatch *d, struct task *task, enum store_failure failure,
          enum error_code code, const char *text, int64_t now_us)
{
    task->failure = failure;
    task->cause = (struct error){0};
    error_set(&task->cause, code, "%s", text);
    step_set(d, task, TASK_FAIL, now_us);
}

/* Results cannot be kept, or asks not be made: do not burn through the queue
 * while that lasts. */
static void
pause_leasing(struct dispatch *d, int64_t now_us)
{
    d->lease_pause_us =
        d->lease_pause_us == 0 ? PAUSE_MIN_US : 2 * d->lease_pause_us;
    if (d->lease_pause_us > PAUSE_MAX_US)
        d->lease_pause_us = PAUSE_MAX_US;
    d->lease_from_us = now_us + d->lease_pause_us;
}

struct task *
dispatch_next(struct dispatch *d, struct child *child, int64_t now_us)
{
    if (d->stopping || now_us < d->lease_from_us)
        return NULL;
    struct task *task = calloc(1, sizeof *task);
    if (task == NULL) {
        d->lease_from_us = now_us + RETRY_SLOW_US;
        return NULL;
    }
    task->dispatch = d;
    task->step = TASK_LEASE;
    task->child = child;
    task->fd = -1;
    task->under_way = true;
    task->next = d->tasks;
    d->tasks = task;
    struct error err = {0};
    if (!store_lease(d->store, 0, on_lease, task, &err)) {
        task_free(d, task);
        d->lease_from_us = now_us + RETRY_US;
        return NULL;
    }
    return task;
}

/* --- the steps that need no worker --- */

static bool
put_begin(struct dispatch *d, struct task *task, struct error *err)
{
    /* The blobs take a descriptor over; ours stays, for a second try. */
    int fd = fcntl(task->fd, F_DUPFD_CLOEXEC, 3);
    if (fd < 0)
        return error_errno(err, ERROR_QUEUE_FULL, errno,
                           "cannot copy a descriptor");
    task->put_number = ++d->puts;
    return blobs_put(d->blobs, fd, task->len, on_put, task, err);
}

static bool
step_call(struct dispatch *d, struct task *task, struct error *err)
{
    const struct job *job = &task->lease->job;
    MUST(task->step >= TASK_PUT); /* the others have no call of their own */
    switch (task->step) {
    case TASK_PUT: return put_begin(d, task, err);
    case TASK_FINISH:
        return store_finish(d->store, job->id, job->epoch, task->sha256,
                            task->len, &task->stats, on_done, task, err);
    case TASK_FAIL:
        return store_fail(d->store, job->id, job->epoch, task->failure,
                          task->cause.code, task->cause.text, on_done, task,
                          err);
    case TASK_LEASE:
    case TASK_RENDER: break;
    }
    return false;
}

static bool
is_no_room(enum error_code code)
{
    return code == ERROR_IO || code == ERROR_STORAGE_FULL;
}

/* The bytes cannot be kept. That is no fault of the job: it goes back to the
 * queue as it was, and leasing pauses, for the next result would be lost too. */
static void
put_failed(struct dispatch *d, struct task *task, const struct error *err,
           int64_t now_us)
{
    log_write(LOG_ERROR, "pool", "%s: cannot keep the result: %s",
              task_id(task), err->text);
    if (is_no_room(err->code)) {
        pause_leasing(d, now_us);
        task_fail(d, task, FAILURE_RELEASE, err->code, err->text, now_us);
    } else {
        task_fail(d, task, FAILURE_FINAL, err->code, err->text, now_us);
    }
}

/* Begin the step; a refused call is repeated by dispatch_tick. */
static void
step_begin(struct dispatch *d, struct task *task, int64_t now_us)
{
    struct error err = {0};
    task->retry_us = 0;
    /* Set before the call: the outcome may be posted before it returns. */
    task->under_way = true;
    if (step_call(d, task, &err))
        return;
    task->under_way = false;
    if (task->step == TASK_PUT && err.code != ERROR_QUEUE_FULL)
        put_failed(d, task, &err, now_us);
    else
        task->retry_us =
            now_us + (err.code == ERROR_QUEUE_FULL ? RETRY_US : RETRY_SLOW_US);
}

/* --- deleted blobs (see dispatch_forget in the header) --- */

static void
deleted_prune(struct dispatch *d)
{
    uint64_t oldest = UINT64_MAX;
    for (const struct task *t = d->tasks; t != NULL; t = t->next) {
        if (t->step == TASK_PUT && t->under_way && t->put_number < oldest)
            oldest = t->put_number;
    }
    for (struct deleted_blob **place = &d->deleted; *place != NULL;) {
        struct deleted_blob *one = *place;
        if (one->puts <= oldest) {
            *place = one->next;
            free(one);
        } else {
            place = &one->next;
        }
    }
}

/* Was this put overtaken by a deletion of the very same bytes? */
static bool
was_deleted(const struct dispatch *d, const struct task *task)
{
    for (const struct deleted_blob *one = d->deleted; one != NULL;
         one = one->next) {
        if (task->put_number < one->puts &&
            strcmp(one->sha256, task->sha256) == 0)
            return true;
    }
    return false;
}

void
dispatch_forget(struct dispatch *d, const char *sha256)
{
    bool puts_under_way = false;
    for (const struct task *t = d->tasks; t != NULL; t = t->next) {
        if (t->step == TASK_FINISH && strcmp(t->sha256, sha256) == 0)
            return; /* about to have a user again */
        if (t->step == TASK_PUT && t->under_way)
            puts_under_way = true;
    }
    uint64_t users = 0;
    if (!store_blob_users(d->store, sha256, &users, NULL) || users > 0)
        return;
    if (puts_under_way) {
        struct deleted_blob *one = calloc(1, sizeof *one);
        if (one == NULL)
            return; /* rather a blob too many than one too few */
        snprintf(one->sha256, sizeof one->sha256, "%s", sha256);
        one->puts = d->puts + 1;
        one->next = d->deleted;
        d->deleted = one;
    }
    blobs_delete(d->blobs, sha256);
}

/* --- outcomes, back on the loop --- */

static enum dispatch_turn
lease_arrived(struct dispatch *d, struct task *task, int64_t now_us)
{
    if (task->lease == NULL) {
        if (task->outcome.code != ERROR_NONE) {
            log_write(LOG_WARN, "pool", "cannot lease a job: %s",
                      task->outcome.text);
            d->lease_from_us = now_us + RETRY_SLOW_US;
            task_free(d, task);
            return DISPATCH_OVER;
        }
        task_free(d, task);
        return DISPATCH_NO_JOB;
    }
    if (d->stopping || task->child == NULL) {
        task_fail(d, task, FAILURE_RELEASE, ERROR_DRAINING,
                  "the worker was gone before the job reached it", now_us);
        return DISPATCH_GOES_ON;
    }
    return DISPATCH_ASK;
}

static enum dispatch_turn
put_arrived(struct dispatch *d, struct task *task, int64_t now_us)
{
    if (task->outcome.code != ERROR_NONE) {
        struct error err = task->outcome;
        put_failed(d, task, &err, now_us);
    } else if (was_deleted(d, task)) {
        step_begin(d, task, now_us);
    } else {
        d->lease_pause_us = 0;
        step_set(d, task, TASK_FINISH, now_us);
    }
    deleted_prune(d);
    return DISPATCH_GOES_ON;
}

/* The store knows another lease, or no such job: our result is nobody's. */
static bool
is_fenced(enum error_code code)
{
    return code == ERROR_CONFLICT || code == ERROR_NOT_FOUND;
}

static enum dispatch_turn
finish_arrived(struct dispatch *d, struct task *task, int64_t now_us)
{
    enum error_code code = task->outcome.code;
    if (code == ERROR_NONE || is_fenced(code)) {
        char sha256[SHA256_HEX_SIZE];
        memcpy(sha256, task->sha256, sizeof sha256);
        if (code != ERROR_NONE)
            log_write(LOG_WARN, "pool", "%s: result dropped: %s", task_id(task),
                      task->outcome.text);
        task_free(d, task);
        if (code != ERROR_NONE)
            dispatch_forget(d, sha256);
        return DISPATCH_OVER;
    }
    log_write(LOG_ERROR, "pool", "%s: cannot finish: %s", task_id(task),
              task->outcome.text);
    task->retry_us = now_us + RETRY_SLOW_US;
    return DISPATCH_GOES_ON;
}

static enum dispatch_turn
fail_arrived(struct dispatch *d, struct task *task, int64_t now_us)
{
    enum error_code code = task->outcome.code;
    if (code == ERROR_NONE || is_fenced(code)) {
        task_free(d, task);
        return DISPATCH_OVER;
    }
    log_write(LOG_ERROR, "pool", "%s: cannot end the attempt: %s",
              task_id(task), task->outcome.text);
    task->retry_us = now_us + RETRY_SLOW_US;
    return DISPATCH_GOES_ON;
}

enum dispatch_turn
dispatch_arrived(struct dispatch *d, struct task *task, int64_t now_us)
{
    MUST(task->under_way && task->step != TASK_RENDER);
    task->under_way = false;
    switch (task->step) {
    case TASK_LEASE: return lease_arrived(d, task, now_us);
    case TASK_PUT: return put_arrived(d, task, now_us);
    case TASK_FINISH: return finish_arrived(d, task, now_us);
    case TASK_FAIL: return fail_arrived(d, task, now_us);
    case TASK_RENDER: break;
    }
    return DISPATCH_OVER;
}

/* --- the worker's part --- */

bool
dispatch_ask(struct dispatch *d, struct task *task, unsigned threads,
             int64_t now_us, struct error *err)
{
    const struct job *job = &task->lease->job;
    struct error cause = {0};
    const char *scene = task->lease->scene.data;
    if (!child_render(task->child, scene != NULL ? scene : "",
                      task->lease->scene.len, job->output, strlen(job->output),
                      threads, &cause)) {
        pause_leasing(d, now_us);
        task_fail(d, task, FAILURE_RELEASE, cause.code, cause.text, now_us);
        return error_set(err, cause.code, "%s", cause.text);
    }
    task->step = TASK_RENDER;
    task->threads = threads;
    task->started_us = task->heard_us = task->beat_us = now_us;
    task->phase = JOB_LOADING;
    return true;
}

void
dispatch_threads(struct task *task, unsigned threads)
{
    if (task->step != TASK_RENDER || task->threads == threads)
        return;
    /* A worker that cannot hear this is about to be noticed as lost. */
    if (child_threads(task->child, threads, NULL))
        task->threads = threads;
}

static void
beat(struct dispatch *d, struct task *task, int64_t now_us)
{
    task->beat_us = now_us;
    /* A beat that finds the queue full is skipped: the next one says more. */
    store_heartbeat(d->store, task_id(task), task->lease->job.epoch,
                    task->phase, task->progress, task->rays_done, NULL);
}

/* A stranger's count: small enough for every store and every JSON reader. */
static uint64_t
take_count(uint64_t count)
{
    const uint64_t most = (uint64_t)1 << 53;
    return count < most ? count : most;
}

static void
take_progress(struct dispatch *d, struct task *task,
              const struct message_progress *news, int64_t now_us)
{
    static const enum job_phase phases[] = {
        [STAGE_LOADING] = JOB_LOADING,
        [STAGE_BUILDING] = JOB_BUILDING,
        [STAGE_TRACING] = JOB_TRACING,
        [STAGE_ENCODING] = JOB_ENCODING,
    };
    if (news->stage < sizeof phases / sizeof phases[0] &&
        phases[news->stage] > task->phase)
        task->phase = phases[news->stage];
    double share = 0;
    if (task->phase == JOB_ENCODING)
        share = 1;
    else if (news->total > 0 && task->phase == JOB_TRACING)
        share = (double)news->done / (double)news->total;
    /* Told progress never falls. */
    if (share > task->progress)
        task->progress = share < 1 ? share : 1;
    if (news->rays > task->rays_done)
        task->rays_done = take_count(news->rays);
    if (now_us - task->beat_us >= BEAT_MIN_US)
        beat(d, task, now_us);
}

/* A stranger's number: finite and at most a year. */
static double
take_ms(double ms)
{
    return isfinite(ms) && ms > 0 ? (ms < 3.2e10 ? ms : 3.2e10) : 0;
}

static void
learn_rate(struct dispatch *d, const struct job_stats *stats)
{
    double rays = (double)stats->rays_camera + (double)stats->rays_shadow +
                  (double)stats->rays_bounce;
    if (rays < RATE_RAYS_MIN || stats->trace_ms <= 0)
        return;
    double rate = rays / (stats->trace_ms / 1000);
    d->rays_per_second =
        d->rays_per_second > 0 ? 0.8 * d->rays_per_second + 0.2 * rate : rate;
}

static bool
take_done(struct dispatch *d, struct task *task, struct message *message,
          int64_t now_us, struct error *err)
{
    /* What comes from the other side of the wall may be a pipe that blocks
     * whoever reads it, or bytes that still change: wire_map refuses all but a
     * sealed memory file. */
    const void *bytes;
    size_t len;
    if (message->fd_count != 1)
        return error_set(err, ERROR_PROTOCOL,
                         "an answer has 1 descriptor, got %u",
                         message->fd_count);
    if (!wire_map(message->fds[0], (size_t)d->result_bytes, &bytes, &len, err))
        return false;
    wire_unmap(bytes, len);
    if (len == 0)
        return error_set(err, ERROR_PROTOCOL, "the encoded image is empty");

    const struct message_done *done = &message->body.done;
    const struct job *job = &task->lease->job;
    task->stats = (struct job_stats){
        .rays_camera = take_count(done->rays[0]),
        .rays_shadow = take_count(done->rays[1]),
        .rays_bounce = take_count(done->rays[2]),
        .queue_ms = take_ms((double)(job->started_ms - job->created_ms)),
        .load_ms = take_ms(done->load_ms),
        .build_ms = take_ms(done->build_ms),
        .trace_ms = take_ms(done->trace_ms),
        .encode_ms = take_ms(done->encode_ms),
        .peak_bytes = take_count(done->peak_bytes),
    };
    learn_rate(d, &task->stats);
    task->fd = message->fds[0];
    task->len = len;
    message->fd_count = 0;
    step_set(d, task, TASK_PUT, now_us);
    return true;
}

/* What the worker's verdict means for the job. Anything not named here is the
 * scene's fault, and would be so again. */
static enum store_failure
failure_of(const struct task *task, enum error_code code)
{
    static const struct {
        enum error_code code;
        enum store_failure failure;
    } verdicts[] = {
        {ERROR_TIMEOUT, FAILURE_ATTEMPT},
        {ERROR_STALLED, FAILURE_ATTEMPT},
        {ERROR_IO, FAILURE_ATTEMPT},
        {ERROR_INTERNAL, FAILURE_ATTEMPT},
        {ERROR_PROTOCOL, FAILURE_ATTEMPT},
        {ERROR_WORKER_CRASHED, FAILURE_ATTEMPT},
        {ERROR_NONE, FAILURE_ATTEMPT},
    };
    if (code == ERROR_CANCELED)
        return task->cancel_us > 0 ? FAILURE_CANCELED : FAILURE_ATTEMPT;
    for (size_t i = 0; i < sizeof verdicts / sizeof verdicts[0]; i++) {
        if (verdicts[i].code == code)
            return verdicts[i].failure;
    }
    return FAILURE_FINAL;
}

static enum dispatch_news
take_failed(struct dispatch *d, struct task *task,
            const struct message_failed *failed, int64_t now_us)
{
    enum error_code code = (enum error_code)failed->code;
    enum store_failure failure = failure_of(task, code);
    task_fail(d, task, failure, code, failed->text, now_us);
    return failure == FAILURE_ATTEMPT ? NEWS_ILL : NEWS_FREE;
}

bool
dispatch_message(struct dispatch *d, struct task *task, struct message *message,
                 int64_t now_us, enum dispatch_news *news, struct error *err)
{
    *news = NEWS_NONE;
    task->heard_us = now_us;
    switch (message->kind) {
    case MESSAGE_PROGRESS:
        take_progress(d, task, &message->body.progress, now_us);
        return true;
    case MESSAGE_DONE:
        if (!take_done(d, task, message, now_us, err))
            return false;
        *news = NEWS_FREE;
        return true;
    case MESSAGE_FAILED:
        *news = take_failed(d, task, &message->body.failed, now_us);
        return true;
    default:
        return error_set(err, ERROR_PROTOCOL,
                         "a message of kind %u answers no ask", message->kind);
    }
}

void
dispatch_lost(struct dispatch *d, struct task *task, enum store_failure failure,
              enum error_code code, const char *text, int64_t now_us)
{
    if (task->step == TASK_LEASE)
        task->child = NULL; /* lease_arrived gives the job back */
    else
        task_fail(d, task, failure, code, text, now_us);
}

/* --- time --- */

bool
dispatch_overdue(const struct dispatch *d, const struct task *task,
                 int64_t now_us, enum store_failure *failure,
                 struct error *cause)
{
    if (task->step != TASK_RENDER)
        return false;
    *failure = FAILURE_ATTEMPT;
    *cause = (struct error){0};
    if (task->cancel_us > 0 && now_us >= task->cancel_us + CANCEL_US) {
        *failure = FAILURE_CANCELED;
        error_set(cause, ERROR_CANCELED,
                  "canceled; the worker did not stop within 2 s");
    } else if (now_us >= task->started_us + d->render_us) {
        error_set(cause, ERROR_TIMEOUT,
                  "the render must take at most %g s (max_render_seconds)",
                  (double)d->render_us / 1e6);
    } else if (now_us >= task->heard_us + d->stall_us) {
        error_set(cause, ERROR_STALLED,
                  "the worker said nothing for %g s (stall_seconds)",
                  (double)d->stall_us / 1e6);
    } else {
        return false;
    }
    return true;
}

static void
cancel(struct task *task, int64_t now_us)
{
    task->cancel_us = now_us;
    /* A worker that cannot hear it is killed when CANCEL_US are over. */
    child_cancel(task->child, NULL);
}

void
dispatch_look(struct dispatch *d, int64_t now_us)
{
    for (struct task *t = d->tasks; t != NULL; t = t->next) {
        if (t->step != TASK_RENDER || t->cancel_us > 0)
            continue;
        struct job job;
        struct error err = {0};
        if (!store_get(d->store, task_id(t), &job, &err)) {
            if (err.code == ERROR_NOT_FOUND)
                cancel(t, now_us);
        } else if (job.cancel_requested || job.state != JOB_RUNNING ||
                   job.epoch != t->lease->job.epoch) {
            cancel(t, now_us);
        }
    }
}

void
dispatch_tick(struct dispatch *d, int64_t now_us)
{
    for (struct task *t = d->tasks; t != NULL; t = t->next) {
        if (t->retry_us > 0 && now_us >= t->retry_us)
            step_begin(d, t, now_us);
        else if (t->step == TASK_RENDER && now_us - t->beat_us >= BEAT_MAX_US)
            beat(d, t, now_us);
    }
}

static int64_t
earlier(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

int64_t
dispatch_due(const struct dispatch *d, int64_t now_us)
{
    int64_t due = INT64_MAX;
    if (!d->stopping && d->lease_from_us > now_us)
        due = d->lease_from_us;
    for (const struct task *t = d->tasks; t != NULL; t = t->next) {
        if (t->retry_us > 0)
            due = earlier(due, t->retry_us);
        if (t->step != TASK_RENDER)
            continue;
        due = earlier(due, t->beat_us + BEAT_MAX_US);
        due = earlier(due, t->started_us + d->render_us);
        due = earlier(due, t->heard_us + d->stall_us);
        if (t->cancel_us > 0)
            due = earlier(due, t->cancel_us + CANCEL_US);
    }
    return due;
}

bool
dispatch_clear(struct dispatch *d)
{
    bool all = true;
    for (struct task *t = d->tasks, *next; t != NULL; t = next) {
        next = t->next;
        if (t->under_way)
            all = false;
        else
            task_free(d, t);
    }
    deleted_prune(d);
    return all;
}
