#include "core/base/math.h"

/* pi/2, ln 2 and friends as a head with zero low bits and a tail: small whole
 * multiples of the head are exact. */
static const double half_pi_head = 0x1.921fb544p+0;
static const double half_pi_mid = 0x1.0b4611a6p-34;
static const double half_pi_tail = 0x1.3198a2e037073p-69;
static const double ln2_head = 0x1.62e42fefap-1;
static const double ln2_tail = 0x1.cf79abc9e3b3ap-40;

static uint64_t
bits_of(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static double
from_bits(uint64_t bits)
{
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* Nearest whole number, |x| < 2^51. */
static double
nearest(double x)
{
    return (x + 0x1.8p52) - 0x1.8p52;
}

/* |r| <= pi/4: Taylor, the first term left out is below 1e-19. */
static double
sin_kernel(double r)
{
    double z = r * r;
    double p = 1.0 / 355687428096000.0;
    p = p * z - 1.0 / 1307674368000.0;
    p = p * z + 1.0 / 6227020800.0;
    p = p * z - 1.0 / 39916800.0;
    p = p * z + 1.0 / 362880.0;
    p = p * z - 1.0 / 5040.0;
    p = p * z + 1.0 / 120.0;
    p = p * z - 1.0 / 6.0;
    return r + r * (z * p);
}

static double
cos_kernel(double r)
{
    double z = r * r;
    double p = -1.0 / 6402373705728000.0;
    p = p * z + 1.0 / 20922789888000.0;
    p = p * z - 1.0 / 87178291200.0;
    p = p * z + 1.0 / 479001600.0;
    p = p * z - 1.0 / 3628800.0;
    p = p * z + 1.0 / 40320.0;
    p = p * z - 1.0 / 720.0;
    p = p * z + 1.0 / 24.0;
    return 1.0 - (0.5 * z - z * z * p);
}

static double
quadrant(double r, int64_t q)
{
    double v = (q & 1) != 0 ? cos_kernel(r) : sin_kernel(r);
    return (q & 2) != 0 ? -v : v;
}

void
math_sincos_deg(double deg, double *sin, double *cos)
{
    double k = nearest(deg / 90.0);
    double r = (deg - k * 90.0) * (MATH_PI / 180.0); /* difference is exact */
    int64_t q = (int64_t)k;
    *sin = quadrant(r, q) + 0.0; /* no minus zero */
    *cos = quadrant(r, q + 1) + 0.0;
}

static double
reduce(double x, int64_t *q)
{
    double k = nearest(x * (2.0 / MATH_PI));
    *q = (int64_t)k;
    return ((x - k * half_pi_head) - k * half_pi_mid) - k * half_pi_tail;
}

double
math_sin(double x)
{
    int64_t q;
    double r = reduce(x, &q);
    return quadrant(r, q);
}

double
math_cos(double x)
{
    int64_t q;
    double r = reduce(x, &q);
    return quadrant(r, q + 1);
}

double
math_tan(double x)
{
    return math_sin(x) / math_cos(x);
}

double
math_exp(double x)
{
    if (x != x)
        return x;
    if (x > 709.782712893384)
        return __builtin_inf();
    if (x < -745.2)
        return 0.0;
    double k = nearest(x * 1.4426950408889634);
    double r = (x - k * ln2_head) - k * ln2_tail;
    double p = 1.0 / 6227020800.0;
    p = p * r + 1.0 / 479001600.0;
    p = p * r + 1.0 / 39916800.0;
    p = p * r + 1.0 / 3628800.0;
    p = p * r + 1.0 / 362880.0;
    p = p * r + 1.0 / 40320.0;
    p = p * r + 1.0 / 5040.0;
    p = p * r + 1.0 / 720.0;
    p = p * r + 1.0 / 120.0;
    p = p * r + 1.0 / 24.0;
    p = p * r + 1.0 / 6.0;
    p = p * r + 0.5;
    p = 1.0 + (r + r * r * p);
    int64_t half = (int64_t)k >> 1;
    int64_t rest = (int64_t)k - half;
    return p * from_bits((uint64_t)(half + 1023) << 52) *
           from_bits((uint64_t)(rest + 1023) << 52);
}

double
math_log(double x)
{
    if (x != x || x < 0.0)
        return __builtin_nan("");
    if (x == 0.0)
        return -__builtin_inf();
    if (x > 1.7976931348623157e308)
        return x;
    double scale = 0.0;
    if (x < 0x1p-1022) {
        x *= 0x1p54;
        scale = -54.0;
    }
    /* x = 2^k m, m in [sqrt(1/2), sqrt(2)); log m = 2 atanh(s). */
    uint64_t bits = bits_of(x);
    int64_t k = (int64_t)(bits - 0x3fe6a09e667f3bcdu) >> 52;
    double t = from_bits(bits - ((uint64_t)k << 52)) - 1.0;
    double s = t / (2.0 + t);
    double z = s * s;
    double p = 2.0 / 25.0;
    p = p * z + 2.0 / 23.0;
    p = p * z + 2.0 / 21.0;
    p = p * z + 2.0 / 19.0;
    p = p * z + 2.0 / 17.0;
    p = p * z + 2.0 / 15.0;
    p = p * z + 2.0 / 13.0;
    p = p * z + 2.0 / 11.0;
    p = p * z + 2.0 / 9.0;
    p = p * z + 2.0 / 7.0;
    p = p * z + 2.0 / 5.0;
    p = p * z + 2.0 / 3.0;
    /* log m = t - t^2/2 + s (t^2/2 + z p): t is exact, the rest is small. */
    double h = 0.5 * t * t;
    double exponent = (double)k + scale;
    double low = s * (h + z * p) + exponent * ln2_tail;
    return exponent * ln2_head + (t - (h - low));
}

double
math_pow(double x, double y)
{
    if (y == 0.0)
        return 1.0;
    if (x == 0.0)
        return y > 0.0 ? 0.0 : __builtin_inf();
    return math_exp(y * math_log(x));
}

/* |w| <= tan 15 degrees. */
static double
atan_kernel(double w)
{
    double z = w * w;
    double p = -1.0 / 27.0;
    p = p * z + 1.0 / 25.0;
    p = p * z - 1.0 / 23.0;
    p = p * z + 1.0 / 21.0;
    p = p * z - 1.0 / 19.0;
    p = p * z + 1.0 / 17.0;
    p = p * z - 1.0 / 15.0;
    p = p * z + 1.0 / 13.0;
    p = p * z - 1.0 / 11.0;
    p = p * z + 1.0 / 9.0;
    p = p * z - 1.0 / 7.0;
    p = p * z + 1.0 / 5.0;
    p = p * z - 1.0 / 3.0;
    return w + w * (z * p);
}

double
math_atan2(double y, double x)
{
    if (x != x || y != y)
        return __builtin_nan("");
    double ax = x < 0.0 ? -x : x;
    double ay = y < 0.0 ? -y : y;
    double big = ax > ay ? ax : ay;
    double small = ax > ay ? ay : ax;
    if (big == 0.0)
        return 0.0;
    double q = small / big;
    if (q != q) /* both infinite */
        q = 1.0;
    double a;
    if (q > 0.2679491924311227)
        a = MATH_PI / 6.0 + atan_kernel((q * 1.7320508075688772 - 1.0) /
                                        (q + 1.7320508075688772));
    else
        a = atan_kernel(q);
    if (ay > ax)
        a = MATH_PI / 2.0 - a;
    if (x < 0.0)
        a = MATH_PI - a;
    return y < 0.0 ? -a : a;
}

double
math_asin(double x)
{
    double c = x < -1.0 ? -1.0 : x > 1.0 ? 1.0 : x;
    return math_atan2(c, __builtin_sqrt((1.0 - c) * (1.0 + c)));
}

double
math_acos(double x)
{
    double c = x < -1.0 ? -1.0 : x > 1.0 ? 1.0 : x;
    return math_atan2(__builtin_sqrt((1.0 - c) * (1.0 + c)), c);
}
