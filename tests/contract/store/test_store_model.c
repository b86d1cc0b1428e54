/* Thousands of random operations against a model that fits a page.
 *
 * The model knows the states, the epochs, the attempts, the revisions and the
 * fair order, in its own words; every answer of every backend is compared with
 * it, so the backends also agree with each other. SQLite is closed and opened
 * in between. GLINT_SEED replays a run, GLINT_ROUNDS makes it longer. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/contract/store/harness.h"

enum { JOBS = 60, OWNERS = 4, PRIORITIES = 3, LEAP = 1 << 16 };

struct model_job {
    bool exists;
    char id[ID_SIZE];
    int owner;
    enum job_priority priority;
    double seconds;
    enum job_state state;
    bool cancel_requested;
    uint32_t revision, revision_kept, epoch, attempt, max_attempts;
    double progress, progress_kept;
    int64_t start;
    unsigned order;
};

struct model {
    struct model_job jobs[JOBS];
    int64_t clock[PRIORITIES], end[OWNERS][PRIORITIES];
    unsigned next_order;
};

static enum backend backend;
static uint64_t random_state;

static uint32_t
random_below(uint32_t n)
{
    random_state ^= random_state << 13; /* xorshift64 */
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return (uint32_t)(random_state >> 33) % n;
}

static const char *
owner_name(int owner)
{
    static const char *const names[OWNERS] = {"", "a", "b", "c"};
    return names[owner];
}

static const char blob[] =
    "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa";

/* --- the model's own opinion --- */

static bool
over(const struct model_job *m)
{
    return m->state == JOB_SUCCEEDED || m->state == JOB_FAILED ||
           m->state == JOB_CANCELED;
}

static bool
goes_before(const struct model_job *a, const struct model_job *b)
{
    if (a->priority != b->priority)
        return a->priority < b->priority;
    if (a->start != b->start)
        return a->start < b->start;
    return a->order < b->order;
}

static struct model_job *
expected_lease(struct model *model, double max_seconds)
{
    struct model_job *best = NULL;
    for (int i = 0; i < JOBS; i++) {
        struct model_job *m = &model->jobs[i];
        if (!m->exists || m->state != JOB_QUEUED)
            continue;
        if (max_seconds > 0 && m->priority != PRIORITY_DRAFT &&
            !(m->seconds < max_seconds))
            continue;
        if (best == NULL || goes_before(m, best))
            best = m;
    }
    return best;
}

static void
changed(struct model_job *m)
{
    m->revision_kept = ++m->revision;
    m->progress_kept = m->progress;
}

/* --- operations --- */

static void
step_submit(struct harness *h, struct model *model, struct model_job *m)
{
    static const double seconds[] = {0, 0.3, 1.9, 2, 7, 900};
    if (m->exists) {
        struct job again = new_job("a", PRIORITY_NORMAL, 1);
        memcpy(again.id, m->id, sizeof again.id);
        assert_int_equal(do_submit(h, &again, "{}", NULL), ERROR_CONFLICT);
        return;
    }
    *m = (struct model_job){.exists = true};
    m->owner = (int)random_below(OWNERS);
    m->priority = (enum job_priority)random_below(PRIORITIES);
    m->seconds = seconds[random_below(6)];
    m->max_attempts = 1 + random_below(3);
    struct job job = new_job(owner_name(m->owner), m->priority, m->seconds);
    job.max_attempts = m->max_attempts;
    memcpy(m->id, job.id, sizeof m->id);
    assert_int_equal(do_submit(h, &job, m->id, NULL), ERROR_NONE);

    int64_t *clock = &model->clock[m->priority];
    int64_t *end = &model->end[m->owner][m->priority];
    double turn = m->seconds < 0.1 ? 0.1 : m->seconds > 600 ? 600 : m->seconds;
    m->start = *end > *clock ? *end : *clock;
    *end = m->start + (int64_t)(turn * 1e6);
    m->order = model->next_order++;
    changed(m);
}

static void
step_lease(struct harness *h, struct model *model)
{
    static const double lanes[] = {0, 0, 0, 2, 0.5, 5};
    double lane = lanes[random_below(6)];
    struct model_job *m = expected_lease(model, lane);
    struct lease *lease = do_lease(h, lane);
    assert_int_equal(lease == NULL, m == NULL);
    if (m == NULL)
        return;
    assert_string_equal(lease->job.id, m->id);
    assert_string_equal(lease->scene.data, m->id);
    lease_free(lease);
    if (m->start > model->clock[m->priority])
        model->clock[m->priority] = m->start;
    m->state = JOB_RUNNING;
    m->epoch++;
    if (m->attempt == 0)
        m->attempt = 1;
    m->progress = 0;
    changed(m);
}

/* Mostly the live epoch; the answer expected of a lease holder's call. */
static enum error_code
pick_epoch(const struct model_job *m, uint32_t *epoch)
{
    *epoch = random_below(4) == 0 ? m->epoch + random_below(3) - 1 : m->epoch;
    if (!m->exists)
        return ERROR_NOT_FOUND;
    return m->state == JOB_RUNNING && *epoch == m->epoch ? ERROR_NONE
                                                         : ERROR_CONFLICT;
}

static void
step_heartbeat(struct harness *h, struct model_job *m)
{
    uint32_t epoch;
    bool lives = pick_epoch(m, &epoch) == ERROR_NONE;
    double progress = random_below(100) / 100.0;
    do_heartbeat(h, m->id, epoch, JOB_TRACING, progress, 1);
    if (!lives)
        return;
    if (progress > m->progress)
        m->progress = progress;
    m->revision++;
}

static void
step_finish(struct harness *h, struct model_job *m)
{
    uint32_t epoch;
    enum error_code want = pick_epoch(m, &epoch);
    assert_int_equal(do_finish(h, m->id, epoch, blob, NULL), want);
    if (want != ERROR_NONE)
        return;
    m->state = JOB_SUCCEEDED;
    m->cancel_requested = false;
    m->progress = 1;
    changed(m);
}

static void
step_fail(struct harness *h, struct model_job *m)
{
    uint32_t epoch;
    enum error_code want = pick_epoch(m, &epoch);
    enum store_failure failure = (enum store_failure)random_below(4);
    assert_int_equal(do_fail(h, m->id, epoch, failure, NULL), want);
    if (want != ERROR_NONE)
        return;
    bool left = m->attempt < m->max_attempts;
    if (m->cancel_requested || failure == FAILURE_CANCELED) {
        m->state = JOB_CANCELED;
    } else if (failure == FAILURE_RELEASE) {
        m->state = JOB_QUEUED;
    } else if (failure == FAILURE_ATTEMPT && left) {
        m->state = JOB_QUEUED;
        m->attempt++;
    } else {
        m->state = JOB_FAILED;
    }
    m->cancel_requested = false;
    if (m->state == JOB_QUEUED)
        m->progress = 0;
    changed(m);
}

static void
step_cancel(struct harness *h, struct model_job *m)
{
    enum error_code want = !m->exists                  ? ERROR_NOT_FOUND
                           : m->state == JOB_SUCCEEDED ? ERROR_CONFLICT
                           : m->state == JOB_FAILED    ? ERROR_CONFLICT
                                                       : ERROR_NONE;
    assert_int_equal(do_cancel(h, m->id, NULL), want);
    if (want != ERROR_NONE || m->state == JOB_CANCELED)
        return;
    if (m->state == JOB_QUEUED) {
        m->state = JOB_CANCELED;
        changed(m);
    } else if (!m->cancel_requested) {
        m->cancel_requested = true;
        changed(m);
    }
}

static void
step_delete(struct harness *h, struct model_job *m)
{
    enum error_code want = !m->exists ? ERROR_NOT_FOUND
                           : over(m)  ? ERROR_NONE
                                      : ERROR_CONFLICT;
    assert_int_equal(do_delete(h, m->id, NULL), want);
    if (want == ERROR_NONE)
        m->exists = false;
}

static void
step_reopen(struct harness *h, struct model *model)
{
    if (h->backend == BACKEND_MEMORY)
        return;
    harness_reopen(h);
    for (int i = 0; i < JOBS; i++) {
        struct model_job *m = &model->jobs[i];
        if (!m->exists || m->state != JOB_RUNNING)
            continue;
        m->state = m->cancel_requested ? JOB_CANCELED : JOB_QUEUED;
        m->cancel_requested = false;
        if (m->state == JOB_QUEUED)
            m->progress = 0;
        uint32_t seen = m->revision;
        m->revision = m->revision_kept += LEAP;
        assert_true(m->revision > seen);
        /* Of a canceled job the last progress that was kept remains. */
        if (m->state == JOB_CANCELED)
            m->progress = m->progress_kept;
    }
}

/* --- compare --- */

static void
compare_job(struct harness *h, const struct model_job *m)
{
    if (!m->exists) {
        assert_false(exists(h, m->id));
        return;
    }
    struct job job = get(h, m->id);
    assert_int_equal(job.state, m->state);
    assert_int_equal(job.revision, m->revision);
    assert_int_equal(job.epoch, m->epoch);
    assert_int_equal(job.attempt, m->attempt);
    assert_int_equal(job.cancel_requested, m->cancel_requested);
    assert_true(job.progress == m->progress);
    assert_true(job.attempt <= job.max_attempts);
    assert_int_equal(job.finished_ms != 0, over(m));
    assert_int_equal(job.result[0] != '\0', m->state == JOB_SUCCEEDED);
}

static void
compare_all(struct harness *h, struct model *model)
{
    uint64_t want[JOB_STATE_COUNT] = {0}, position;
    struct store_counts c = counts(h);
    static struct job listed[STORE_LIST_MAX];
    for (int i = 0; i < JOBS; i++) {
        const struct model_job *m = &model->jobs[i];
        compare_job(h, m);
        if (!m->exists)
            continue;
        want[m->state]++;
        if (m->state != JOB_QUEUED)
            continue;
        uint64_t before = 0;
        for (int k = 0; k < JOBS; k++)
            before += model->jobs[k].exists &&
                      model->jobs[k].state == JOB_QUEUED &&
                      goes_before(&model->jobs[k], m);
        assert_true(store_position(h->store, m->id, &position, NULL));
        assert_int_equal(position, before);
    }
    assert_memory_equal(want, c.jobs, sizeof want);
    for (int owner = 0; owner < OWNERS; owner++) {
        unsigned states = 1 + random_below(31);
        struct store_filter filter = {
            .owner = owner_name(owner), .states = states, .limit = 200};
        int found = 0;
        for (int i = 0; i < JOBS; i++)
            found += model->jobs[i].exists && model->jobs[i].owner == owner &&
                     (states >> model->jobs[i].state & 1) != 0;
        assert_int_equal(store_list(h->store, &filter, listed, NULL), found);
    }
}

static void
random_operations_agree_with_the_model(void **state)
{
    (void)state;
    const char *text = getenv("GLINT_SEED");
    uint64_t seed = text != NULL ? strtoull(text, NULL, 10) : 20261122;
    text = getenv("GLINT_ROUNDS");
    unsigned long rounds = text != NULL ? strtoul(text, NULL, 10) : 5000;
    struct harness h;
    static struct model model;
    memset(&model, 0, sizeof model);
    random_state = seed * 2654435761u + 1;
    print_message("seed %llu\n", (unsigned long long)seed);
    harness_open(&h, backend);
    for (unsigned long i = 0; i < rounds; i++) {
        struct model_job *m = &model.jobs[random_below(JOBS)];
        uint32_t what = random_below(100);
        if (what < 25)
            step_submit(&h, &model, m);
        else if (what < 50)
            step_lease(&h, &model);
        else if (what < 65)
            step_heartbeat(&h, m);
        else if (what < 78)
            step_finish(&h, m);
        else if (what < 88)
            step_fail(&h, m);
        else if (what < 93)
            step_cancel(&h, m);
        else
            step_delete(&h, m);
        compare_job(&h, m);
        if (i % 200 == 199)
            step_reopen(&h, &model);
        if (i % 50 == 49)
            compare_all(&h, &model);
    }
    harness_close(&h);
}

int
main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_operations_agree_with_the_model)};
    int failures = 0;
    for (int i = 0; i < BACKEND_COUNT; i++) {
        backend = (enum backend)i;
        failures +=
            cmocka_run_group_tests_name(backend_names[i], tests, NULL, NULL);
    }
    return failures;
}
