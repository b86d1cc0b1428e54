/* The states of a job, and their names. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "server/jobs/job.h"

/* The picture in job.h, arrow by arrow; everything else is forbidden. */
static void
only_the_drawn_arrows_are_allowed(void **state)
{
    (void)state;
    static const struct {
        enum job_state from, to;
    } arrows[] = {
        {JOB_QUEUED, JOB_RUNNING},    {JOB_QUEUED, JOB_CANCELED},
        {JOB_RUNNING, JOB_SUCCEEDED}, {JOB_RUNNING, JOB_FAILED},
        {JOB_RUNNING, JOB_CANCELED},  {JOB_RUNNING, JOB_QUEUED},
    };
    for (int from = -1; from <= JOB_STATE_COUNT; from++) {
        for (int to = -1; to <= JOB_STATE_COUNT; to++) {
            bool drawn = false;
            for (size_t i = 0; i < sizeof arrows / sizeof arrows[0]; i++)
                drawn |= (int)arrows[i].from == from && (int)arrows[i].to == to;
            assert_int_equal(job_may((enum job_state)from, (enum job_state)to),
                             drawn);
        }
    }
}

static void
what_is_over_stays_over(void **state)
{
    (void)state;
    for (int from = 0; from < JOB_STATE_COUNT; from++) {
        bool leaves = false;
        for (int to = 0; to < JOB_STATE_COUNT; to++)
            leaves |= job_may((enum job_state)from, (enum job_state)to);
        assert_int_equal(job_is_over((enum job_state)from), !leaves);
    }
}

static void
names_go_there_and_back(void **state)
{
    (void)state;
    static const char *const names[] = {"queued", "running", "succeeded",
                                        "failed", "canceled"};
    for (int i = 0; i < JOB_STATE_COUNT; i++) {
        assert_string_equal(job_state_name((enum job_state)i), names[i]);
        assert_int_equal(job_state_find(names[i]), i);
    }
    static const char *const none[] = {"", "Queued", "cancelled", "queue",
                                       "queued "};
    for (size_t i = 0; i < sizeof none / sizeof none[0]; i++)
        assert_int_equal(job_state_find(none[i]), JOB_STATE_COUNT);
    assert_null(job_phase_name(JOB_PHASE_NONE));
    assert_string_equal(job_phase_name(JOB_LOADING), "loading");
    assert_string_equal(job_phase_name(JOB_BUILDING), "building");
    assert_string_equal(job_phase_name(JOB_TRACING), "tracing");
    assert_string_equal(job_phase_name(JOB_ENCODING), "encoding");
    assert_string_equal(job_priority_name(PRIORITY_DRAFT), "draft");
    assert_string_equal(job_priority_name(PRIORITY_NORMAL), "normal");
    assert_string_equal(job_priority_name(PRIORITY_LOW), "low");
}

static void
names_of_nonsense_do_not_crash(void **state)
{
    (void)state;
    assert_string_equal(job_state_name((enum job_state)77), "unknown");
    assert_null(job_phase_name((enum job_phase)77));
    assert_string_equal(job_priority_name((enum job_priority)77), "unknown");
}

int
main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(only_the_drawn_arrows_are_allowed),
        cmocka_unit_test(what_is_over_stays_over),
        cmocka_unit_test(names_go_there_and_back),
        cmocka_unit_test(names_of_nonsense_do_not_crash),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
