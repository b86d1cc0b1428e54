#include "core/trace/sampler.h"

static inline uint32_t
reverse_bits(uint32_t x)
{
    x = (x >> 16) | (x << 16);
    x = ((x & 0x00ff00ffu) << 8) | ((x & 0xff00ff00u) >> 8);
    x = ((x & 0x0f0f0f0fu) << 4) | ((x & 0xf0f0f0f0u) >> 4);
    x = ((x & 0x33333333u) << 2) | ((x & 0xccccccccu) >> 2);
    return ((x & 0x55555555u) << 1) | ((x & 0xaaaaaaaau) >> 1);
}

/* Owen's nested scramble of reversed bits: each step lets a bit depend on
 * itself and lower ones only (Laine and Karras 2011; Burley 2020). */
static inline uint32_t
scramble_reversed(uint32_t x, uint32_t seed)
{
    x += seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return x;
}

static inline uint32_t
scramble(uint32_t x, uint32_t seed)
{
    return reverse_bits(scramble_reversed(reverse_bits(x), seed));
}

/* Second Sobol dimension: polynomial x + 1, whose direction numbers are the
 * rows of Pascal's triangle modulo 2. */
static inline uint32_t
sobol_second(uint32_t index)
{
    uint32_t x = 0, v = 0x80000000u;
    for (int bit = 0; bit < 32; bit++) {
        x ^= (0u - (index >> bit & 1u)) & v;
        v ^= v >> 1;
    }
    return x;
}

/* A permutation of 0 ... count - 1 picked by seed: cycle walking of a mix that
 * is a bijection of [0, 2^k). */
static uint32_t
permute(uint32_t i, uint32_t count, uint32_t seed)
{
    uint32_t mask = count - 1;
    mask |= mask >> 1;
    mask |= mask >> 2;
    mask |= mask >> 4;
    mask |= mask >> 8;
    mask |= mask >> 16;
    if (count <= 1)
        return 0;
    do {
        for (uint32_t round = 0; round < 4; round++) {
            uint32_t key = sampler_mix(seed + round);
            i = (i + key) & mask;
            i = (i * (2u * (key >> 8) + 1u)) & mask;
            i ^= i >> 3;
            i ^= (i & mask) >> 7;
        }
    } while (i >= count);
    return i;
}

static void
fill_stratified(const struct scene_sampler *s, uint32_t n,
                const uint32_t *pixel, uint32_t sample, uint32_t pair, float *x,
                float *y)
{
    uint32_t columns = 1;
    while (columns * columns < s->spp)
        columns++;
    uint32_t rows = (s->spp + columns - 1) / columns;
    float width = 1.0f / (float)columns, height = 1.0f / (float)rows;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t seed = sampler_hash(s->seed, pixel[i], 0x5u, pair);
        uint32_t cell = permute(sample, columns * rows, seed);
        uint32_t jitter =
            sampler_hash(s->seed, pixel[i], sample, 2 * pair + 0x100u);
        float a = sampler_unit(jitter), b = sampler_unit(sampler_mix(~jitter));
        x[i] = ((float)(cell % columns) + a) * width;
        uint32_t row = cell / columns;
        y[i] = ((float)row + b) * height;
        x[i] = x[i] < 0x1.fffffep-1f ? x[i] : 0x1.fffffep-1f;
        y[i] = y[i] < 0x1.fffffep-1f ? y[i] : 0x1.fffffep-1f;
    }
}

static void
fill_sobol(const struct scene_sampler *s, uint32_t n,
           const uint32_t *restrict pixel, uint32_t sample, uint32_t pair,
           float *restrict x, float *restrict y)
{
    for (uint32_t i = 0; i < n; i++) {
        uint32_t seed = sampler_hash(s->seed, pixel[i], 0x50b01u, pair);
        uint32_t index = scramble(sample, seed);
        /* The first dimension is the reversed index. */
        uint32_t a = scramble_reversed(index, sampler_mix(seed ^ 1u));
        uint32_t b = scramble(sobol_second(index), sampler_mix(seed ^ 2u));
        x[i] = sampler_unit(reverse_bits(a));
        y[i] = sampler_unit(b);
    }
}

void
sampler_fill(const struct scene_sampler *s, uint32_t n, const uint32_t *pixel,
             uint32_t sample, uint32_t pair, float *x, float *y)
{
    switch (s->kind) {
    case SAMPLER_CENTER:
        for (uint32_t i = 0; i < n; i++)
            x[i] = y[i] = 0.5f;
        return;
    case SAMPLER_INDEPENDENT:
        for (uint32_t i = 0; i < n; i++) {
            x[i] =
                sampler_unit(sampler_hash(s->seed, pixel[i], sample, 2 * pair));
            y[i] = sampler_unit(
                sampler_hash(s->seed, pixel[i], sample, 2 * pair + 1));
        }
        return;
    case SAMPLER_STRATIFIED:
        fill_stratified(s, n, pixel, sample, pair, x, y);
        return;
    case SAMPLER_SOBOL: fill_sobol(s, n, pixel, sample, pair, x, y); return;
    }
}
