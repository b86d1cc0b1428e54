/* range.c: what a Range header means for a file of a hundred bytes. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "server/http/range.h"

static void
test_table(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        enum range_kind kind;
        uint64_t first, last;
    } rows[] = {
        {NULL, RANGE_WHOLE, 0, 0},
        {"bytes=0-0", RANGE_PART, 0, 0},
        {"bytes=0-99", RANGE_PART, 0, 99},
        {"bytes=10-", RANGE_PART, 10, 99},
        {"bytes=10-1000", RANGE_PART, 10, 99},
        {"bytes=99-", RANGE_PART, 99, 99},
        {"bytes=100-", RANGE_NONE, 0, 0},
        {"bytes=-1", RANGE_PART, 99, 99},
        {"bytes=-100", RANGE_PART, 0, 99},
        {"bytes=-200", RANGE_PART, 0, 99},
        {"bytes=-0", RANGE_NONE, 0, 0},
        {"bytes=5-4", RANGE_WHOLE, 0, 0},
        {"bytes=", RANGE_WHOLE, 0, 0},
        {"bytes=-", RANGE_WHOLE, 0, 0},
        {"bytes=a-b", RANGE_WHOLE, 0, 0},
        {"bytes=1-2,4-5", RANGE_WHOLE, 0, 0},
        {"bytes= 1-2", RANGE_WHOLE, 0, 0},
        {"bytes=1-2 ", RANGE_WHOLE, 0, 0},
        {"bytes=+1-2", RANGE_WHOLE, 0, 0},
        {"bytes=--1", RANGE_WHOLE, 0, 0},
        {"lines=1-2", RANGE_WHOLE, 0, 0},
        {"", RANGE_WHOLE, 0, 0},
        {"bytes=99999999999999999999-", RANGE_WHOLE, 0, 0},
        {"bytes=0-99999999999999999999", RANGE_WHOLE, 0, 0},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        uint64_t first = 0, last = 0;
        enum range_kind kind = range_read(rows[i].text, 100, &first, &last);
        if (kind != rows[i].kind)
            fail_msg("%s: kind %d", rows[i].text, (int)kind);
        if (kind == RANGE_PART) {
            assert_int_equal(first, rows[i].first);
            assert_int_equal(last, rows[i].last);
        }
    }
}

static void
test_empty_file(void **state)
{
    (void)state;
    uint64_t first, last;
    assert_int_equal(range_read("bytes=0-", 0, &first, &last), RANGE_NONE);
    assert_int_equal(range_read("bytes=-5", 0, &first, &last), RANGE_NONE);
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_table),
        cmocka_unit_test(test_empty_file),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
