/* The pool and the real worker: scenes in, pictures in the blobs, whatever
 * happens to the processes in between. Long renders are long by their samples.
 */
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

enum { SCENE_SIZE = 400 };

/* One ray to the camera and at most one to the light per sample. */
static void
sphere(char text[SCENE_SIZE], unsigned size, unsigned spp)
{
    snprintf(text, SCENE_SIZE,
             "{\"version\": 1, \"film\": {\"width\": %u, \"height\": %u}, "
             "\"sampler\": {\"type\": \"sobol\", \"spp\": %u}, "
             "\"integrator\": {\"type\": \"whitted\", \"max_bounces\": 0}, "
             "\"objects\": [{\"type\": \"sphere\"}, "
             "{\"type\": \"plane\", \"offset\": -1}]}",
             size, size, spp);
}

static char quick[SCENE_SIZE];
static char second[SCENE_SIZE];   /* about one */
static char minutes[SCENE_SIZE];  /* in many small tiles */
static char one_tile[SCENE_SIZE]; /* some seconds for one thread */

static struct rig rig;
static char id[ID_SIZE];

static void
find_worker(void)
{
    const char *build = getenv("GLINT_BUILD");
    char path[4096];
    if (build != NULL) {
        snprintf(path, sizeof path, "%s/bin/glint-worker", build);
    } else {
        ssize_t len = readlink("/proc/self/exe", path, sizeof path - 64);
        assert_true(len > 0);
        path[len] = '\0';
        snprintf(strrchr(path, '/') + 1, 64, "../bin/glint-worker");
    }
    setenv("GLINT_WORKER", path, 1);
}

static int
set_up(void **state)
{
    (void)state;
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

static struct job
run(const char *scene, enum job_state state)
{
    rig_submit(&rig, scene, 3, id);
    return rig_wait(&rig, id, state, 120000);
}

/* Samples per pixel for a render of about so many seconds on two threads. */
static unsigned
samples(double per_second, unsigned size, double seconds)
{
    double spp = per_second * seconds / size / size;
    return spp < 1 ? 1 : spp > 65536 ? 65536 : (unsigned)spp;
}

/* How fast is this build here? A sanitizer costs a factor of fifty. */
static int
calibrate(void **state)
{
    (void)state;
    find_worker();
    rig_open(&rig, (struct pool_options){0});
    double best = 0;
    for (int i = 0; i < 3; i++) {
        sphere(quick, 128, 16);
        struct job job = run(quick, JOB_SUCCEEDED);
        double rate = (double)job.stats.rays_camera / job.stats.trace_ms * 1000;
        best = rate > best ? rate : best;
    }
    rig_close(&rig);
    sphere(quick, 64, 1);
    sphere(second, 128, samples(best, 128, 1));
    sphere(minutes, 512, samples(best, 512, 100));
    sphere(one_tile, 32, samples(best / 2, 32, 6));
    return 0;
}

static void
test_a_picture(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){0});
    struct job job = run(quick, JOB_SUCCEEDED);
    assert_int_equal(job.attempt, 1);
    assert_int_equal(job.epoch, 1);
    uint64_t len;
    int fd = blobs_get(rig.blobs, job.result, &len, NULL);
    assert_true(fd >= 0);
    assert_int_equal(len, job.result_len);
    char head[8];
    assert_int_equal(read(fd, head, 8), 8);
    close(fd);
    assert_memory_equal(head, "\x89PNG\r\n\x1a\n", 8);
    assert_int_equal(job.stats.rays_camera, 64 * 64);
    assert_true(job.stats.trace_ms > 0 && job.stats.encode_ms > 0);
    assert_true(job.stats.peak_bytes > 1 << 20);
}

static void
test_the_rate_is_learned(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){0});
    assert_float_equal(rig_status(&rig).rays_per_second, 0, 0);
    struct job job = run(second, JOB_SUCCEEDED);
    double rays = (double)(job.stats.rays_camera + job.stats.rays_shadow +
                           job.stats.rays_bounce);
    double rate = rays / job.stats.trace_ms * 1000;
    double learned = rig_status(&rig).rays_per_second;
    assert_true(learned > 0.99 * rate && learned < 1.01 * rate);
}

static void
test_a_bad_scene_fails_once_and_harms_nobody(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){0});
    rig_wait_ready(&rig, 1, 10000);
    pid_t before, after;
    assert_int_equal(rig_workers(&before, 1), 1);
    struct job job = run(
        "{\"objects\": [{\"type\": \"sphere\", \"radius\": -1}]}", JOB_FAILED);
    assert_int_equal(job.error_code, ERROR_NUMBER_TOO_SMALL);
    assert_non_null(strstr(job.error_text, "/objects/0/radius"));
    assert_int_equal(job.attempt, 1);
    job = run("{", JOB_FAILED);
    assert_int_equal(job.error_code, ERROR_JSON_SYNTAX);
    run(quick, JOB_SUCCEEDED);
    assert_int_equal(rig_workers(&after, 1), 1);
    assert_int_equal(before, after);
}

static void
test_killed_in_the_middle(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){0});
    struct job calm = run(second, JOB_SUCCEEDED);
    rig_submit(&rig, second, 3, id);
    rig_wait_tracing(&rig, id);
    rig_signal_workers(SIGKILL);
    struct job job = rig_wait(&rig, id, JOB_SUCCEEDED, 120000);
    assert_int_equal(job.attempt, 2);
    assert_int_equal(job.epoch, 2);
    /* The same bytes as in peace. */
    assert_string_equal(job.result, calm.result);
    assert_int_equal(rig_status(&rig).exits, 1);
}

static void
test_a_crash_is_like_a_kill(void **state)
{
    (void)state;
    static const int signals[] = {SIGSEGV, SIGABRT, SIGBUS, SIGTERM};
    rig_open(&rig, (struct pool_options){0});
    for (size_t i = 0; i < sizeof signals / sizeof signals[0]; i++) {
        rig_submit(&rig, second, 3, id);
        rig_wait_tracing(&rig, id);
        rig_signal_workers(signals[i]);
        struct job job = rig_wait(&rig, id, JOB_SUCCEEDED, 120000);
        assert_int_equal(job.attempt, 2);
    }
}

static void
test_poison(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){0});
    rig_submit(&rig, minutes, 3, id);
    for (uint32_t attempt = 1; attempt <= 3; attempt++) {
        struct job job;
        do {
            rig_wait_tracing(&rig, id);
            job = rig_get(&rig, id);
        } while (job.attempt != attempt);
        rig_signal_workers(SIGKILL);
        while (rig_status(&rig).exits < attempt)
            rig_sleep_ms(2);
    }
    struct job job = rig_wait(&rig, id, JOB_FAILED, 5000);
    assert_int_equal(job.error_code, ERROR_WORKER_CRASHED);
    assert_non_null(strstr(job.error_text, "signal 9"));
    assert_int_equal(job.attempt, 3);
    run(quick, JOB_SUCCEEDED);
}

static void
test_stopped_worker_is_replaced(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){.stall_ms = 5000});
    rig_submit(&rig, second, 3, id);
    rig_wait_tracing(&rig, id);
    rig_signal_workers(SIGSTOP);
    struct job job = rig_wait(&rig, id, JOB_SUCCEEDED, 120000);
    assert_int_equal(job.attempt, 2);
    assert_int_equal(rig_status(&rig).exits, 1);
}

/* A worker that works hard tells so, however few its tiles. */
static void
test_a_long_tile_is_no_stall(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){.stall_ms = 3000, .threads = 1});
    rig_submit(&rig, one_tile, 1, id);
    rig_wait(&rig, id, JOB_SUCCEEDED, 120000);
}

static void
test_cancel(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){0});
    rig_submit(&rig, minutes, 3, id);
    rig_wait_tracing(&rig, id);
    int64_t start = rig_now_ms();
    rig_cancel(&rig, id);
    rig_wait(&rig, id, JOB_CANCELED, 3000);
    assert_in_range(rig_now_ms() - start, 0, 1500);
    assert_int_equal(rig_status(&rig).exits, 0);
    run(quick, JOB_SUCCEEDED);
}

static void
test_cancel_of_a_stopped_worker(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){0});
    rig_submit(&rig, minutes, 3, id);
    rig_wait_tracing(&rig, id);
    rig_signal_workers(SIGSTOP);
    rig_cancel(&rig, id);
    rig_wait(&rig, id, JOB_CANCELED, 4000);
    run(quick, JOB_SUCCEEDED);
}

static void
test_time_is_up(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){.max_render_seconds = 0.5});
    rig_submit(&rig, minutes, 2, id);
    struct job job = rig_wait(&rig, id, JOB_FAILED, 20000);
    assert_int_equal(job.error_code, ERROR_TIMEOUT);
    assert_int_equal(job.attempt, 2);
}

/* A sanitizer's allocator does not survive a limit, so not with one. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SANITIZED 1
#else
#define SANITIZED 0

static void
test_too_much_memory(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){.max_render_bytes = 16 << 20});
    char big[SCENE_SIZE];
    sphere(big, 4096, 1);
    struct job job = run(big, JOB_FAILED);
    assert_int_equal(job.error_code, ERROR_MEMORY);
    assert_int_equal(job.attempt, 1);
    run(quick, JOB_SUCCEEDED);
}

#endif

static void
test_drain_waits_for_what_runs(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){0});
    rig_submit(&rig, second, 3, id);
    rig_wait(&rig, id, JOB_RUNNING, 10000);
    rig_stop_pool(&rig, 60000);
    struct job job = rig_get(&rig, id);
    assert_int_equal(job.state, JOB_SUCCEEDED);
    assert_true(rig_has_blob(&rig, job.result));
}

static void
test_drain_gives_back_what_takes_too_long(void **state)
{
    (void)state;
    rig_open(&rig, (struct pool_options){0});
    rig_submit(&rig, second, 1, id);
    rig_wait_tracing(&rig, id);
    int64_t start = rig_now_ms();
    rig_stop_pool(&rig, 50);
    assert_in_range(rig_now_ms() - start, 0, 1500);
    assert_int_equal(rig_get(&rig, id).state, JOB_QUEUED);
    rig_start_pool(&rig);
    struct job job = rig_wait(&rig, id, JOB_SUCCEEDED, 120000);
    assert_int_equal(job.attempt, 1);
    assert_int_equal(job.epoch, 2);
}

/* Any number of workers and threads: the same bytes. */
static void
test_workers_and_threads_leave_no_trace(void **state)
{
    (void)state;
    static const struct {
        unsigned workers, threads;
    } crews[] = {{1, 1}, {1, 2}, {3, 7}};
    char result[SHA256_HEX_SIZE] = "", scene[SCENE_SIZE];
    sphere(scene, 96, 16);
    for (size_t i = 0; i < sizeof crews / sizeof crews[0]; i++) {
        rig_open(&rig, (struct pool_options){.workers = crews[i].workers,
                                             .threads = crews[i].threads});
        char ids[4][ID_SIZE];
        for (int k = 0; k < 4; k++)
            rig_submit(&rig, scene, 3, ids[k]);
        for (int k = 0; k < 4; k++) {
            struct job job = rig_wait(&rig, ids[k], JOB_SUCCEEDED, 120000);
            if (result[0] == '\0')
                memcpy(result, job.result, sizeof result);
            assert_string_equal(job.result, result);
        }
        if (i + 1 < sizeof crews / sizeof crews[0])
            rig_close(&rig);
    }
}

int
main(void)
{
#define T(name) cmocka_unit_test_setup_teardown(test_##name, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        T(a_picture),
        T(the_rate_is_learned),
        T(a_bad_scene_fails_once_and_harms_nobody),
        T(killed_in_the_middle),
        T(a_crash_is_like_a_kill),
        T(poison),
        T(stopped_worker_is_replaced),
        T(a_long_tile_is_no_stall),
        T(cancel),
        T(cancel_of_a_stopped_worker),
        T(time_is_up),
#if !SANITIZED
        T(too_much_memory),
#endif
        T(drain_waits_for_what_runs),
        T(drain_gives_back_what_takes_too_long),
        T(workers_and_threads_leave_no_trace),
    };
    return cmocka_run_group_tests(tests, calibrate, NULL);
}
