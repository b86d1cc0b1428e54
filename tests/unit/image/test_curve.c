/* The sRGB curve against the C library's long double pow. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "core/image/curve.h"

static long double
reference(double v)
{
    if (v <= 0.0031308)
        return 12.92L * v;
    return 1.055L * powl(v, 1 / 2.4L) - 0.055L;
}

static float
float_of(uint32_t bits)
{
    float v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

static uint32_t
bits_of(float v)
{
    uint32_t bits;
    memcpy(&bits, &v, sizeof bits);
    return bits;
}

static unsigned
exact(unsigned levels, float v)
{
    return (unsigned)floorl(levels * reference(v) + 0.5L);
}

/* Every 61st of the thousand million floats in 0...1. */
static void
both_depths_equal_the_formula_on_a_dense_set(void **state)
{
    (void)state;
    static struct curve8 table;
    curve8_init(&table);
    uint32_t end = bits_of(1.0F);
    /* Below 2^-18 both are plainly 0 or the straight line: coarser there. */
    for (uint32_t bits = 0; bits <= end;
         bits += bits < bits_of(0x1p-18F) ? 100003 : 61) {
        float v = float_of(bits);
        unsigned got8 = curve8_value(&table, v);
        if (got8 != exact(255, v))
            fail_msg("8 bit of %a: %u, not %u", (double)v, got8, exact(255, v));
        unsigned got16 = (unsigned)(65535 * curve_srgb((double)v) + 0.5);
        if (got16 != exact(65535, v))
            fail_msg("16 bit of %a: %u, not %u", (double)v, got16,
                     exact(65535, v));
    }
    assert_int_equal(curve8_value(&table, 1.0F), 255);
    assert_int_equal(curve8_value(&table, 0.0F), 0);
}

/* The floats around each step, where a small error would show. */
static void
each_edge_is_the_least_float_of_its_value(void **state)
{
    (void)state;
    static struct curve8 table;
    curve8_init(&table);
    for (unsigned k = 1; k < 256; k++) {
        uint32_t edge = bits_of(table.edges[k]);
        for (uint32_t bits = edge - 100; bits <= edge + 100; bits++) {
            float v = float_of(bits);
            assert_int_equal(curve8_value(&table, v), exact(255, v));
        }
        assert_int_equal(exact(255, float_of(edge)), k);
        assert_int_equal(exact(255, float_of(edge - 1)), k - 1);
    }
}

static void
sixteen_bit_steps_are_exact_on_both_sides(void **state)
{
    (void)state;
    for (unsigned k = 1; k < 65536; k++) {
        /* The inverse puts us within some floats of the step. */
        long double s = ((long double)k - 0.5L) / 65535;
        long double v =
            s <= 0.04045L ? s / 12.92L : powl((s + 0.055L) / 1.055L, 2.4L);
        uint32_t near = bits_of((float)v);
        for (uint32_t bits = near - 3; bits <= near + 3; bits++) {
            float f = float_of(bits);
            if (f > 1)
                continue;
            unsigned got = (unsigned)(65535 * curve_srgb((double)f) + 0.5);
            if (got != exact(65535, f))
                fail_msg("16 bit of %a: %u, not %u", (double)f, got,
                         exact(65535, f));
        }
    }
}

static void
the_curve_is_exact_to_fifteen_digits(void **state)
{
    (void)state;
    long double worst = 0;
    for (int i = 1; i <= 200000; i++) {
        double v = i / 200000.0;
        long double off = fabsl(curve_srgb(v) / reference(v) - 1);
        worst = off > worst ? off : worst;
    }
    if (worst > 1e-15L)
        fail_msg("relative error %.3Lg", worst);
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(both_depths_equal_the_formula_on_a_dense_set),
        cmocka_unit_test(each_edge_is_the_least_float_of_its_value),
        cmocka_unit_test(sixteen_bit_steps_are_exact_on_both_sides),
        cmocka_unit_test(the_curve_is_exact_to_fifteen_digits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
