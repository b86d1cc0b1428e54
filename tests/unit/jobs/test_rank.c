/* The fair order between owners. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "server/jobs/rank.h"

static void
jobs_of_one_owner_line_up(void **state)
{
    (void)state;
    int64_t end = 0;
    for (int i = 0; i < 10; i++) {
        struct rank_turn turn = rank_next(0, end, 2.5);
        assert_int_equal(turn.start, i * 2500000);
        assert_int_equal(turn.end, (i + 1) * 2500000);
        end = turn.end;
    }
}

static void
who_was_idle_saves_nothing_up(void **state)
{
    (void)state;
    struct rank_turn turn = rank_next(9000000, 1000000, 1);
    assert_int_equal(turn.start, 9000000);
    turn = rank_next(9000000, 0, 1);
    assert_int_equal(turn.start, 9000000);
}

static void
a_turn_has_a_least_and_a_greatest_length(void **state)
{
    (void)state;
    static const double tiny[] = {0, -5, 1e-9, NAN, -INFINITY};
    static const double huge[] = {600, 601, 1e300, INFINITY};
    for (size_t i = 0; i < sizeof tiny / sizeof tiny[0]; i++)
        assert_int_equal(rank_next(0, 0, tiny[i]).end, 100000);
    for (size_t i = 0; i < sizeof huge / sizeof huge[0]; i++)
        assert_int_equal(rank_next(0, 0, huge[i]).end, 600000000);
}

/* Two owners, one slow, one quick, served in order of rank: each gets half of
 * the worker's time, whatever the number of jobs. */
static void
shares_of_work_are_equal(void **state)
{
    (void)state;
    static const double seconds[2] = {7, 0.5};
    int64_t clock = 0, end[2] = {0}, next[2];
    double worked[2] = {0};
    for (int owner = 0; owner < 2; owner++) {
        struct rank_turn turn = rank_next(clock, 0, seconds[owner]);
        next[owner] = turn.start;
        end[owner] = turn.end;
    }
    for (int i = 0; i < 3000; i++) {
        int owner = next[0] <= next[1] ? 0 : 1;
        clock = next[owner];
        worked[owner] += seconds[owner];
        struct rank_turn turn = rank_next(clock, end[owner], seconds[owner]);
        next[owner] = turn.start;
        end[owner] = turn.end;
        double ahead = worked[0] - worked[1];
        assert_true(ahead > -8 && ahead < 8);
    }
}

static void
drafts_and_quick_work_are_short(void **state)
{
    (void)state;
    struct job job = {.priority = PRIORITY_NORMAL, .estimate_seconds = 1.99};
    assert_true(rank_is_short(&job));
    job.estimate_seconds = 2;
    assert_false(rank_is_short(&job));
    job.estimate_seconds = NAN;
    assert_false(rank_is_short(&job));
    job.priority = PRIORITY_DRAFT;
    assert_true(rank_is_short(&job));
}

int
main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(jobs_of_one_owner_line_up),
        cmocka_unit_test(who_was_idle_saves_nothing_up),
        cmocka_unit_test(a_turn_has_a_least_and_a_greatest_length),
        cmocka_unit_test(shares_of_work_are_equal),
        cmocka_unit_test(drafts_and_quick_work_are_short),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
