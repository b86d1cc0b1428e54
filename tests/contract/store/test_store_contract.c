/* What every backend promises: one suite, run over each of them. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/contract/store/harness.h"

static enum backend backend;
static struct harness h;

static const char blob[] =
    "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";

static int
set_up(void **state)
{
    (void)state;
    harness_open(&h, backend);
    return 0;
}

static int
tear_down(void **state)
{
    (void)state;
    harness_close(&h);
    return 0;
}

/* A job submitted and leased. */
static struct job
leased(const char *owner)
{
    struct job job = new_job(owner, PRIORITY_NORMAL, 1);
    assert_int_equal(do_submit(&h, &job, "{}", NULL), ERROR_NONE);
    struct lease *lease = do_lease(&h, 0);
    assert_non_null(lease);
    job = lease->job;
    lease_free(lease);
    return job;
}

static struct job
finished(const char *owner, const char *render_key, bool no_cache)
{
    struct job job = new_job(owner, PRIORITY_NORMAL, 1);
    snprintf(job.render_key, sizeof job.render_key, "%s", render_key);
    job.no_cache = no_cache;
    assert_int_equal(do_submit(&h, &job, "{}", NULL), ERROR_NONE);
    struct lease *lease = do_lease(&h, 0);
    assert_non_null(lease);
    assert_string_equal(lease->job.id, job.id);
    assert_int_equal(do_finish(&h, job.id, lease->job.epoch, blob, &job),
                     ERROR_NONE);
    lease_free(lease);
    return job;
}

/* --- lifecycle --- */

static void
a_job_is_kept_whole(void **state)
{
    (void)state;
    struct job job = new_job("key_a", PRIORITY_LOW, 12.5), kept;
    snprintf(job.scene_hash, sizeof job.scene_hash, "sha256:abc");
    snprintf(job.output, sizeof job.output, "{\"format\":\"png\"}");
    snprintf(job.tags, sizeof job.tags, "one,two");
    snprintf(job.settings, sizeof job.settings, "{\"film\":{}}");
    job.estimate_rays = 1e9;
    job.estimate_bytes = 3e6;
    job.no_cache = true;
    job.max_attempts = 5;
    assert_int_equal(do_submit(&h, &job, "{\"scene\":1}", &kept), ERROR_NONE);
    assert_true(kept.created_ms > 0);
    struct job now = get(&h, job.id);
    assert_memory_equal(&now, &kept, sizeof now);
    assert_int_equal(now.state, JOB_QUEUED);
    assert_int_equal(now.revision, 1);
    assert_int_equal(now.epoch, 0);
    assert_int_equal(now.attempt, 0);
    assert_int_equal(now.max_attempts, 5);
    assert_int_equal(now.priority, PRIORITY_LOW);
    assert_string_equal(now.owner, "key_a");
    assert_string_equal(now.scene_hash, "sha256:abc");
    assert_string_equal(now.output, "{\"format\":\"png\"}");
    assert_string_equal(now.tags, "one,two");
    assert_string_equal(now.settings, "{\"film\":{}}");
    assert_string_equal(now.media_type, "image/png");
    assert_true(now.no_cache);
    assert_true(now.estimate_rays == 1e9);
    assert_true(now.estimate_seconds == 12.5);
    assert_true(now.estimate_bytes == 3e6);

    struct bytes scene = {0};
    assert_true(store_scene(h.store, job.id, &scene, NULL));
    assert_string_equal(scene.data, "{\"scene\":1}");
    bytes_clear(&scene);
}

static void
a_scene_of_one_mebibyte_comes_back(void **state)
{
    (void)state;
    size_t len = 1 << 20;
    char *text = malloc(len + 1);
    for (size_t i = 0; i < len; i++)
        text[i] = (char)(' ' + i % 90);
    text[len] = '\0';
    struct job job = new_job("", PRIORITY_NORMAL, 1);
    assert_int_equal(do_submit(&h, &job, text, NULL), ERROR_NONE);
    struct lease *lease = do_lease(&h, 0);
    assert_int_equal(lease->scene.len, len);
    assert_memory_equal(lease->scene.data, text, len);
    lease_free(lease);
    free(text);
}

static void
an_empty_scene_is_a_scene(void **state)
{
    (void)state;
    struct job job = new_job("", PRIORITY_NORMAL, 1);
    assert_int_equal(do_submit(&h, &job, "", NULL), ERROR_NONE);
    struct bytes scene = {0};
    assert_true(store_scene(h.store, job.id, &scene, NULL));
    assert_int_equal(scene.len, 0);
    bytes_clear(&scene);
}

static void
submit_lease_heartbeat_finish(void **state)
{
    (void)state;
    struct job job = new_job("", PRIORITY_NORMAL, 1), out;
    assert_int_equal(do_submit(&h, &job, "{\"a\":1}", NULL), ERROR_NONE);
    struct lease *lease = do_lease(&h, 0);
    assert_non_null(lease);
    assert_string_equal(lease->job.id, job.id);
    assert_string_equal(lease->scene.data, "{\"a\":1}");
    assert_int_equal(lease->job.state, JOB_RUNNING);
    assert_int_equal(lease->job.epoch, 1);
    assert_int_equal(lease->job.attempt, 1);
    assert_int_equal(lease->job.revision, 2);
    assert_true(lease->job.started_ms > 0);

    do_heartbeat(&h, job.id, 1, JOB_TRACING, 0.25, 1000);
    out = get(&h, job.id);
    assert_int_equal(out.phase, JOB_TRACING);
    assert_true(out.progress == 0.25);
    assert_int_equal(out.rays_done, 1000);
    assert_int_equal(out.revision, 3);

    assert_int_equal(do_finish(&h, job.id, 1, blob, &out), ERROR_NONE);
    struct job now = get(&h, job.id);
    assert_memory_equal(&now, &out, sizeof now);
    assert_int_equal(now.state, JOB_SUCCEEDED);
    assert_int_equal(now.revision, 4);
    assert_string_equal(now.result, blob);
    assert_int_equal(now.result_len, 1234);
    assert_int_equal(now.stats.rays_camera, 7);
    assert_true(now.stats.trace_ms == 1.5);
    assert_true(now.progress == 1);
    assert_true(now.finished_ms > 0);
    assert_null(do_lease(&h, 0));
    lease_free(lease);
}

static void
an_id_is_taken_once(void **state)
{
    (void)state;
    struct job job = new_job("first", PRIORITY_NORMAL, 1), other;
    assert_int_equal(do_submit(&h, &job, "{}", NULL), ERROR_NONE);
    other = job;
    snprintf(other.owner, sizeof other.owner, "second");
    assert_int_equal(do_submit(&h, &other, "[]", NULL), ERROR_CONFLICT);
    assert_string_equal(get(&h, job.id).owner, "first");
    assert_int_equal(counts(&h).jobs[JOB_QUEUED], 1);
}

static void
nobody_has_these_ids(void **state)
{
    (void)state;
    char huge[4096];
    memset(huge, 'j', sizeof huge - 1);
    huge[sizeof huge - 1] = '\0';
    const char *const ids[] = {"",
                               "job_0",
                               "'; DROP TABLE jobs; --",
                               "../../etc/passwd",
                               "job_\xff\xfe",
                               huge};
    for (size_t i = 0; i < sizeof ids / sizeof ids[0]; i++) {
        struct job job;
        struct bytes scene = {0};
        struct error err = {0};
        uint64_t n;
        assert_false(store_get(h.store, ids[i], &job, &err));
        assert_int_equal(err.code, ERROR_NOT_FOUND);
        err = (struct error){0};
        assert_false(store_scene(h.store, ids[i], &scene, &err));
        assert_int_equal(err.code, ERROR_NOT_FOUND);
        err = (struct error){0};
        assert_false(store_position(h.store, ids[i], &n, &err));
        assert_int_equal(err.code, ERROR_NOT_FOUND);
        assert_int_equal(do_cancel(&h, ids[i], NULL), ERROR_NOT_FOUND);
        assert_int_equal(do_delete(&h, ids[i], NULL), ERROR_NOT_FOUND);
        assert_int_equal(do_finish(&h, ids[i], 1, blob, NULL), ERROR_NOT_FOUND);
        assert_int_equal(do_fail(&h, ids[i], 1, FAILURE_FINAL, NULL),
                         ERROR_NOT_FOUND);
        do_heartbeat(&h, ids[i], 1, JOB_TRACING, 0.5, 1);
    }
}

/* --- epoch, attempt --- */

static void
an_old_epoch_changes_nothing(void **state)
{
    (void)state;
    struct job job = leased("");
    assert_int_equal(do_fail(&h, job.id, 1, FAILURE_RELEASE, NULL), ERROR_NONE);
    struct lease *again = do_lease(&h, 0);
    assert_int_equal(again->job.epoch, 2);
    lease_free(again);
    struct job before = get(&h, job.id);
    static const uint32_t ghosts[] = {0, 1, 3, UINT32_MAX};
    for (size_t i = 0; i < sizeof ghosts / sizeof ghosts[0]; i++) {
        uint32_t e = ghosts[i];
        assert_int_equal(do_finish(&h, job.id, e, blob, NULL), ERROR_CONFLICT);
        assert_int_equal(do_fail(&h, job.id, e, FAILURE_FINAL, NULL),
                         ERROR_CONFLICT);
        assert_int_equal(do_fail(&h, job.id, e, FAILURE_ATTEMPT, NULL),
                         ERROR_CONFLICT);
        do_heartbeat(&h, job.id, e, JOB_ENCODING, 0.9, 5);
    }
    struct job after = get(&h, job.id);
    assert_memory_equal(&before, &after, sizeof before);
    assert_int_equal(do_finish(&h, job.id, 2, blob, NULL), ERROR_NONE);
    /* One result, once. */
    assert_int_equal(do_finish(&h, job.id, 2, blob, NULL), ERROR_CONFLICT);
    assert_int_equal(get(&h, job.id).state, JOB_SUCCEEDED);
}

static void
a_queued_job_has_no_lease(void **state)
{
    (void)state;
    struct job job = new_job("", PRIORITY_NORMAL, 1);
    assert_int_equal(do_submit(&h, &job, "{}", NULL), ERROR_NONE);
    assert_int_equal(do_finish(&h, job.id, 0, blob, NULL), ERROR_CONFLICT);
    assert_int_equal(do_fail(&h, job.id, 0, FAILURE_FINAL, NULL),
                     ERROR_CONFLICT);
    do_heartbeat(&h, job.id, 0, JOB_TRACING, 0.5, 1);
    assert_int_equal(get(&h, job.id).revision, 1);
}

static void
attempts_are_used_up_by_crashes(void **state)
{
    (void)state;
    struct job job = new_job("", PRIORITY_NORMAL, 1), out;
    job.max_attempts = 3;
    assert_int_equal(do_submit(&h, &job, "{}", NULL), ERROR_NONE);
    for (uint32_t attempt = 1; attempt <= 3; attempt++) {
        struct lease *lease = do_lease(&h, 0);
        assert_non_null(lease);
        assert_int_equal(lease->job.attempt, attempt);
        assert_int_equal(lease->job.epoch, attempt);
        do_heartbeat(&h, job.id, attempt, JOB_TRACING, 0.5, 9);
        assert_int_equal(do_fail(&h, job.id, attempt, FAILURE_ATTEMPT, &out),
                         ERROR_NONE);
        assert_int_equal(out.state, attempt < 3 ? JOB_QUEUED : JOB_FAILED);
        lease_free(lease);
    }
    assert_int_equal(out.attempt, 3);
    assert_int_equal(out.error_code, ERROR_WORKER_CRASHED);
    assert_string_equal(out.error_text, "the worker died of signal 11");
    assert_true(out.finished_ms > 0);
    struct job now = get(&h, job.id);
    assert_memory_equal(&now, &out, sizeof now);
    assert_null(do_lease(&h, 0));
}

static void
a_release_costs_no_attempt(void **state)
{
    (void)state;
    struct job job = new_job("", PRIORITY_NORMAL, 1), out;
    job.max_attempts = 1;
    assert_int_equal(do_submit(&h, &job, "{}", NULL), ERROR_NONE);
    for (uint32_t epoch = 1; epoch <= 20; epoch++) {
        struct lease *lease = do_lease(&h, 0);
        assert_non_null(lease);
        assert_int_equal(lease->job.attempt, 1);
        assert_int_equal(lease->job.epoch, epoch);
        assert_int_equal(do_fail(&h, job.id, epoch, FAILURE_RELEASE, &out),
                         ERROR_NONE);
        assert_int_equal(out.state, JOB_QUEUED);
        assert_int_equal(out.attempt, 1);
        assert_int_equal(out.error_code, ERROR_NONE);
        assert_true(out.progress == 0);
        assert_true(out.started_ms == 0);
        lease_free(lease);
    }
}

static void
a_final_failure_is_final(void **state)
{
    (void)state;
    struct job job = leased(""), out;
    assert_int_equal(do_fail(&h, job.id, 1, FAILURE_FINAL, &out), ERROR_NONE);
    assert_int_equal(out.state, JOB_FAILED);
    assert_int_equal(out.attempt, 1);
    assert_null(do_lease(&h, 0));
}

/* --- cancel --- */

static void
canceling_a_queued_job_is_immediate(void **state)
{
    (void)state;
    struct job job = new_job("", PRIORITY_NORMAL, 1), out;
    assert_int_equal(do_submit(&h, &job, "{}", NULL), ERROR_NONE);
    assert_int_equal(do_cancel(&h, job.id, &out), ERROR_NONE);
    assert_int_equal(out.state, JOB_CANCELED);
    assert_int_equal(out.revision, 2);
    assert_int_equal(do_cancel(&h, job.id, &out), ERROR_NONE);
    assert_int_equal(out.state, JOB_CANCELED);
    assert_int_equal(out.revision, 2);
    assert_null(do_lease(&h, 0));
}

static void
canceling_a_running_job_is_a_wish(void **state)
{
    (void)state;
    struct job job = leased(""), out;
    assert_int_equal(do_cancel(&h, job.id, &out), ERROR_NONE);
    assert_int_equal(out.state, JOB_RUNNING);
    assert_true(out.cancel_requested);
    assert_int_equal(out.revision, 3);
    assert_int_equal(do_cancel(&h, job.id, &out), ERROR_NONE);
    assert_int_equal(out.revision, 3);
    do_heartbeat(&h, job.id, 1, JOB_TRACING, 0.5, 1);
    assert_true(get(&h, job.id).cancel_requested);
    assert_int_equal(do_fail(&h, job.id, 1, FAILURE_CANCELED, &out),
                     ERROR_NONE);
    assert_int_equal(out.state, JOB_CANCELED);
    assert_true(out.finished_ms > 0);
}

static void
a_wish_to_cancel_outlives_any_failure(void **state)
{
    (void)state;
    static const enum store_failure failures[] = {
        FAILURE_FINAL, FAILURE_ATTEMPT, FAILURE_RELEASE, FAILURE_CANCELED};
    for (size_t i = 0; i < 4; i++) {
        struct job job = leased(""), out;
        assert_int_equal(do_cancel(&h, job.id, NULL), ERROR_NONE);
        assert_int_equal(do_fail(&h, job.id, 1, failures[i], &out), ERROR_NONE);
        assert_int_equal(out.state, JOB_CANCELED);
        assert_int_equal(out.error_code, ERROR_NONE);
    }
}

static void
a_result_that_beats_the_wish_counts(void **state)
{
    (void)state;
    struct job job = leased("");
    assert_int_equal(do_cancel(&h, job.id, NULL), ERROR_NONE);
    assert_int_equal(do_finish(&h, job.id, 1, blob, &job), ERROR_NONE);
    assert_int_equal(job.state, JOB_SUCCEEDED);
    assert_int_equal(do_cancel(&h, job.id, NULL), ERROR_CONFLICT);
    assert_int_equal(get(&h, job.id).state, JOB_SUCCEEDED);
}

/* --- delete --- */

static void
only_what_is_over_is_deleted(void **state)
{
    (void)state;
    struct job job = new_job("", PRIORITY_NORMAL, 1), out;
    assert_int_equal(do_submit(&h, &job, "{}", NULL), ERROR_NONE);
    assert_int_equal(do_delete(&h, job.id, NULL), ERROR_CONFLICT);
    struct lease *lease = do_lease(&h, 0);
    assert_int_equal(do_delete(&h, job.id, NULL), ERROR_CONFLICT);
    assert_int_equal(do_finish(&h, job.id, lease->job.epoch, blob, NULL),
                     ERROR_NONE);
    lease_free(lease);
    assert_int_equal(do_delete(&h, job.id, &out), ERROR_NONE);
    assert_string_equal(out.id, job.id);
    assert_false(exists(&h, job.id));
    struct bytes scene = {0};
    struct error err = {0};
    assert_false(store_scene(h.store, job.id, &scene, &err));
    assert_int_equal(err.code, ERROR_NOT_FOUND);
    assert_int_equal(do_delete(&h, job.id, NULL), ERROR_NOT_FOUND);
    struct store_counts c = counts(&h);
    for (int i = 0; i < JOB_STATE_COUNT; i++)
        assert_int_equal(c.jobs[i], 0);
    /* The name is free again, and nothing of the old job is in it. */
    assert_int_equal(do_submit(&h, &job, "new", &out), ERROR_NONE);
    assert_int_equal(out.revision, 1);
    assert_int_equal(out.epoch, 0);
}

/* --- order --- */

static void
expect_order(const char *const *owners, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        struct lease *lease = do_lease(&h, 0);
        assert_non_null(lease);
        assert_string_equal(lease->job.owner, owners[i]);
        lease_free(lease);
    }
}

static void
submit_one(const char *owner, enum job_priority priority, double seconds)
{
    struct job job = new_job(owner, priority, seconds);
    assert_int_equal(do_submit(&h, &job, "{}", NULL), ERROR_NONE);
}

static void
priorities_come_first(void **state)
{
    (void)state;
    submit_one("low", PRIORITY_LOW, 1);
    submit_one("normal", PRIORITY_NORMAL, 1);
    submit_one("draft", PRIORITY_DRAFT, 1);
    static const char *const order[] = {"draft", "normal", "low"};
    expect_order(order, 3);
}

static void
one_owner_is_served_in_order(void **state)
{
    (void)state;
    char ids[50][ID_SIZE];
    for (int i = 0; i < 50; i++) {
        struct job job = new_job("a", PRIORITY_NORMAL, i % 7);
        memcpy(ids[i], job.id, sizeof ids[i]);
        assert_int_equal(do_submit(&h, &job, "{}", NULL), ERROR_NONE);
    }
    for (int i = 0; i < 50; i++) {
        struct lease *lease = do_lease(&h, 0);
        assert_string_equal(lease->job.id, ids[i]);
        lease_free(lease);
    }
}

static void
a_thousand_jobs_do_not_starve_one(void **state)
{
    (void)state;
    for (int i = 0; i < 1000; i++)
        submit_one("greedy", PRIORITY_NORMAL, 1);
    for (int i = 0; i < 3; i++) { /* well under way */
        struct lease *lease = do_lease(&h, 0);
        lease_free(lease);
    }
    struct job modest = new_job("modest", PRIORITY_NORMAL, 1);
    assert_int_equal(do_submit(&h, &modest, "{}", NULL), ERROR_NONE);
    uint64_t position;
    assert_true(store_position(h.store, modest.id, &position, NULL));
    assert_true(position <= 1);
    static const char *const order[] = {"modest", "greedy", "greedy"};
    expect_order(order, 3);
}

static void
who_always_has_one_job_does_not_starve_the_rest(void **state)
{
    (void)state;
    for (int i = 0; i < 20; i++)
        submit_one("many", PRIORITY_NORMAL, 1);
    int many = 0;
    submit_one("one", PRIORITY_NORMAL, 1);
    for (int i = 0; i < 20; i++) {
        struct lease *lease = do_lease(&h, 0);
        if (strcmp(lease->job.owner, "one") == 0)
            submit_one("one", PRIORITY_NORMAL, 1);
        else
            many++;
        lease_free(lease);
    }
    assert_in_range(many, 9, 11);
}

static void
shares_are_of_work_not_of_jobs(void **state)
{
    (void)state;
    for (int i = 0; i < 10; i++)
        submit_one("large", PRIORITY_NORMAL, 10);
    for (int i = 0; i < 100; i++)
        submit_one("small", PRIORITY_NORMAL, 1);
    int large = 0;
    for (int i = 0; i < 44; i++) {
        struct lease *lease = do_lease(&h, 0);
        large += strcmp(lease->job.owner, "large") == 0;
        lease_free(lease);
    }
    assert_in_range(large, 4, 5);
}

static void
a_job_queued_again_goes_first(void **state)
{
    (void)state;
    struct job job = leased("a");
    for (int i = 0; i < 5; i++)
        submit_one("b", PRIORITY_NORMAL, 1);
    assert_int_equal(do_fail(&h, job.id, 1, FAILURE_RELEASE, NULL), ERROR_NONE);
    struct lease *lease = do_lease(&h, 0);
    assert_string_equal(lease->job.id, job.id);
    lease_free(lease);
}

static void
the_short_lane_takes_short_work_and_drafts(void **state)
{
    (void)state;
    submit_one("long", PRIORITY_NORMAL, 600);
    submit_one("exact", PRIORITY_NORMAL, 2);
    assert_null(do_lease(&h, 2));
    submit_one("short", PRIORITY_LOW, 1.9);
    submit_one("draft", PRIORITY_DRAFT, 500);
    struct lease *lease = do_lease(&h, 0); /* a draft is first in any lane */
    assert_string_equal(lease->job.owner, "draft");
    lease_free(lease);
    lease = do_lease(&h, 2);
    assert_string_equal(lease->job.owner, "short");
    lease_free(lease);
    assert_null(do_lease(&h, 2));
    submit_one("draft2", PRIORITY_DRAFT, 500);
    lease = do_lease(&h, 2);
    assert_string_equal(lease->job.owner, "draft2");
    lease_free(lease);
    /* Other limits than the lane's own. */
    submit_one("mid", PRIORITY_NORMAL, 5);
    submit_one("tiny", PRIORITY_NORMAL, 0.4);
    lease = do_lease(&h, 0.5);
    assert_string_equal(lease->job.owner, "tiny");
    lease_free(lease);
    assert_null(do_lease(&h, 1.5));
    lease = do_lease(&h, 3);
    assert_string_equal(lease->job.owner, "exact");
    lease_free(lease);
}

static void
positions_count_who_waits_before(void **state)
{
    (void)state;
    struct job jobs[10];
    uint64_t position;
    for (int i = 0; i < 10; i++) {
        jobs[i] = new_job("a", i < 5 ? PRIORITY_LOW : PRIORITY_NORMAL, 1);
        assert_int_equal(do_submit(&h, &jobs[i], "{}", NULL), ERROR_NONE);
    }
    for (int i = 0; i < 10; i++) {
        assert_true(store_position(h.store, jobs[i].id, &position, NULL));
        assert_int_equal(position, (i + 5) % 10);
    }
    lease_free(do_lease(&h, 0));
    struct error err = {0};
    assert_false(store_position(h.store, jobs[5].id, &position, &err));
    assert_int_equal(err.code, ERROR_CONFLICT);
    assert_true(store_position(h.store, jobs[0].id, &position, NULL));
    assert_int_equal(position, 4);
}

/* --- find --- */

static void
results_are_found_by_their_owner(void **state)
{
    (void)state;
    struct job a1 = finished("a", "key1", false), found;
    struct error err = {0};
    assert_true(store_find(h.store, "key1", "a", &found, NULL));
    assert_string_equal(found.id, a1.id);
    assert_false(store_find(h.store, "key1", "b", &found, &err));
    assert_int_equal(err.code, ERROR_NOT_FOUND);
    assert_false(store_find(h.store, "key2", "a", &found, NULL));
    assert_false(store_find(h.store, "key1", "", &found, NULL));
    assert_true(store_find(h.store, "key1", NULL, &found, NULL));

    struct job a2 = finished("a", "key1", false);
    assert_true(store_find(h.store, "key1", "a", &found, NULL));
    assert_string_equal(found.id, a2.id);
    struct job b = finished("b", "key1", false);
    assert_true(store_find(h.store, "key1", "a", &found, NULL));
    assert_string_equal(found.id, a2.id);
    assert_true(store_find(h.store, "key1", NULL, &found, NULL));
    assert_string_equal(found.id, b.id);

    assert_int_equal(do_delete(&h, a2.id, NULL), ERROR_NONE);
    assert_true(store_find(h.store, "key1", "a", &found, NULL));
    assert_string_equal(found.id, a1.id);
}

static void
private_results_are_not_found(void **state)
{
    (void)state;
    struct job found;
    finished("a", "key1", true);
    assert_false(store_find(h.store, "key1", "a", &found, NULL));
    assert_false(store_find(h.store, "key1", NULL, &found, NULL));
    struct job job = new_job("a", PRIORITY_NORMAL, 1); /* not finished */
    snprintf(job.render_key, sizeof job.render_key, "key3");
    assert_int_equal(do_submit(&h, &job, "{}", NULL), ERROR_NONE);
    assert_false(store_find(h.store, "key3", "a", &found, NULL));
}

static void
blob_users_are_counted(void **state)
{
    (void)state;
    uint64_t users = 9;
    assert_true(store_blob_users(h.store, blob, &users, NULL));
    assert_int_equal(users, 0);
    struct job job = finished("a", "k", false);
    finished("b", "k", true);
    assert_true(store_blob_users(h.store, blob, &users, NULL));
    assert_int_equal(users, 2);
    assert_int_equal(do_delete(&h, job.id, NULL), ERROR_NONE);
    assert_true(store_blob_users(h.store, blob, &users, NULL));
    assert_int_equal(users, 1);
    submit_one("c", PRIORITY_NORMAL, 1);
    assert_true(store_blob_users(h.store, "", &users, NULL));
    assert_int_equal(users, 0);
}

/* --- list --- */

static int
list(const struct store_filter *filter, struct job *jobs)
{
    struct error err = {0};
    int count = store_list(h.store, filter, jobs, &err);
    assert_true(count >= 0);
    for (int i = 1; i < count; i++)
        assert_true(strcmp(jobs[i - 1].id, jobs[i].id) > 0);
    return count;
}

static void
lists_are_filtered_and_paged(void **state)
{
    (void)state;
    enum { N = 30 };
    struct job *jobs = calloc(STORE_LIST_MAX, sizeof *jobs);
    static const char *const tags[] = {"", "red", "red,blue", "darkred",
                                       "blue"};
    for (int i = 0; i < N; i++) {
        struct job job = new_job(i % 3 == 0 ? "a" : "b", PRIORITY_NORMAL, 1);
        snprintf(job.tags, sizeof job.tags, "%s", tags[i % 5]);
        assert_int_equal(do_submit(&h, &job, "{}", NULL), ERROR_NONE);
    }
    for (int i = 0; i < 10; i++) {
        struct lease *lease = do_lease(&h, 0);
        if (i < 4)
            do_finish(&h, lease->job.id, lease->job.epoch, blob, NULL);
        else if (i < 7)
            do_fail(&h, lease->job.id, lease->job.epoch, FAILURE_FINAL, NULL);
        lease_free(lease);
    }
    struct store_filter all = {.limit = 200};
    assert_int_equal(list(&all, jobs), N);
    struct store_filter a = {.owner = "a", .limit = 200};
    assert_int_equal(list(&a, jobs), 10);
    struct store_filter nobody = {.owner = "", .limit = 200};
    assert_int_equal(list(&nobody, jobs), 0);
    struct store_filter red = {.tag = "red", .limit = 200};
    assert_int_equal(list(&red, jobs), 12);
    struct store_filter blue = {.tag = "blue", .owner = "b", .limit = 200};
    assert_int_equal(list(&blue, jobs), 8);
    struct store_filter failed = {.states = 1u << JOB_FAILED, .limit = 200};
    assert_int_equal(list(&failed, jobs), 3);
    struct store_filter over = {
        .states = 1u << JOB_FAILED | 1u << JOB_SUCCEEDED, .limit = 200};
    assert_int_equal(list(&over, jobs), 7);
    int both = 0;
    for (int owner = 0; owner < 2; owner++) {
        over.owner = owner == 0 ? "a" : "b";
        both += list(&over, jobs);
    }
    assert_int_equal(both, 7);
    struct store_filter future = {.since_ms = INT64_MAX, .limit = 200};
    assert_int_equal(list(&future, jobs), 0);

    /* Pages of 7 give each job once, also when the cursor's job is gone. */
    const char *owners[] = {NULL, "b"};
    for (int o = 0; o < 2; o++) {
        struct store_filter page = {.owner = owners[o], .limit = 7};
        char cursor[ID_SIZE];
        int total = 0, count;
        while ((count = list(&page, jobs)) > 0) {
            total += count;
            if (page.before != NULL)
                assert_true(strcmp(jobs[0].id, page.before) < 0);
            memcpy(cursor, jobs[count - 1].id, sizeof cursor);
            page.before = cursor;
        }
        assert_int_equal(total, o == 0 ? 30 : 20);
    }
    free(jobs);
}

static void
lists_show_progress(void **state)
{
    (void)state;
    struct job job = leased("a"), listed;
    do_heartbeat(&h, job.id, 1, JOB_TRACING, 0.5, 77);
    struct store_filter filter = {.owner = "a", .limit = 1};
    assert_int_equal(list(&filter, &listed), 1);
    assert_true(listed.progress == 0.5);
    assert_int_equal(listed.rays_done, 77);
    struct job now = get(&h, job.id);
    assert_memory_equal(&now, &listed, sizeof now);
}

/* --- heartbeats, revisions, on_change --- */

static void
progress_never_goes_back(void **state)
{
    (void)state;
    struct job job = leased("");
    static const double beats[] = {0.5, 0.4, NAN, -1, 0.6, 2, -INFINITY};
    static const double seen[] = {0.5, 0.5, 0.5, 0.5, 0.6, 1, 1};
    for (size_t i = 0; i < sizeof beats / sizeof beats[0]; i++) {
        do_heartbeat(&h, job.id, 1, JOB_TRACING, beats[i], 10 - i);
        job = get(&h, job.id);
        assert_true(job.progress == seen[i]);
        assert_int_equal(job.rays_done, 10);
        assert_int_equal(job.revision, 3 + i);
    }
    /* A new attempt starts anew. */
    do_fail(&h, job.id, 1, FAILURE_ATTEMPT, NULL);
    job = get(&h, job.id);
    assert_true(job.progress == 0);
    assert_int_equal(job.revision, 10);
    lease_free(do_lease(&h, 0));
    job = get(&h, job.id);
    assert_true(job.progress == 0);
    assert_int_equal(job.revision, 11);
}

struct watch {
    pthread_mutex_t lock;
    char id[ID_SIZE];
    struct job last;
    unsigned calls, deletions;
    bool backwards;
};

static void
watch_change(void *user, const struct job *job, bool deleted)
{
    struct watch *watch = user;
    pthread_mutex_lock(&watch->lock);
    if (watch->id[0] == '\0' || strcmp(watch->id, job->id) == 0) {
        watch->calls++;
        watch->deletions += deleted;
        watch->backwards |= !deleted && job->revision <= watch->last.revision;
        watch->last = *job;
    }
    pthread_mutex_unlock(&watch->lock);
}

static void
watchers_see_every_commit_once(void **state)
{
    (void)state;
    struct watch watch = {.lock = PTHREAD_MUTEX_INITIALIZER};
    harness_close(&h);
    harness_open_with(&h, backend, watch_change, &watch);
    struct job job = new_job("", PRIORITY_NORMAL, 1);
    memcpy(watch.id, job.id, sizeof watch.id);
    do_submit(&h, &job, "{}", NULL);
    lease_free(do_lease(&h, 0));
    do_heartbeat(&h, job.id, 1, JOB_TRACING, 0.5, 1);
    do_cancel(&h, job.id, NULL);
    do_cancel(&h, job.id, NULL); /* changes nothing */
    do_finish(&h, job.id, 9, blob, NULL);
    do_fail(&h, job.id, 1, FAILURE_CANCELED, NULL);
    do_delete(&h, job.id, NULL);
    do_settle(&h);
    pthread_mutex_lock(&watch.lock);
    assert_int_equal(watch.calls, 6);
    assert_int_equal(watch.deletions, 1);
    assert_false(watch.backwards);
    pthread_mutex_unlock(&watch.lock);
}

/* While the writer is held, writes pile up and then share one commit. */
static void
writes_of_one_batch_see_each_other(void **state)
{
    (void)state;
    struct watch watch = {.lock = PTHREAD_MUTEX_INITIALIZER};
    harness_close(&h);
    harness_open_with(&h, backend, watch_change, &watch);
    struct gate gate;
    gate_init(&gate);
    store_cancel(h.store, "job_nobody", gate_hold, &gate, NULL);
    gate_wait_reached(&gate);

    struct job job = new_job("", PRIORITY_NORMAL, 1);
    memcpy(watch.id, job.id, sizeof watch.id);
    struct waiter w[8];
    for (int i = 0; i < 8; i++)
        waiter_init(&w[i]);
    store_submit(h.store, &job, "{}", 2, waiter_done, &w[0], NULL);
    store_submit(h.store, &job, "{}", 2, waiter_done, &w[1], NULL);
    store_lease(h.store, 0, waiter_lease, &w[2], NULL);
    store_lease(h.store, 0, waiter_lease, &w[3], NULL);
    store_heartbeat(h.store, job.id, 1, JOB_TRACING, 0.75, 5, NULL);
    store_cancel(h.store, job.id, waiter_done, &w[4], NULL);
    store_finish(h.store, job.id, 2, blob, 1, NULL, waiter_done, &w[5], NULL);
    store_finish(h.store, job.id, 1, blob, 1, NULL, waiter_done, &w[6], NULL);
    store_delete(h.store, "job_unknown", waiter_done, &w[7], NULL);
    assert_int_equal(counts(&h).pending_writes, 9);
    gate_open(&gate);
    for (int i = 0; i < 8; i++)
        waiter_wait(&w[i]);
    do_settle(&h);
    static const enum error_code codes[] = {
        ERROR_NONE, ERROR_CONFLICT, ERROR_NONE, ERROR_NONE,
        ERROR_NONE, ERROR_CONFLICT, ERROR_NONE, ERROR_NOT_FOUND};
    for (int i = 0; i < 8; i++)
        assert_int_equal(w[i].err.code, codes[i]);
    assert_int_equal(w[0].job.revision, 1);
    assert_non_null(w[2].lease);
    assert_int_equal(w[2].lease->job.revision, 2);
    assert_null(w[3].lease);
    assert_int_equal(w[4].job.revision, 4); /* 3 was the heartbeat */
    assert_true(w[4].job.progress == 0.75);
    assert_int_equal(w[6].job.revision, 5);
    assert_int_equal(w[6].job.state, JOB_SUCCEEDED);
    pthread_mutex_lock(&watch.lock);
    assert_int_equal(watch.calls, 1);
    assert_int_equal(watch.last.revision, 5);
    pthread_mutex_unlock(&watch.lock);
    struct store_counts c = counts(&h);
    assert_int_equal(c.jobs[JOB_SUCCEEDED], 1);
    assert_int_equal(c.jobs[JOB_QUEUED] + c.jobs[JOB_RUNNING], 0);
    for (int i = 0; i < 8; i++)
        waiter_clear(&w[i]);
}

/* --- bounds --- */

static void
count_done(void *user, const struct job *job, const struct error *err)
{
    (void)job;
    if (err->code == ERROR_NONE)
        atomic_fetch_add((atomic_uint *)user, 1);
}

static void
the_queue_is_bounded(void **state)
{
    (void)state;
    struct gate gate;
    gate_init(&gate);
    struct job held = leased("a");
    store_cancel(h.store, "job_nobody", gate_hold, &gate, NULL);
    gate_wait_reached(&gate);
    atomic_uint done = 0;
    unsigned accepted = 0;
    struct error err = {0};
    for (int i = 0; i < STORE_PENDING_MAX + 10; i++) {
        struct job job = new_job("a", PRIORITY_NORMAL, 1);
        accepted +=
            store_submit(h.store, &job, "{}", 2, count_done, &done, &err);
    }
    assert_int_equal(accepted, STORE_PENDING_MAX);
    assert_int_equal(err.code, ERROR_QUEUE_FULL);
    assert_non_null(strstr(err.text, "4096"));
    /* Who holds a lease still gets through. */
    struct waiter w;
    waiter_init(&w);
    assert_true(store_finish(h.store, held.id, 1, blob, 1, NULL, waiter_done,
                             &w, NULL));
    gate_open(&gate);
    waiter_wait(&w);
    assert_int_equal(w.err.code, ERROR_NONE);
    waiter_clear(&w);
    do_settle(&h);
    assert_int_equal(atomic_load(&done), STORE_PENDING_MAX);
    assert_int_equal(counts(&h).jobs[JOB_QUEUED], STORE_PENDING_MAX);
    assert_int_equal(counts(&h).pending_writes, 0);
}

static void
waiting_scenes_are_bounded_in_bytes(void **state)
{
    (void)state;
    struct gate gate;
    gate_init(&gate);
    store_cancel(h.store, "job_nobody", gate_hold, &gate, NULL);
    gate_wait_reached(&gate);
    size_t len = 8 << 20;
    char *text = calloc(1, len);
    unsigned accepted = 0;
    struct error err = {0};
    for (int i = 0; i < 10; i++) {
        struct job job = new_job("a", PRIORITY_NORMAL, 1);
        accepted += store_submit(h.store, &job, text, len, NULL, NULL, &err);
    }
    assert_int_equal(accepted, 8);
    assert_int_equal(err.code, ERROR_QUEUE_FULL);
    gate_open(&gate);
    do_settle(&h);
    assert_int_equal(counts(&h).jobs[JOB_QUEUED], 8);
    free(text);
}

/* --- threads --- */

enum { RACERS = 4, RACE_JOBS = 300 };

struct race {
    atomic_uint submitted, won, over;
    unsigned char wins[RACERS * RACE_JOBS];
};

static void *
race_submit(void *arg)
{
    struct race *race = arg;
    for (int i = 0; i < RACE_JOBS; i++) {
        struct job job = new_job("a", PRIORITY_NORMAL, 1);
        unsigned n = atomic_fetch_add(&race->submitted, 1);
        snprintf(job.tags, sizeof job.tags, "%u", n);
        if (do_submit(&h, &job, "{}", NULL) != ERROR_NONE)
            abort();
    }
    return NULL;
}

static void *
race_lease(void *arg)
{
    struct race *race = arg;
    while (atomic_load(&race->over) < RACERS * RACE_JOBS) {
        struct lease *lease = do_lease(&h, 0);
        if (lease == NULL)
            continue;
        const struct job *job = &lease->job;
        unsigned n = (unsigned)strtoul(job->tags, NULL, 10);
        do_heartbeat(&h, job->id, job->epoch, JOB_TRACING, 0.5, 1);
        struct job seen = get(&h, job->id);
        if (seen.state != JOB_RUNNING || seen.revision != 3)
            abort();
        if (do_finish(&h, job->id, job->epoch, blob, NULL) != ERROR_NONE)
            abort();
        race->wins[n]++;
        atomic_fetch_add(&race->over, 1);
        lease_free(lease);
    }
    return NULL;
}

static void
each_job_has_one_winner(void **state)
{
    (void)state;
    static struct race race;
    memset(&race, 0, sizeof race);
    pthread_t threads[2 * RACERS];
    for (int i = 0; i < RACERS; i++) {
        pthread_create(&threads[i], NULL, race_submit, &race);
        pthread_create(&threads[RACERS + i], NULL, race_lease, &race);
    }
    for (int i = 0; i < 2 * RACERS; i++)
        pthread_join(threads[i], NULL);
    for (int i = 0; i < RACERS * RACE_JOBS; i++)
        assert_int_equal(race.wins[i], 1);
    assert_int_equal(counts(&h).jobs[JOB_SUCCEEDED], RACERS * RACE_JOBS);
}

struct reader {
    const char *id;
    atomic_bool stop;
    unsigned reads;
    bool backwards;
};

static void *
read_revisions(void *arg)
{
    struct reader *reader = arg;
    uint32_t last = 0;
    double progress = 0;
    while (!atomic_load(&reader->stop)) {
        struct job job = get(&h, reader->id);
        reader->backwards |= job.revision < last;
        if (job.state == JOB_RUNNING && job.epoch == 1)
            reader->backwards |= job.progress < progress;
        progress = job.progress;
        last = job.revision;
        reader->reads++;
    }
    return NULL;
}

static void
a_reader_never_sees_a_revision_go_back(void **state)
{
    (void)state;
    struct job job = leased("");
    struct reader readers[2] = {{.id = job.id}, {.id = job.id}};
    pthread_t threads[2];
    for (int i = 0; i < 2; i++)
        pthread_create(&threads[i], NULL, read_revisions, &readers[i]);
    for (int i = 1; i <= 300; i++) {
        do_heartbeat(&h, job.id, 1, JOB_TRACING, i / 400.0, (uint64_t)i);
        if (i == 150)
            do_cancel(&h, job.id, NULL);
    }
    do_finish(&h, job.id, 1, blob, NULL);
    for (int i = 0; i < 2; i++) {
        atomic_store(&readers[i].stop, true);
        pthread_join(threads[i], NULL);
        assert_false(readers[i].backwards);
        assert_true(readers[i].reads > 0);
    }
    assert_int_equal(get(&h, job.id).revision, 2 + 300 + 1 + 1);
}

static void
closing_commits_what_waits(void **state)
{
    (void)state;
    atomic_uint done = 0;
    for (int i = 0; i < 700; i++) {
        struct job job = new_job("a", PRIORITY_NORMAL, 1);
        assert_true(
            store_submit(h.store, &job, "{}", 2, count_done, &done, NULL));
    }
    if (backend == BACKEND_SQLITE) {
        harness_reopen(&h);
        assert_int_equal(counts(&h).jobs[JOB_QUEUED], 700);
    } else {
        store_close(h.store);
        struct error err = {0};
        h.store = store_open_memory(&h.options, &err);
        assert_non_null(h.store);
    }
    assert_int_equal(atomic_load(&done), 700);
}

static void
it_says_what_it_is(void **state)
{
    (void)state;
    const char *text = store_describe(h.store);
    assert_int_equal(
        strncmp(text, backend_names[backend], strlen(backend_names[backend])),
        0);
}

#define T(f)                                                                   \
    {                                                                          \
#f, f, set_up, tear_down, NULL                                         \
    }

static const struct CMUnitTest tests[] = {
    T(a_job_is_kept_whole),
    T(a_scene_of_one_mebibyte_comes_back),
    T(an_empty_scene_is_a_scene),
    T(submit_lease_heartbeat_finish),
    T(an_id_is_taken_once),
    T(nobody_has_these_ids),
    T(an_old_epoch_changes_nothing),
    T(a_queued_job_has_no_lease),
    T(attempts_are_used_up_by_crashes),
    T(a_release_costs_no_attempt),
    T(a_final_failure_is_final),
    T(canceling_a_queued_job_is_immediate),
    T(canceling_a_running_job_is_a_wish),
    T(a_wish_to_cancel_outlives_any_failure),
    T(a_result_that_beats_the_wish_counts),
    T(only_what_is_over_is_deleted),
    T(priorities_come_first),
    T(one_owner_is_served_in_order),
    T(a_thousand_jobs_do_not_starve_one),
    T(who_always_has_one_job_does_not_starve_the_rest),
    T(shares_are_of_work_not_of_jobs),
    T(a_job_queued_again_goes_first),
    T(the_short_lane_takes_short_work_and_drafts),
    T(positions_count_who_waits_before),
    T(results_are_found_by_their_owner),
    T(private_results_are_not_found),
    T(blob_users_are_counted),
    T(lists_are_filtered_and_paged),
    T(lists_show_progress),
    T(progress_never_goes_back),
    T(watchers_see_every_commit_once),
    T(writes_of_one_batch_see_each_other),
    T(the_queue_is_bounded),
    T(waiting_scenes_are_bounded_in_bytes),
    T(each_job_has_one_winner),
    T(a_reader_never_sees_a_revision_go_back),
    T(closing_commits_what_waits),
    T(it_says_what_it_is),
};

int
main(void)
{
    int failures = 0;
    for (int i = 0; i < BACKEND_COUNT; i++) {
        backend = (enum backend)i;
        failures +=
            cmocka_run_group_tests_name(backend_names[i], tests, NULL, NULL);
    }
    return failures;
}
