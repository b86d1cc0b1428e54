/* RFC 3339 into milliseconds. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "server/api/moment.h"

static void
moments_are_read(void **state)
{
    static const struct {
        const char *text;
        int64_t want;
    } rows[] = {
        {"1970-01-01T00:00:00Z", 0},
        {"1970-01-01T00:00:01.5Z", 1500},
        {"1970-01-01T00:00:00.1239999Z", 123},
        {"1970-01-01t01:00:00+01:00", 0},
        {"1969-12-31T23:00:00-01:00", 0},
        {"2000-02-29T12:00:00Z", 951825600000},
    };
    int64_t got;
    size_t i;

    (void)state;
    for (i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        assert_true(moment_read(rows[i].text, &got));
        assert_int_equal(got, rows[i].want);
    }
}

static void
other_texts_are_none(void **state)
{
    static const char *const rows[] = {
        "",
        "2026",
        "2026-11-22",
        "2026-11-22T11:30:00",
        "2026-02-30T11:30:00Z",
        "2026-13-01T11:30:00Z",
        "2026-11-22T24:30:00Z",
        "2026-11-22T11:60:00Z",
        "2026-11-22T11:30:00.Z",
        "2026-11-22T11:30:00Zx",
        "2026-11-22T11:30:00+1:00",
        "2026-11-22T11:30:00+24:00",
        "tomorrow",
        "2026-11-22T11:30:00 01:00",
    };
    int64_t got;
    size_t i;

    (void)state;
    for (i = 0; i < sizeof rows / sizeof rows[0]; i++)
        assert_false(moment_read(rows[i], &got));
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(moments_are_read),
        cmocka_unit_test(other_texts_are_none),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
