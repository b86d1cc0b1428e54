#include "core/image/curve.h"

#include <math.h>
#include <string.h>

/* Cube root of 2^-13 ... 1. The exponent divided by three is a guess within
 * 6 %; each step of Halley's method triples the digits: 5 %, 1e-4, 1e-12,
 * then rounding only. */
static double
cube_root(double v)
{
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    bits = bits / 3 + 0x2a9f7893782da1ceULL;
    double r;
    memcpy(&r, &bits, sizeof r);
    for (int i = 0; i < 3; i++) {
        double cube = r * r * r;
        r = r * (cube + 2 * v) / (2 * cube + v);
    }
    return r;
}

double
curve_srgb(double linear)
{
    if (linear <= 0.0031308)
        return 12.92 * linear;
    /* v^(1/2.4) = v^(5/12) = v^(1/3) * v^(1/12). */
    double c = cube_root(linear);
    return 1.055 * (c * sqrt(sqrt(c))) - 0.055;
}

/* The least float whose byte is k or more: the curve rises, so halve. */
static float
edge_of(int k, float low, float high)
{
    uint32_t a, b;
    memcpy(&a, &low, sizeof a);
    memcpy(&b, &high, sizeof b);
    while (a < b) {
        uint32_t middle = a + (b - a) / 2;
        float v;
        memcpy(&v, &middle, sizeof v);
        if ((int)(255 * curve_srgb((double)v) + 0.5) >= k)
            b = middle;
        else
            a = middle + 1;
    }
    float edge;
    memcpy(&edge, &a, sizeof edge);
    return edge;
}

void
curve8_init(struct curve8 *table)
{
    table->edges[0] = 0;
    for (int k = 1; k < 256; k++)
        table->edges[k] = edge_of(k, table->edges[k - 1], 1.0F);
    table->edges[256] = 2; /* over every input: the search always ends */
    int k = 0;
    for (uint32_t bin = 0; bin < CURVE_BINS; bin++) {
        uint32_t bits = (((127 - 13) << 6) + bin) << 17;
        float start;
        memcpy(&start, &bits, sizeof start);
        while (start >= table->edges[k + 1] && k < 255)
            k++;
        table->first[bin] = (uint8_t)k;
    }
}
