/* test_math.c - core/base/math.h against libm, with the bounds its header
 * states. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "core/base/math.h"
#include "scenes.h"

static double worst;

static void
note(double error)
{
    if (!(error <= worst))
        worst = error;
}

static void
expect_worst(const char *what, double bound)
{
    if (!(worst <= bound))
        fail_msg("%s: error %g, promised %g", what, worst, bound);
    worst = 0.0;
}

static void
double_family(void **state)
{
    struct dice d = {1};
    (void)state;
    for (int i = 0; i < 200000; i++) {
        double x = dice_range(&d, -700, 700);
        note(fabs(math_exp(x) - exp(x)) / exp(x));
    }
    expect_worst("exp", 5e-16);
    for (int i = 0; i < 200000; i++) {
        double x = exp(dice_range(&d, -700, 700));
        note(fabs(math_log(x) - log(x)) / fabs(log(x)));
    }
    expect_worst("log", 5e-16);
    for (int i = 0; i < 200000; i++) {
        double x = dice_range(&d, 0.5, 2);
        note(fabs(math_log(x) - log(x)));
    }
    expect_worst("log near 1", 1.2e-16);
    for (int i = 0; i < 200000; i++) {
        double x = dice_range(&d, -1e6, 1e6) * pow(dice_unit(&d), 4);
        double scale = fmax(1, fabs(x) / 8);
        note(fabs(math_sin(x) - sin(x)) / scale);
        note(fabs(math_cos(x) - cos(x)) / scale);
    }
    expect_worst("sin and cos", 3e-16);
    for (int i = 0; i < 200000; i++) {
        double x = exp(dice_range(&d, -20, 5)), y = dice_range(&d, -9, 9);
        double want = pow(x, y);
        note(fabs(math_pow(x, y) - want) / want / (2 + fabs(y * log(x))));
    }
    expect_worst("pow", 4e-16);
    for (int i = 0; i < 200000; i++) {
        double x = dice_range(&d, -3, 3), y = dice_range(&d, -3, 3);
        note(fabs(math_atan2(y, x) - atan2(y, x)));
        x /= 3;
        note(fabs(math_asin(x) - asin(x)));
        note(fabs(math_acos(x) - acos(x)));
    }
    expect_worst("atan2, asin, acos", 5e-16);
}

static void
double_corners(void **state)
{
    double s, c;
    (void)state;
    for (int k = -8; k <= 8; k++) {
        const double sines[4] = {0, 1, 0, -1};
        math_sincos_deg(90.0 * k, &s, &c);
        assert_true(s == sines[(k + 8) % 4] && c == sines[(k + 9) % 4]);
    }
    math_sincos_deg(30, &s, &c);
    assert_true(fabs(s - 0.5) < 1.2e-16 && fabs(c - sqrt(0.75)) < 1.2e-16);
    assert_true(math_exp(0) == 1 && math_log(1) == 0);
    assert_true(isinf(math_exp(800)) && math_exp(-800) == 0);
    assert_true(math_log(0) == -INFINITY && isnan(math_log(-1)));
    assert_true(math_log(INFINITY) == INFINITY);
    assert_true(math_pow(0, 0) == 1 && math_pow(0, 2.4) == 0);
    assert_true(isnan(math_pow(-1, 0.5)));
    assert_true(math_atan2(0, 0) == 0 && math_atan2(0, -1) == MATH_PI);
    assert_true(math_asin(2) == math_asin(1) && math_acos(-2) == MATH_PI);
    assert_true(isnan(math_exp(NAN)) && isnan(math_log(NAN)));
    assert_true(fabs(math_log(5e-324) - log(5e-324)) < 1e-12);
}

static void
float_family(void **state)
{
    struct dice d = {2};
    (void)state;
    for (int i = 0; i < 200000; i++) {
        float x = (float)dice_range(&d, -126, 128);
        double want = exp2((double)x);
        note(fabs((double)math_exp2f(x) - want) / want);
    }
    expect_worst("exp2f", 2e-7);
    for (int i = 0; i < 200000; i++) {
        float x = (float)exp2(dice_range(&d, -126, 127.9));
        double want = log2((double)x);
        note(fabs((double)math_log2f(x) - want) / fabs(want));
        x = (float)dice_range(&d, 0.7, 1.5);
        want = log2((double)x);
        if (want != 0)
            note(fabs((double)math_log2f(x) - want) / fabs(want));
    }
    expect_worst("log2f", 3e-7);
    for (int i = 0; i < 200000; i++) {
        float x = (float)dice_unit(&d), y = (float)dice_range(&d, 0, 200);
        double want = pow((double)x, (double)y);
        double turns = fabs((double)y * log2((double)x));
        if (want > 1.2e-38)
            note(fabs((double)math_powf(x, y) - want) / want / (2 + turns));
    }
    expect_worst("powf", 3e-7);
    for (int i = 0; i < 200000; i++) {
        float x = (float)dice_range(&d, -1e4, 1e4) * (float)dice_unit(&d);
        double scale = fmax(1, fabs((double)x));
        note(fabs((double)math_sinf(x) - sin((double)x)) / scale);
        note(fabs((double)math_cosf(x) - cos((double)x)) / scale);
    }
    expect_worst("sinf and cosf", 3e-7);
    for (int i = 0; i < 200000; i++) {
        float x = (float)dice_range(&d, -1, 1);
        float y = (float)dice_range(&d, -1, 1);
        note(fabs((double)math_atan2f(y, x) - atan2((double)y, (double)x)));
        note(fabs((double)math_asinf(x) - asin((double)x)));
    }
    expect_worst("atan2f and asinf", 5e-7);
}

static void
float_corners(void **state)
{
    (void)state;
    assert_true(math_powf(0, 0) == 1 && math_powf(0, 50) == 0);
    assert_true(math_powf(1, 1e5f) == 1 && math_powf(0.5f, 1e5f) == 0);
    assert_true(isfinite(math_powf(1e30f, 1e5f)));
    assert_true(math_exp2f(-200) == 0 && math_exp2f(10) == 1024);
    for (float x = -50; x < 50; x += 0.125f)
        assert_true(math_floorf(x) == floorf(x));
    const float large[] = {8388607.5f, -8388607.5f, 3e9f, -3e9f, 1e30f, -1e30f};
    for (size_t i = 0; i < sizeof large / sizeof *large; i++)
        assert_true(math_floorf(large[i]) == floorf(large[i]));
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(double_family),
        cmocka_unit_test(double_corners),
        cmocka_unit_test(float_family),
        cmocka_unit_test(float_corners),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
