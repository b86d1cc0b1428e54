/* sampler.h - random numbers that know where they are: a pure function of seed,
 * pixel, sample and dimension. No state, so no thread, tile or order enters. */
#ifndef CORE_TRACE_SAMPLER_H
#define CORE_TRACE_SAMPLER_H

#include <stdint.h>

#include "core/scene/scene.h"
#include "core/trace/kernel_names.h"

/* Mixes well: every input bit changes each output bit about half the time. */
static inline uint32_t
sampler_mix(uint32_t x)
{
    x ^= x >> 16;
    x *= 0x21f0aaadu;
    x ^= x >> 15;
    x *= 0x735a2d97u;
    x ^= x >> 15;
    return x;
}

static inline uint32_t
sampler_hash(uint32_t seed, uint32_t pixel, uint32_t sample, uint32_t dimension)
{
    uint32_t h = sampler_mix(seed ^ 0x9e3779b9u);
    h = sampler_mix(h ^ pixel);
    h = sampler_mix(h + 0x85ebca6bu * sample);
    return sampler_mix(h ^ (dimension + 1u) * 0xc2b2ae35u);
}

/* Upper 24 bits as [0, 1). */
static inline float
sampler_unit(uint32_t bits)
{
    return (float)(bits >> 8) * 0x1p-24f;
}

/* Two numbers in [0, 1) per entry, for dimensions 2 pair and 2 pair + 1 of
 * `sample` (< sampler->spp):
 *   center       0.5, 0.5
 *   independent  the hash
 *   stratified   one cell of a grid of at least spp cells, drawn without
 *                repetition, jittered inside
 *   sobol        the first two Sobol dimensions, index and values scrambled
 *                after Owen: any 2^k samples from a multiple of 2^k on form a
 *                (0, k, 2)-net in each pixel and pair
 *   pixel[n]  a number per pixel, the same for the same pixel in every tile */
void
sampler_fill(const struct scene_sampler *sampler, uint32_t n,
             const uint32_t *pixel, uint32_t sample, uint32_t pair, float *x,
             float *y);

#endif
