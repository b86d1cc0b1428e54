/* Who is woken by a change. http and the pool are played by this file. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "server/api/commit.h"
#include "server/api/events.h"

static uint64_t woken[64];
static size_t woken_count, kicks;

void
http_wake(struct http *http, uint64_t ticket)
{
    (void)http;
    if (woken_count < 64)
        woken[woken_count++] = ticket;
}

void
pool_kick(struct pool *pool)
{
    (void)pool;
    kicks++;
}

void
pool_status(struct pool *pool, struct pool_status *status)
{
    (void)pool;
    status->workers = 7;
}

static char something;

static int
set_up(void **state)
{
    struct events *events = events_new(NULL);

    woken_count = kicks = 0;
    events_connect_http(events, (struct http *)&something);
    *state = events;
    return events ? 0 : -1;
}

static int
tear_down(void **state)
{
    events_free(*state);
    return 0;
}

static void
a_change_wakes_its_watchers_only(void **state)
{
    struct events *events = *state;

    assert_true(events_watch(events, "job_a", 1));
    assert_true(events_watch(events, "job_b", 2));
    assert_true(events_watch(events, "job_a", 3));
    assert_int_equal(events_watchers(events, "job_a"), 2);
    events_changed(events, "job_a");
    assert_int_equal(woken_count, 2);
    assert_int_equal(woken[0] + woken[1], 4);
    events_unwatch(events, "job_a", 1);
    events_unwatch(events, "job_a", 99);
    woken_count = 0;
    events_changed(events, "job_a");
    assert_int_equal(woken_count, 1);
    assert_int_equal(woken[0], 3);
    events_changed(events, "job_unknown");
    assert_int_equal(woken_count, 1);
}

static void
nobody_is_woken_without_http(void **state)
{
    struct events *events = *state;

    events_connect_http(events, NULL);
    assert_true(events_watch(events, "job_a", 1));
    events_changed(events, "job_a");
    assert_int_equal(woken_count, 0);
    /* Whoever came before http is told when it is there. */
    events_connect_http(events, (struct http *)&something);
    assert_int_equal(woken_count, 1);
}

static void
thousands_of_watchers(void **state)
{
    struct events *events = *state;
    char job[ID_SIZE];
    unsigned i;

    for (i = 0; i < 5000; i++) {
        snprintf(job, sizeof job, "job_%u", i);
        assert_true(events_watch(events, job, i));
    }
    for (i = 0; i < 5000; i++) {
        snprintf(job, sizeof job, "job_%u", i);
        assert_int_equal(events_watchers(events, job), 1);
        events_unwatch(events, job, i);
        assert_int_equal(events_watchers(events, job), 0);
    }
}

static void
the_pool_is_kicked_while_connected(void **state)
{
    struct events *events = *state;
    struct pool_status status;

    events_kick_pool(events);
    assert_int_equal(kicks, 0);
    assert_false(events_pool_status(events, &status));
    assert_int_equal(status.workers, 0);
    events_connect_pool(events, (struct pool *)&something);
    events_kick_pool(events);
    assert_int_equal(kicks, 1);
    assert_true(events_pool_status(events, &status));
    assert_int_equal(status.workers, 7);
}

static void
a_commit_outlives_either_side(void **state)
{
    struct events *events = *state;
    struct commit *commit = commit_new(events, "job_a");
    struct error err = {.code = ERROR_CONFLICT, .text = "no"};
    struct job job = {.revision = 5};

    assert_true(events_watch(events, "job_a", 9));
    assert_false(atomic_load(&commit->done));
    commit_done(commit, &job, &err);
    assert_true(atomic_load(&commit->done));
    assert_int_equal(commit->job.revision, 5);
    assert_int_equal(commit->err.code, ERROR_CONFLICT);
    assert_int_equal(woken_count, 1);
    commit_drop(commit);

    /* The request was over first: the last one frees (leak checker). */
    commit = commit_new(events, "job_b");
    commit_drop(commit);
    commit_done(commit, NULL, NULL);
    assert_int_equal(woken_count, 1);
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_change_wakes_its_watchers_only,
                                        set_up, tear_down),
        cmocka_unit_test_setup_teardown(nobody_is_woken_without_http, set_up,
                                        tear_down),
        cmocka_unit_test_setup_teardown(thousands_of_watchers, set_up,
                                        tear_down),
        cmocka_unit_test_setup_teardown(the_pool_is_kicked_while_connected,
                                        set_up, tear_down),
        cmocka_unit_test_setup_teardown(a_commit_outlives_either_side, set_up,
                                        tear_down),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
