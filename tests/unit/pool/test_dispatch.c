/* The way of one job, step by step, against a store, blobs and a worker that
 * are acted: every refusal, loss and overtaking at the moment of our choice. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "server/pool/dispatch.h"

enum { SECOND = 1000000 };

/* --- the actors: what was called last, and how the next call behaves --- */

static struct {
    int leases, heartbeats, finishes, fails, puts, deletes;
    enum error_code refuse; /* the next calls of store and blobs */
    store_lease_fn lease_done;
    store_done_fn done;
    blobs_done_fn put_done;
    void *user;
    enum store_failure failure;
    enum error_code code;
    char text[400];
    char finished[SHA256_HEX_SIZE];
    struct job_stats stats;
    double progress;
    enum job_phase phase;
    int put_fd;
    uint64_t users; /* of any blob */
    struct job job; /* what store_get gives */
    bool child_refuses;
    int renders, cancels;
    unsigned threads;
} act;

static bool
refused(struct error *err)
{
    if (act.refuse == ERROR_NONE)
        return false;
    error_set(err, act.refuse, "refused");
    return true;
}

bool
store_lease(struct store *store, double max_seconds, store_lease_fn done,
            void *user, struct error *err)
{
    (void)store;
    assert_true(max_seconds <= 0);
    act.leases++;
    act.lease_done = done;
    act.user = user;
    return !refused(err);
}

void
lease_free(struct lease *lease)
{
    bytes_clear(&lease->scene);
    free(lease);
}

bool
store_heartbeat(struct store *store, const char *id, uint32_t epoch,
                enum job_phase phase, double progress, uint64_t rays_done,
                struct error *err)
{
    (void)store;
    (void)id;
    (void)rays_done;
    assert_int_equal(epoch, 7);
    act.heartbeats++;
    act.progress = progress;
    act.phase = phase;
    return !refused(err);
}

bool
store_finish(struct store *store, const char *id, uint32_t epoch,
             const char *result, uint64_t result_len,
             const struct job_stats *stats, store_done_fn done, void *user,
             struct error *err)
{
    (void)store;
    (void)id;
    (void)result_len;
    assert_int_equal(epoch, 7);
    act.finishes++;
    snprintf(act.finished, sizeof act.finished, "%s", result);
    act.stats = *stats;
    act.done = done;
    act.user = user;
    return !refused(err);
}

bool
store_fail(struct store *store, const char *id, uint32_t epoch,
           enum store_failure failure, enum error_code code, const char *text,
           store_done_fn done, void *user, struct error *err)
{
    (void)store;
    (void)id;
    assert_int_equal(epoch, 7);
    act.fails++;
    act.failure = failure;
    act.code = code;
    snprintf(act.text, sizeof act.text, "%s", text);
    act.done = done;
    act.user = user;
    return !refused(err);
}

bool
store_get(struct store *store, const char *id, struct job *job,
          struct error *err)
{
    (void)store;
    (void)id;
    (void)err;
    *job = act.job;
    return true;
}

bool
store_blob_users(struct store *store, const char *sha256, uint64_t *users,
                 struct error *err)
{
    (void)store;
    (void)sha256;
    (void)err;
    *users = act.users;
    return true;
}

bool
blobs_put(struct blobs *blobs, int fd, uint64_t len, blobs_done_fn done,
          void *user, struct error *err)
{
    (void)blobs;
    (void)len;
    act.puts++;
    act.put_done = done;
    act.user = user;
    close(fd);
    return !refused(err);
}

void
blobs_delete(struct blobs *blobs, const char *sha256)
{
    (void)blobs;
    (void)sha256;
    act.deletes++;
}

bool
child_render(struct child *child, const char *scene, size_t scene_len,
             const char *output, size_t output_len, unsigned threads,
             struct error *err)
{
    (void)child;
    (void)output;
    (void)output_len;
    assert_int_equal(strlen(scene), scene_len);
    act.renders++;
    act.threads = threads;
    return !act.child_refuses || error_set(err, ERROR_IO, "nobody there");
}

bool
child_cancel(struct child *child, struct error *err)
{
    (void)child;
    (void)err;
    act.cancels++;
    return true;
}

bool
child_threads(struct child *child, unsigned threads, struct error *err)
{
    (void)child;
    (void)err;
    act.threads = threads;
    return true;
}

/* --- the stage --- */

static struct dispatch d;
static struct child child;
static struct task *posted;
static int64_t now;

static void
post(void *user, struct task *task)
{
    (void)user;
    assert_null(posted);
    posted = task;
}

static int
set_stage(void **state)
{
    (void)state;
    memset(&act, 0, sizeof act);
    act.put_fd = -1;
    act.job = (struct job){.state = JOB_RUNNING, .epoch = 7};
    d = (struct dispatch){.render_us = 100 * (int64_t)SECOND,
                          .stall_us = 10 * (int64_t)SECOND,
                          .result_bytes = 1 << 20,
                          .post = post};
    posted = NULL;
    now = 1000 * (int64_t)SECOND;
    return 0;
}

static int
strike(void **state)
{
    (void)state;
    /* The curtain falls on whatever is still under way. */
    for (struct task *t = d.tasks; t != NULL; t = t->next)
        t->under_way = false;
    return dispatch_clear(&d) && d.tasks == NULL && d.deleted == NULL ? 0 : -1;
}

static struct task *
take_posted(void)
{
    struct task *task = posted;
    assert_non_null(task);
    posted = NULL;
    return task;
}

static struct lease *
new_lease(void)
{
    struct lease *lease = calloc(1, sizeof *lease);
    assert_non_null(lease);
    snprintf(lease->job.id, sizeof lease->job.id, "job_1");
    snprintf(lease->job.output, sizeof lease->job.output, "{}");
    lease->job.epoch = 7;
    lease->job.created_ms = 1000;
    lease->job.started_ms = 1250;
    bytes_text(&lease->scene, "{}");
    return lease;
}

static const struct error none = {0};

static void
end_store(enum error_code code)
{
    struct error err = {0};
    if (code != ERROR_NONE)
        error_set(&err, code, "acted");
    act.done(act.user, NULL, &err);
}

static void
end_put(const char *sha256, enum error_code code)
{
    struct error err = {0};
    if (code != ERROR_NONE)
        error_set(&err, code, "acted");
    act.put_done(act.user, sha256, 4, &err);
}

static struct task *
lease(void)
{
    struct task *task = dispatch_next(&d, &child, now);
    assert_non_null(task);
    act.lease_done(act.user, new_lease(), &none);
    assert_int_equal(dispatch_arrived(&d, take_posted(), now), DISPATCH_ASK);
    return task;
}

static struct task *
render(void)
{
    struct task *task = lease();
    assert_true(dispatch_ask(&d, task, 2, now, NULL));
    assert_int_equal(task->step, TASK_RENDER);
    return task;
}

static enum dispatch_news news;

static bool
say(struct task *task, struct message *message)
{
    bool ok = dispatch_message(&d, task, message, now, &news, NULL);
    message_clear(message);
    return ok;
}

/* Rays of the next acted render. */
static uint64_t rays_done = 2000000;

static bool
say_done(struct task *task, int fd)
{
    struct message message = {.kind = MESSAGE_DONE, .fds = {fd, -1}};
    message.fd_count = 1;
    message.body.done.rays[0] = rays_done;
    message.body.done.trace_ms = 100;
    message.body.done.load_ms = NAN;
    message.body.done.build_ms = -3;
    message.body.done.peak_bytes = UINT64_MAX;
    return say(task, &message);
}

static int
sealed(void)
{
    int fd = wire_memfd("test", "PNG!", 4, NULL);
    assert_true(fd >= 0);
    return fd;
}

static struct task *
put(void)
{
    struct task *task = render();
    assert_true(say_done(task, sealed()));
    assert_int_equal(task->step, TASK_PUT);
    return task;
}

static bool
fail_with(struct task *task, enum error_code code)
{
    struct message message = {.kind = MESSAGE_FAILED};
    message.body.failed.code = code;
    snprintf(message.body.failed.text, sizeof message.body.failed.text, "no");
    return say(task, &message);
}

#define SHA_A "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"
#define SHA_B "bbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbb"

/* --- scenes --- */

static void
test_a_small_render_teaches_no_rate(void **state)
{
    (void)state;
    rays_done = 768;
    put();
    rays_done = 2000000;
    assert_float_equal(d.rays_per_second, 0, 0);
}

static void
test_lease_render_put_finish(void **state)
{
    (void)state;
    put();
    end_put(SHA_A, ERROR_NONE);
    assert_int_equal(dispatch_arrived(&d, take_posted(), now),
                     DISPATCH_GOES_ON);
    assert_int_equal(act.finishes, 1);
    assert_string_equal(act.finished, SHA_A);
    /* A stranger's numbers are tamed. */
    assert_float_equal(act.stats.trace_ms, 100, 0);
    assert_float_equal(act.stats.load_ms, 0, 0);
    assert_float_equal(act.stats.build_ms, 0, 0);
    assert_float_equal(act.stats.queue_ms, 250, 0);
    assert_true(act.stats.peak_bytes == (uint64_t)1 << 53);
    assert_float_equal(d.rays_per_second, 2e7, 1);
    end_store(ERROR_NONE);
    assert_int_equal(dispatch_arrived(&d, take_posted(), now), DISPATCH_OVER);
    assert_null(d.tasks);
    assert_int_equal(act.fails, 0);
}

static void
test_no_job(void **state)
{
    (void)state;
    assert_non_null(dispatch_next(&d, &child, now));
    act.lease_done(act.user, NULL, &none);
    assert_int_equal(dispatch_arrived(&d, take_posted(), now), DISPATCH_NO_JOB);
    assert_null(d.tasks);
}

static void
test_a_full_queue_is_asked_again(void **state)
{
    (void)state;
    act.refuse = ERROR_QUEUE_FULL;
    assert_null(dispatch_next(&d, &child, now));
    assert_null(dispatch_next(&d, &child, now));
    assert_int_equal(act.leases, 1);
    act.refuse = ERROR_NONE;
    int64_t due = dispatch_due(&d, now);
    assert_true(due > now && due <= now + SECOND);
    now = due;
    /* The same for what comes later. */
    put();
    end_put(SHA_A, ERROR_NONE);
    act.refuse = ERROR_QUEUE_FULL;
    dispatch_arrived(&d, take_posted(), now);
    assert_int_equal(act.finishes, 1);
    dispatch_tick(&d, now);
    assert_int_equal(act.finishes, 1);
    act.refuse = ERROR_NONE;
    now = dispatch_due(&d, now);
    dispatch_tick(&d, now);
    assert_int_equal(act.finishes, 2);
    end_store(ERROR_NONE);
    assert_int_equal(dispatch_arrived(&d, take_posted(), now), DISPATCH_OVER);
}

static void
test_a_failed_lease_is_tried_again_later(void **state)
{
    (void)state;
    assert_non_null(dispatch_next(&d, &child, now));
    struct error err = {0};
    error_set(&err, ERROR_STORAGE_FULL, "full");
    act.lease_done(act.user, NULL, &err);
    assert_int_equal(dispatch_arrived(&d, take_posted(), now), DISPATCH_OVER);
    assert_null(dispatch_next(&d, &child, now));
    now = dispatch_due(&d, now);
    lease();
}

static void
test_no_room_for_the_result_costs_no_attempt(void **state)
{
    (void)state;
    put();
    end_put(NULL, ERROR_STORAGE_FULL);
    dispatch_arrived(&d, take_posted(), now);
    assert_int_equal(act.fails, 1);
    assert_int_equal(act.failure, FAILURE_RELEASE);
    end_store(ERROR_NONE);
    assert_int_equal(dispatch_arrived(&d, take_posted(), now), DISPATCH_OVER);
    /* Leasing pauses, longer each time, until one result is kept. */
    assert_null(dispatch_next(&d, &child, now));
    int64_t first = dispatch_due(&d, now) - now;
    now += first;
    put();
    end_put(NULL, ERROR_IO);
    dispatch_arrived(&d, take_posted(), now);
    end_store(ERROR_NONE);
    dispatch_arrived(&d, take_posted(), now);
    assert_int_equal(dispatch_due(&d, now) - now, 2 * first);
}

static void
test_hostile_descriptors(void **state)
{
    (void)state;
    int ends[2];
    assert_int_equal(pipe(ends), 0);
    assert_false(say_done(render(), ends[0]));
    close(ends[1]);
    int unsealed = memfd_create("x", MFD_ALLOW_SEALING);
    assert_int_equal(ftruncate(unsealed, 4), 0);
    assert_false(say_done(render(), unsealed));
    int empty = wire_memfd("x", "", 0, NULL);
    assert_false(say_done(render(), empty));
    char *much = calloc(1, (1 << 20) + 1);
    int big = wire_memfd("x", much, (1 << 20) + 1, NULL);
    free(much);
    assert_false(say_done(render(), big));
    assert_int_equal(act.puts, 0);
}

static void
test_verdicts(void **state)
{
    (void)state;
    static const struct {
        enum error_code code;
        enum store_failure failure;
    } rows[] = {
        {ERROR_NUMBER_TOO_SMALL, FAILURE_FINAL},
        {ERROR_MEMORY, FAILURE_FINAL},
        {ERROR_BUDGET_BYTES, FAILURE_FINAL},
        {ERROR_INTERNAL, FAILURE_ATTEMPT},
        {ERROR_IO, FAILURE_ATTEMPT},
        {ERROR_PROTOCOL, FAILURE_ATTEMPT},
        {ERROR_TIMEOUT, FAILURE_ATTEMPT},
        /* Nobody asked it to stop. */
        {ERROR_CANCELED, FAILURE_ATTEMPT},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        assert_true(fail_with(render(), rows[i].code));
        assert_int_equal(act.failure, rows[i].failure);
        assert_int_equal(news, rows[i].failure == FAILURE_ATTEMPT ? NEWS_ILL
                                                                  : NEWS_FREE);
        assert_int_equal(act.code, rows[i].code);
        assert_string_equal(act.text, "no");
        end_store(ERROR_NONE);
        assert_int_equal(dispatch_arrived(&d, take_posted(), now),
                         DISPATCH_OVER);
    }
}

static void
test_cancel_is_told_once_then_enforced(void **state)
{
    (void)state;
    struct task *task = render();
    dispatch_look(&d, now);
    assert_int_equal(act.cancels, 0);
    act.job.cancel_requested = true;
    dispatch_look(&d, now);
    dispatch_look(&d, now);
    assert_int_equal(act.cancels, 1);
    enum store_failure failure;
    struct error cause;
    now += 2 * SECOND - 1;
    assert_false(dispatch_overdue(&d, task, now, &failure, &cause));
    assert_int_equal(dispatch_due(&d, now), now + 1);
    now++;
    assert_true(dispatch_overdue(&d, task, now, &failure, &cause));
    assert_int_equal(failure, FAILURE_CANCELED);
}

static void
test_a_canceled_worker_may_say_so(void **state)
{
    (void)state;
    struct task *task = render();
    act.job.cancel_requested = true;
    dispatch_look(&d, now);
    assert_true(fail_with(task, ERROR_CANCELED));
    assert_int_equal(act.failure, FAILURE_CANCELED);
    assert_int_equal(news, NEWS_FREE);
}

static void
test_another_lease_stops_this_one(void **state)
{
    (void)state;
    render();
    act.job.epoch = 8;
    dispatch_look(&d, now);
    assert_int_equal(act.cancels, 1);
}

static void
test_time_limits(void **state)
{
    (void)state;
    enum store_failure failure;
    struct error cause;
    struct task *task = render();
    now += 10 * SECOND - 1;
    assert_false(dispatch_overdue(&d, task, now, &failure, &cause));
    now++;
    assert_true(dispatch_overdue(&d, task, now, &failure, &cause));
    assert_int_equal(cause.code, ERROR_STALLED);
    assert_int_equal(failure, FAILURE_ATTEMPT);
    /* Who speaks does not stall, but time is up in the end. */
    int64_t end = task->started_us + d.render_us;
    while (now < end) {
        struct message message = {.kind = MESSAGE_PROGRESS};
        assert_true(say(task, &message));
        assert_false(dispatch_overdue(&d, task, now, &failure, &cause));
        now += 5 * SECOND;
    }
    assert_true(dispatch_overdue(&d, task, now, &failure, &cause));
    assert_int_equal(cause.code, ERROR_TIMEOUT);
    assert_int_equal(failure, FAILURE_ATTEMPT);
}

static void
test_heartbeats_are_few_but_steady(void **state)
{
    (void)state;
    struct task *task = render();
    int64_t end = now + 10 * (int64_t)SECOND;
    uint32_t done = 0;
    for (; now < end; now += SECOND / 100, done++) {
        struct message message = {.kind = MESSAGE_PROGRESS};
        message.body.progress.stage = STAGE_TRACING;
        message.body.progress.done = done;
        message.body.progress.total = 1000;
        assert_true(say(task, &message));
        dispatch_tick(&d, now);
    }
    assert_in_range(act.heartbeats, 35, 40);
    assert_true(act.progress > 0.95 && act.progress <= 1);
    assert_int_equal(act.phase, JOB_TRACING);
    /* Told progress and phase never go back, whatever the worker says. */
    struct message back = {.kind = MESSAGE_PROGRESS};
    back.body.progress.stage = STAGE_LOADING;
    now += SECOND;
    assert_true(say(task, &back));
    assert_true(act.progress > 0.95);
    assert_int_equal(act.phase, JOB_TRACING);
    /* A long silence is bridged, so that the lease goes on. */
    int before = act.heartbeats;
    now += 5 * SECOND;
    assert_true(dispatch_due(&d, now) <= now);
    dispatch_tick(&d, now);
    assert_int_equal(act.heartbeats, before + 1);
}

static void
test_lost_while_leasing_gives_the_job_back(void **state)
{
    (void)state;
    struct task *task = dispatch_next(&d, &child, now);
    dispatch_lost(&d, task, FAILURE_ATTEMPT, ERROR_WORKER_CRASHED, "gone", now);
    assert_int_equal(act.fails, 0);
    act.lease_done(act.user, new_lease(), &none);
    assert_int_equal(dispatch_arrived(&d, take_posted(), now),
                     DISPATCH_GOES_ON);
    assert_int_equal(act.failure, FAILURE_RELEASE);
    assert_int_equal(act.renders, 0);
}

static void
test_lost_while_rendering_ends_the_attempt(void **state)
{
    (void)state;
    struct task *task = render();
    dispatch_lost(&d, task, FAILURE_ATTEMPT, ERROR_WORKER_CRASHED,
                  "killed by signal 9", now);
    assert_int_equal(act.failure, FAILURE_ATTEMPT);
    assert_int_equal(act.code, ERROR_WORKER_CRASHED);
    assert_string_equal(act.text, "killed by signal 9");
}

static void
test_an_ask_that_fails_gives_the_job_back(void **state)
{
    (void)state;
    struct task *task = lease();
    act.child_refuses = true;
    assert_false(dispatch_ask(&d, task, 2, now, NULL));
    assert_int_equal(act.failure, FAILURE_RELEASE);
    assert_null(dispatch_next(&d, &child, now));
}

static void
test_stopping(void **state)
{
    (void)state;
    assert_non_null(dispatch_next(&d, &child, now));
    d.stopping = true;
    assert_null(dispatch_next(&d, &child, now));
    act.lease_done(act.user, new_lease(), &none);
    dispatch_arrived(&d, take_posted(), now);
    assert_int_equal(act.failure, FAILURE_RELEASE);
    end_store(ERROR_NONE);
    assert_int_equal(dispatch_arrived(&d, take_posted(), now), DISPATCH_OVER);
}

static void
test_a_fenced_result_is_dropped(void **state)
{
    (void)state;
    put();
    end_put(SHA_A, ERROR_NONE);
    dispatch_arrived(&d, take_posted(), now);
    end_store(ERROR_CONFLICT);
    assert_int_equal(dispatch_arrived(&d, take_posted(), now), DISPATCH_OVER);
    assert_int_equal(act.fails, 0);
    assert_int_equal(act.deletes, 1);
}

/* --- deleted blobs --- */

static void
test_forget_deletes_what_nobody_uses(void **state)
{
    (void)state;
    act.users = 1;
    dispatch_forget(&d, SHA_A);
    assert_int_equal(act.deletes, 0);
    act.users = 0;
    dispatch_forget(&d, SHA_A);
    assert_int_equal(act.deletes, 1);
}

static void
test_forget_spares_what_is_about_to_be_published(void **state)
{
    (void)state;
    put();
    end_put(SHA_A, ERROR_NONE);
    dispatch_arrived(&d, take_posted(), now);
    dispatch_forget(&d, SHA_A);
    assert_int_equal(act.deletes, 0);
    dispatch_forget(&d, SHA_B);
    assert_int_equal(act.deletes, 1);
}

static void
test_a_put_overtaken_by_a_deletion_is_repeated(void **state)
{
    (void)state;
    put();
    void *user = act.user;
    blobs_done_fn put_done = act.put_done;
    dispatch_forget(&d, SHA_A);
    assert_int_equal(act.deletes, 1);
    put_done(user, SHA_A, 4, &none);
    dispatch_arrived(&d, take_posted(), now);
    assert_int_equal(act.puts, 2);
    assert_int_equal(act.finishes, 0);
    /* The second put stands behind the deletion. */
    end_put(SHA_A, ERROR_NONE);
    dispatch_arrived(&d, take_posted(), now);
    assert_int_equal(act.puts, 2);
    assert_int_equal(act.finishes, 1);
    assert_null(d.deleted);
    end_store(ERROR_NONE);
    dispatch_arrived(&d, take_posted(), now);
}

static void
test_a_put_of_other_bytes_is_not_repeated(void **state)
{
    (void)state;
    put();
    dispatch_forget(&d, SHA_B);
    end_put(SHA_A, ERROR_NONE);
    dispatch_arrived(&d, take_posted(), now);
    assert_int_equal(act.puts, 1);
    assert_int_equal(act.finishes, 1);
    assert_null(d.deleted);
}

static void
test_threads_are_sent_when_they_change(void **state)
{
    (void)state;
    struct task *task = render();
    assert_int_equal(act.threads, 2);
    act.threads = 0;
    dispatch_threads(task, 2);
    assert_int_equal(act.threads, 0);
    dispatch_threads(task, 1);
    assert_int_equal(act.threads, 1);
}

int
main(void)
{
#define T(name) cmocka_unit_test_setup_teardown(test_##name, set_stage, strike)
    const struct CMUnitTest tests[] = {
        T(lease_render_put_finish),
        T(a_small_render_teaches_no_rate),
        T(no_job),
        T(a_full_queue_is_asked_again),
        T(a_failed_lease_is_tried_again_later),
        T(no_room_for_the_result_costs_no_attempt),
        T(hostile_descriptors),
        T(verdicts),
        T(cancel_is_told_once_then_enforced),
        T(a_canceled_worker_may_say_so),
        T(another_lease_stops_this_one),
        T(time_limits),
        T(heartbeats_are_few_but_steady),
        T(lost_while_leasing_gives_the_job_back),
        T(lost_while_rendering_ends_the_attempt),
        T(an_ask_that_fails_gives_the_job_back),
        T(stopping),
        T(a_fenced_result_is_dropped),
        T(forget_deletes_what_nobody_uses),
        T(forget_spares_what_is_about_to_be_published),
        T(a_put_overtaken_by_a_deletion_is_repeated),
        T(a_put_of_other_bytes_is_not_repeated),
        T(threads_are_sent_when_they_change),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
