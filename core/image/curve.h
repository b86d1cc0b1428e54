/* curve.h - the sRGB curve (IEC 61966-2-1), without the C library's pow, so that
 * a byte does not depend on which C library is installed (HOUSE 7). Pure, any
 * thread. */
#ifndef CORE_IMAGE_CURVE_H
#define CORE_IMAGE_CURVE_H

#include <stdint.h>

/* Linear 0...1 -> encoded 0...1: 12.92 v up to 0.0031308, then
 * 1.055 v^(1/2.4) - 0.055. Relative error below 1e-15. */
double
curve_srgb(double linear);

/* A table that gives floor(255 curve_srgb(v) + 1/2) for any float v in 0...1
 * without computing the curve: equal to the formula for every float. */
enum {
    CURVE_BINS = 14 * 64 /* 64 per octave, from 2^-13 to 1 */
};
struct curve8 {
    float edges[257];          /* edges[k]: least float that gives k; [256] 2 */
    uint8_t first[CURVE_BINS]; /* the value at the beginning of each bin */
};

void
curve8_init(struct curve8 *table);

/* `linear` must be in 0...1. */
static inline uint8_t
curve8_value(const struct curve8 *table, float linear)
{
    union {
        float value;
        uint32_t bits;
    } f = {linear};
    /* A float's top bits are its octave and place therein: the bin. */
    uint32_t bin = f.bits >> 17;
    const uint32_t lowest = (127 - 13) << 6;
    uint32_t k = bin > lowest ? table->first[bin - lowest] : 0;
    while (linear >= table->edges[k + 1])
        k++;
    return (uint8_t)k;
}

#endif
