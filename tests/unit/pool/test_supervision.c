/* The pool and workers that misbehave: none of them costs more than its own
 * attempt. The workers are acted_worker.c; test_pool.c has the real ones. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "tests/unit/pool/rig.h"

static struct rig rig;
static char id[ID_SIZE];

/* The worker program of that name, beside this program. */
static void
use_worker(const char *name)
{
    char path[4096];
    ssize_t len = readlink("/proc/self/exe", path, sizeof path - 64);
    assert_true(len > 0);
    path[len] = '\0';
    snprintf(strrchr(path, '/') + 1, 64, "%s", name);
    setenv("GLINT_WORKER", path, 1);
}

static int
set_up(void **state)
{
    (void)state;
    use_worker("acted_worker");
    memset(&rig, 0, sizeof rig);
    return 0;
}

static int
tear_down(void **state)
{
    (void)state;
    rig_close(&rig);
    return 0;
}

/* The status follows at the end of the loop's turn. */
static void
check_exits(uint64_t count)
{
    for (int i = 0; i < 500 && rig_status(&rig).exits < count; i++)
        rig_sleep_ms(2);
    assert_int_equal(rig_status(&rig).exits, count);
}

static struct job
run(const char *part, unsigned max_attempts, enum job_state state)
{
    rig_submit(&rig, part, max_attempts, id);
    return rig_wait(&rig, id, state, 20000);
}

static void
test_a_job_and_the_next(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){0});
    for (int i = 0; i < 20; i++) {
        struct job job = run("done", 3, JOB_SUCCEEDED);
        assert_int_equal(job.attempt, 1);
        assert_int_equal(job.result_len, 4);
        assert_true(rig_has_blob(&rig, job.result));
    }
    check_exits(0);
    assert_float_equal(rig_status(&rig).rays_per_second, 1e7, 1);
}

/* A job alone, then a good one: the pool goes on. */
static void
each_attempt_dies(const char *part, enum error_code code, const char *text)
{
    rig_open(&rig, (struct pool_options){.stall_ms = 5000});
    struct job job = run(part, 2, JOB_FAILED);
    assert_int_equal(job.attempt, 2);
    if (job.error_code != code || strstr(job.error_text, text) == NULL)
        fail_msg("%s: %s", error_code_name(job.error_code), job.error_text);
    check_exits(2);
    job = run("done", 3, JOB_SUCCEEDED);
    assert_int_equal(job.attempt, 1);
}

static void
test_crash(void **state)
{
    (void)state;
    each_attempt_dies("crash", ERROR_WORKER_CRASHED, "exited with status 3");
}

static void
test_unsealed_result(void **state)
{
    (void)state;
    each_attempt_dies("unsealed", ERROR_PROTOCOL, "seal");
}

static void
test_pipe_as_result(void **state)
{
    (void)state;
    each_attempt_dies("pipe", ERROR_PROTOCOL, "");
}

static void
test_noise(void **state)
{
    (void)state;
    each_attempt_dies("noise", ERROR_PROTOCOL, "");
}

static void
test_two_answers_cost_the_worker_but_not_the_job(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){0});
    struct job job = run("twice", 3, JOB_SUCCEEDED);
    assert_int_equal(job.attempt, 1);
    run("done", 3, JOB_SUCCEEDED);
    check_exits(1);
}

static void
test_an_answer_before_the_end_counts(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){0});
    for (int i = 0; i < 5; i++) {
        struct job job = run("early", 1, JOB_SUCCEEDED);
        assert_true(rig_has_blob(&rig, job.result));
        /* The next job is for the successor, not for the dying. */
        while (rig_status(&rig).exits <= (uint64_t)i)
            rig_sleep_ms(1);
    }
}

static void
test_failed_by_its_own_word(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){0});
    struct job job = run("failed", 2, JOB_FAILED);
    assert_int_equal(job.attempt, 2);
    assert_int_equal(job.error_code, ERROR_INTERNAL);
    /* Who fails by its own fault may be ill for good. */
    check_exits(2);
}

static void
test_stall(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){.stall_ms = 200});
    int64_t start = rig_now_ms();
    struct job job = run("silent", 2, JOB_FAILED);
    assert_int_equal(job.error_code, ERROR_STALLED);
    assert_int_equal(job.attempt, 2);
    assert_in_range(rig_now_ms() - start, 400, 4000);
    /* Talking is no stall. */
    rig_submit(&rig, "slow", 1, id);
    rig_sleep_ms(600);
    assert_int_equal(rig_get(&rig, id).state, JOB_RUNNING);
    rig_cancel(&rig, id);
    rig_wait(&rig, id, JOB_CANCELED, 1000);
}

static void
test_time_is_up(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){.max_render_seconds = 0.3});
    struct job job = run("slow", 2, JOB_FAILED);
    assert_int_equal(job.error_code, ERROR_TIMEOUT);
    assert_non_null(strstr(job.error_text, "max_render_seconds"));
    assert_int_equal(job.attempt, 2);
}

static void
test_cancel(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){0});
    rig_submit(&rig, "slow", 3, id);
    rig_wait_tracing(&rig, id);
    int64_t start = rig_now_ms();
    rig_cancel(&rig, id);
    rig_wait(&rig, id, JOB_CANCELED, 1000);
    assert_in_range(rig_now_ms() - start, 0, 500);
    check_exits(0);
    run("done", 1, JOB_SUCCEEDED);
}

static void
test_cancel_of_the_deaf(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){0});
    rig_submit(&rig, "deaf", 3, id);
    rig_wait_tracing(&rig, id);
    int64_t start = rig_now_ms();
    rig_cancel(&rig, id);
    struct job job = rig_wait(&rig, id, JOB_CANCELED, 4000);
    assert_in_range(rig_now_ms() - start, 1500, 3500);
    assert_int_equal(job.attempt, 1);
    check_exits(1);
    run("done", 1, JOB_SUCCEEDED);
}

static void
test_cancel_of_the_waiting(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){0});
    char first[ID_SIZE];
    rig_submit(&rig, "slow", 3, first);
    rig_wait(&rig, first, JOB_RUNNING, 5000);
    rig_submit(&rig, "done", 3, id);
    rig_cancel(&rig, id);
    struct job job = rig_wait(&rig, id, JOB_CANCELED, 1000);
    assert_int_equal(job.epoch, 0);
    rig_cancel(&rig, first);
    rig_wait(&rig, first, JOB_CANCELED, 1000);
}

/* A cancel that comes between lease and ask is not overlooked: cancel at once
 * after submitting, many times. */
static void
test_cancel_at_any_moment(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){0});
    for (int i = 0; i < 60; i++) {
        rig_submit(&rig, "slow", 1, id);
        if (i % 3 != 0)
            rig_sleep_ms(i % 3);
        rig_cancel(&rig, id);
        rig_wait(&rig, id, JOB_CANCELED, 1000);
    }
    check_exits(0);
}

static void
test_idle_worker_killed(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){.workers = 2});
    rig_wait_ready(&rig, 2, 5000);
    pid_t before[2], after[2];
    assert_int_equal(rig_workers(before, 2), 2);
    kill(before[0], SIGKILL);
    while (rig_status(&rig).exits == 0)
        rig_sleep_ms(1);
    int64_t start = rig_now_ms();
    rig_wait_ready(&rig, 2, 5000);
    /* The first successor comes at once. */
    assert_in_range(rig_now_ms() - start, 0, 90);
    assert_int_equal(rig_workers(after, 2), 2);
    assert_true(after[0] != before[0] && after[1] != before[0]);
    struct job job = run("done", 1, JOB_SUCCEEDED);
    assert_int_equal(job.attempt, 1);
}

static void
test_poison_blocks_nobody(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){.workers = 2});
    char poison[4][ID_SIZE], good[20][ID_SIZE];
    int64_t start = rig_now_ms();
    for (int i = 0; i < 4; i++)
        rig_submit(&rig, "crash", 3, poison[i]);
    for (int i = 0; i < 20; i++)
        rig_submit(&rig, "done", 3, good[i]);
    for (int i = 0; i < 20; i++) {
        struct job job = rig_wait(&rig, good[i], JOB_SUCCEEDED, 20000);
        assert_int_equal(job.attempt, 1);
    }
    for (int i = 0; i < 4; i++) {
        struct job job = rig_wait(&rig, poison[i], JOB_FAILED, 20000);
        assert_int_equal(job.error_code, ERROR_WORKER_CRASHED);
        assert_int_equal(job.attempt, 3);
    }
    check_exits(12);
    assert_in_range(rig_now_ms() - start, 0, 2500);
}

static void
test_a_program_that_dies_is_not_started_in_a_frenzy(void **state)
{
    (void)state;
    use_worker("acted_worker_dies");
    rig_open(&rig, (struct pool_options){0});
    rig_sleep_ms(1000);
    /* At once, then after 0.1, 0.2, 0.4, 0.8 s. */
    assert_in_range(rig_status(&rig).exits, 3, 6);
    assert_int_equal(rig_status(&rig).ready, 0);
}

static void
test_a_stranger_is_refused(void **state)
{
    (void)state;
    use_worker("acted_worker_stranger");
    rig_open(&rig, (struct pool_options){0});
    rig_submit(&rig, "done", 1, id);
    rig_sleep_ms(500);
    assert_int_equal(rig_status(&rig).ready, 0);
    assert_int_equal(rig_get(&rig, id).state, JOB_QUEUED);
    /* With a worker of ours the job goes on, none of its attempts spent. */
    use_worker("acted_worker");
    struct job job = rig_wait(&rig, id, JOB_SUCCEEDED, 20000);
    assert_int_equal(job.attempt, 1);
}

static void
test_no_program_at_all(void **state)
{
    (void)state;
    use_worker("there-is-no-such-worker");
    rig_open(&rig, (struct pool_options){0});
    rig_submit(&rig, "done", 1, id);
    rig_sleep_ms(300);
    use_worker("acted_worker");
    rig_wait(&rig, id, JOB_SUCCEEDED, 20000);
}

static void
test_stop_gives_back_what_runs(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){0});
    char waiting[ID_SIZE];
    rig_submit(&rig, "slow", 1, id);
    rig_wait_tracing(&rig, id);
    rig_submit(&rig, "done", 1, waiting);
    rig_stop_pool(&rig, 100);
    struct job job = rig_get(&rig, id);
    assert_int_equal(job.state, JOB_QUEUED);
    assert_int_equal(job.attempt, 1);
    assert_int_equal(rig_get(&rig, waiting).state, JOB_QUEUED);
    pid_t left;
    assert_int_equal(rig_workers(&left, 1), 0);
    /* The next pool takes it up; the only attempt is still there. */
    rig_start_pool(&rig);
    rig_wait_tracing(&rig, id);
    assert_int_equal(rig_get(&rig, id).attempt, 1);
    assert_true(rig_get(&rig, id).epoch > job.epoch);
    rig_cancel(&rig, id);
    rig_wait(&rig, waiting, JOB_SUCCEEDED, 5000);
}

static void
test_stop_of_the_mute(void **state)
{
    (void)state;
    use_worker("acted_worker_mute");
    rig_open(&rig, (struct pool_options){0});
    rig_sleep_ms(50);
    int64_t start = rig_now_ms();
    rig_stop_pool(&rig, 10000);
    assert_in_range(rig_now_ms() - start, 0, 1000);
}

static void
test_memory_is_limited(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){.max_render_bytes = 64 << 20});
    struct job job = run("hog", 2, JOB_FAILED);
    assert_int_equal(job.error_code, ERROR_MEMORY);
    assert_int_equal(job.attempt, 1); /* final */
}

static void
test_blobs_go_with_the_last_job(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){0});
    char second[ID_SIZE];
    struct job job = run("done", 1, JOB_SUCCEEDED);
    rig_submit(&rig, "done", 1, second);
    rig_wait(&rig, second, JOB_SUCCEEDED, 5000);
    rig_delete(&rig, id);
    rig_sleep_ms(100);
    assert_true(rig_has_blob(&rig, job.result));
    rig_delete(&rig, second);
    for (int i = 0; rig_has_blob(&rig, job.result); i++) {
        assert_true(i < 500);
        rig_sleep_ms(2);
    }
}

/* Deleting and finishing the same bytes at once: a job that succeeded always
 * has its blob. */
static void
test_blobs_survive_a_race(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){.workers = 2});
    char before[ID_SIZE], now[ID_SIZE];
    run("done", 1, JOB_SUCCEEDED);
    memcpy(before, id, ID_SIZE);
    for (int i = 0; i < 200; i++) {
        rig_submit(&rig, "done", 1, now);
        for (int spin = 0; spin < i * 20; spin++)
            (void)rig_status(&rig);
        rig_delete(&rig, before);
        struct job job = rig_wait(&rig, now, JOB_SUCCEEDED, 5000);
        assert_true(rig_has_blob(&rig, job.result));
        rig_sleep_ms(1);
        assert_true(rig_has_blob(&rig, job.result));
        memcpy(before, now, ID_SIZE);
    }
}

int
main(void)
{
#define T(name) cmocka_unit_test_setup_teardown(test_##name, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        T(a_job_and_the_next),
        T(crash),
        T(unsealed_result),
        T(pipe_as_result),
        T(noise),
        T(two_answers_cost_the_worker_but_not_the_job),
        T(an_answer_before_the_end_counts),
        T(failed_by_its_own_word),
        T(stall),
        T(time_is_up),
        T(cancel),
        T(cancel_of_the_deaf),
        T(cancel_of_the_waiting),
        T(cancel_at_any_moment),
        T(idle_worker_killed),
        T(poison_blocks_nobody),
        T(a_program_that_dies_is_not_started_in_a_frenzy),
        T(a_stranger_is_refused),
        T(no_program_at_all),
        T(stop_gives_back_what_runs),
        T(stop_of_the_mute),
        T(memory_is_limited),
        T(blobs_go_with_the_last_job),
        T(blobs_survive_a_race),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
