/* test_sampler.c - the random numbers: in range, stratified, nets, seeds. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/trace/sampler.h"

enum { PIXELS = 32 };

static void
fill(enum sampler_kind kind, uint32_t spp, uint32_t seed, uint32_t sample,
     uint32_t pair, float *x, float *y)
{
    struct scene_sampler s = {.kind = kind, .spp = spp, .seed = seed};
    uint32_t pixel[PIXELS];
    for (uint32_t i = 0; i < PIXELS; i++)
        pixel[i] = 1000 * i + 7;
    sampler_fill(&s, PIXELS, pixel, sample, pair, x, y);
}

static void
all_kinds_in_range_with_mean_half(void **state)
{
    (void)state;
    for (int kind = SAMPLER_CENTER; kind <= SAMPLER_SOBOL; kind++) {
        double sum_x = 0, sum_y = 0;
        const uint32_t spp = kind == SAMPLER_CENTER ? 1 : 1000;
        for (uint32_t sample = 0; sample < spp; sample++) {
            float x[PIXELS], y[PIXELS];
            fill((enum sampler_kind)kind, spp, 3, sample, 1, x, y);
            for (int i = 0; i < PIXELS; i++) {
                assert_true(x[i] >= 0 && x[i] < 1 && y[i] >= 0 && y[i] < 1);
                sum_x += (double)x[i];
                sum_y += (double)y[i];
            }
        }
        assert_true(fabs(sum_x / spp / PIXELS - 0.5) < 0.01);
        assert_true(fabs(sum_y / spp / PIXELS - 0.5) < 0.01);
    }
}

static void
stratified_cells_are_met_once(void **state)
{
    (void)state;
    for (uint32_t side = 1; side <= 9; side++) {
        uint32_t met[PIXELS][81];
        memset(met, 0, sizeof met);
        for (uint32_t sample = 0; sample < side * side; sample++) {
            float x[PIXELS], y[PIXELS];
            fill(SAMPLER_STRATIFIED, side * side, 5, sample, 0, x, y);
            for (int i = 0; i < PIXELS; i++)
                met[i][(uint32_t)(y[i] * (float)side) * side +
                       (uint32_t)(x[i] * (float)side)]++;
        }
        for (int i = 0; i < PIXELS; i++)
            for (uint32_t c = 0; c < side * side; c++)
                assert_int_equal(met[i][c], 1);
    }
}

/* 2^k points, any aligned run of them: every elementary interval of area 2^-k
 * holds exactly one. */
static void
sobol_is_a_net(void **state)
{
    (void)state;
    for (uint32_t k = 0; k <= 8; k++)
        for (uint32_t run = 0; run < 2; run++)
            for (uint32_t across = 0; across <= k; across++) {
                uint32_t count = 1u << k, columns = 1u << across;
                uint32_t rows = count / columns;
                uint32_t met[PIXELS][256];
                memset(met, 0, sizeof met);
                for (uint32_t s = 0; s < count; s++) {
                    float x[PIXELS], y[PIXELS];
                    fill(SAMPLER_SOBOL, 512, 9, run * count + s, 2, x, y);
                    for (int i = 0; i < PIXELS; i++)
                        met[i][(uint32_t)(y[i] * (float)rows) * columns +
                               (uint32_t)(x[i] * (float)columns)]++;
                }
                for (int i = 0; i < PIXELS; i++)
                    for (uint32_t c = 0; c < count; c++)
                        assert_int_equal(met[i][c], 1);
            }
}

static void
seeds_pixels_pairs_and_samples_differ(void **state)
{
    (void)state;
    for (int kind = SAMPLER_INDEPENDENT; kind <= SAMPLER_SOBOL; kind++) {
        float x[4][PIXELS], y[4][PIXELS], again[PIXELS];
        enum sampler_kind k = (enum sampler_kind)kind;
        fill(k, 64, 1, 0, 0, x[0], y[0]);
        fill(k, 64, 2, 0, 0, x[1], y[1]);
        fill(k, 64, 1, 1, 0, x[2], y[2]);
        fill(k, 64, 1, 0, 1, x[3], y[3]);
        fill(k, 64, 1, 0, 0, again, y[3]);
        assert_memory_equal(x[0], again, sizeof again);
        for (int other = 1; other < 4; other++) {
            int same = 0;
            for (int i = 0; i < PIXELS; i++)
                same += x[0][i] == x[other][i] ? 1 : 0;
            assert_true(same < 2);
        }
        for (int i = 1; i < PIXELS; i++)
            assert_true(x[0][i] != x[0][0]);
    }
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_kinds_in_range_with_mean_half),
        cmocka_unit_test(stratified_cells_are_met_once),
        cmocka_unit_test(sobol_is_a_net),
        cmocka_unit_test(seeds_pixels_pairs_and_samples_differ),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
