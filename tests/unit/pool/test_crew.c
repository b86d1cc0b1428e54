/* Threads shared out among running jobs. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "server/pool/crew.h"

static unsigned
sum_of(unsigned threads, unsigned running)
{
    unsigned sum = 0;
    for (unsigned i = 0; i < running; i++)
        sum += crew_share(threads, running, i);
    return sum;
}

static void
test_one_job_gets_all(void **state)
{
    (void)state;
    assert_int_equal(crew_share(1, 1, 0), 1);
    assert_int_equal(crew_share(16, 1, 0), 16);
}

static void
test_shares_add_up(void **state)
{
    (void)state;
    for (unsigned threads = 1; threads <= 64; threads++) {
        for (unsigned running = 1; running <= threads; running++)
            assert_int_equal(sum_of(threads, running), threads);
    }
}

static void
test_more_jobs_than_threads_get_one_each(void **state)
{
    (void)state;
    for (unsigned i = 0; i < 5; i++)
        assert_int_equal(crew_share(2, 5, i), 1);
}

static void
test_shares_are_even_and_earlier_ones_not_smaller(void **state)
{
    (void)state;
    for (unsigned running = 1; running <= 20; running++) {
        unsigned first = crew_share(37, running, 0);
        unsigned before = first;
        for (unsigned i = 0; i < running; i++) {
            unsigned share = crew_share(37, running, i);
            assert_true(share <= before && share + 1 >= first);
            before = share;
        }
    }
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_one_job_gets_all),
        cmocka_unit_test(test_shares_add_up),
        cmocka_unit_test(test_more_jobs_than_threads_get_one_each),
        cmocka_unit_test(test_shares_are_even_and_earlier_ones_not_smaller),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
