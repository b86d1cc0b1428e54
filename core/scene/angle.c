#include "core/scene/angle.h"

#include <stdint.h>

/* Taylor series about 0; for |x| <= pi/4 the first term left out is below
 * 1e-19. */
static double
sine_near_zero(double x)
{
    double s = x * x;
    double p = 1.0 / 355687428096000.0; /* 1/17! */
    p = -1.0 / 1307674368000.0 + s * p;
    p = 1.0 / 6227020800.0 + s * p;
    p = -1.0 / 39916800.0 + s * p;
    p = 1.0 / 362880.0 + s * p;
    p = -1.0 / 5040.0 + s * p;
    p = 1.0 / 120.0 + s * p;
    p = -1.0 / 6.0 + s * p;
    return x + x * s * p;
}

static double
cosine_near_zero(double x)
{
    double s = x * x;
    double p = -1.0 / 6402373705728000.0; /* 1/18! */
    p = 1.0 / 20922789888000.0 + s * p;
    p = -1.0 / 87178291200.0 + s * p;
    p = 1.0 / 479001600.0 + s * p;
    p = -1.0 / 3628800.0 + s * p;
    p = 1.0 / 40320.0 + s * p;
    p = -1.0 / 720.0 + s * p;
    p = 1.0 / 24.0 + s * p;
    return 1.0 - (s * 0.5 - s * s * p);
}

void
angle_sin_cos(double degrees, double *sine, double *cosine)
{
    /* The nearest multiple of a right angle; the rest is exact. */
    double turns = degrees / 90.0;
    int64_t quarter = (int64_t)(turns < 0 ? turns - 0.5 : turns + 0.5);
    double rest = degrees - 90.0 * (double)quarter;

    double x = rest * 0.017453292519943295; /* pi / 180 */
    double s = sine_near_zero(x), c = cosine_near_zero(x);
    switch (quarter & 3) {
    case 0: *sine = s, *cosine = c; break;
    case 1: *sine = c, *cosine = -s; break;
    case 2: *sine = -s, *cosine = -c; break;
    default: *sine = -c, *cosine = s; break;
    }
}
