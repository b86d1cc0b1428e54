/* Given any finite double, its text reads back the same and nothing shorter
 * does. */

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/number.h"

static uint64_t state = 88172645463325252u;

static uint64_t
random_bits(void)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return state;
}

static double
random_double(void)
{
    double x;
    do {
        uint64_t bits = random_bits();
        memcpy(&x, &bits, sizeof x);
    } while (!isfinite(x));
    return x;
}

/* Significant digits in the text. */
static int
digits(const char *text)
{
    int count = 0, trailing = 0;
    for (; *text != '\0' && *text != 'e'; text++) {
        if (*text < '0' || *text > '9' || (count == 0 && *text == '0'))
            continue;
        count++;
        trailing = *text == '0' ? trailing + 1 : 0;
    }
    return count - trailing;
}

static void
check(double x)
{
    char text[NUMBER_SIZE], shorter[64];
    size_t len = number_text(x, text);
    assert_int_equal(len, strlen(text));
    assert_true(strtod(text, NULL) == x);
    int n = digits(text);
    if (n < 2)
        return;
    snprintf(shorter, sizeof shorter, "%.*e", n - 2, x);
    if (strtod(shorter, NULL) == x)
        fail_msg("%s reads back, but %s was written", shorter, text);
}

static void
known_numbers_have_known_texts(void **unused)
{
    static const struct {
        double number;
        const char *text;
    } rows[] = {
        {0, "0"},
        {-0.0, "0"},
        {1, "1"},
        {-3, "-3"},
        {0.1, "0.1"},
        {1e-7, "1e-7"},
        {-2.5e-9, "-2.5e-9"},
        {1e20, "1e20"},
        {1e15, "1e15"},
        {999999999999999.0, "999999999999999"},
        {1.0 / 3, "0.3333333333333333"},
        {5e-324, "5e-324"},
        {DBL_MAX, "1.7976931348623157e308"},
        {0.0001, "0.0001"},
        {1e-5, "1e-5"},
        {1e6, "1000000"},
        {0.30000000000000004, "0.30000000000000004"},
    };
    (void)unused;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        char text[NUMBER_SIZE];
        number_text(rows[i].number, text);
        assert_string_equal(text, rows[i].text);
    }
}

static void
random_numbers_read_back(void **unused)
{
    (void)unused;
    for (int i = 0; i < 200000; i++)
        check(random_double());
}

static void
decimals_stay_as_written(void **unused)
{
    (void)unused;
    for (int i = 0; i < 200000; i++) {
        char written[32], text[NUMBER_SIZE];
        snprintf(written, sizeof written, "0.%06u",
                 (unsigned)(random_bits() % 1000000));
        double x = strtod(written, NULL);
        number_text(x, text);
        assert_true(strtod(text, NULL) == x);
        assert_true(strlen(text) <= strlen(written));
    }
}

static void
powers_of_two_are_shortest(void **unused)
{
    (void)unused;
    for (int e = -1074; e <= 1023; e++) {
        check(ldexp(1, e));
        check(nextafter(ldexp(1, e), 0));
        check(-nextafter(ldexp(1, e), INFINITY));
    }
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(known_numbers_have_known_texts),
        cmocka_unit_test(random_numbers_read_back),
        cmocka_unit_test(decimals_stay_as_written),
        cmocka_unit_test(powers_of_two_are_shortest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
