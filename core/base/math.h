/* math.h - the functions that a libm would give, the same bits everywhere.
 *
 * Pixels must not depend on the machine's libm, so the core calls no libm
 * function but sqrt. Two families:
 *
 *   math_sin ...   double, for scene transforms, colour curves, preparation
 *   math_powf ...  float, inline and without branches, so that a loop over an
 *                  array becomes vector code
 *
 * No function rounds differently by ISA class: none uses a fused multiply-add.
 * Pure, any thread, nothing fails; NaN gives NaN unless stated. The bounds hold
 * for the whole stated range and are tested against libm. */
#ifndef CORE_BASE_MATH_H
#define CORE_BASE_MATH_H

#include <stdint.h>
#include <string.h>

#define MATH_PI 3.14159265358979323846

/* Sine and cosine of an angle in degrees, |deg| <= 1e9. The angle is reduced
 * exactly, so 90 degrees has cosine 0 and sine 1. At most 1 ulp. */
void
math_sincos_deg(double deg, double *sin, double *cos);

/* Radians, |x| <= 1e6. Absolute error 3e-16 * max(1, |x| / 8). */
double
math_sin(double x);
double
math_cos(double x);
/* math_sin / math_cos. */
double
math_tan(double x);

/* Any x; relative error 5e-16; overflows to infinity, underflows to 0. */
double
math_exp(double x);

/* x > 0: relative error 5e-16 (absolute near 1: 1e-16); 0 gives -infinity,
 * x < 0 NaN. */
double
math_log(double x);

/* x >= 0. Relative error 4e-16 * (2 + |y ln x|). x^0 = 1 also for x = 0;
 * x < 0 gives NaN. */
double
math_pow(double x, double y);

/* Absolute error 5e-16. asin and acos take the nearest of [-1, 1]. */
double
math_asin(double x);
double
math_acos(double x);
double
math_atan2(double y, double x); /* (-pi, pi]; atan2(0, 0) is 0 */

static inline uint32_t
math_bits(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static inline float
math_float(uint32_t bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* Largest whole number <= x, exact. */
static inline float
math_floorf(float x)
{
#if defined(__SSE4_1__)
    return __builtin_floorf(x); /* one instruction, no call */
#else
    float small = x > -8388608.0f ? x : 0.0f;
    small = small < 8388608.0f ? small : 0.0f;
    float whole = (float)(int32_t)small;
    whole = whole - (whole > small ? 1.0f : 0.0f);
    float magnitude = math_float(math_bits(x) & 0x7fffffffu);
    return magnitude < 8388608.0f ? whole : x;
#endif
}

/* x > 0 and normal: |error| <= 3e-7 * max(|log2 x|, 2^-100). 0 and denormals:
 * -126 or less, finite. */
static inline float
math_log2f(float x)
{
    /* x = 2^k (1 + t), 1 + t in [sqrt(1/2), sqrt(2)); then the series of
     * 2 atanh(t / (2 + t)) / ln 2. */
    uint32_t bits = math_bits(x);
    int32_t k = (int32_t)(bits - 0x3f3504f3u) >> 23;
    float t = math_float(bits - ((uint32_t)k << 23)) - 1.0f;
    float s = t / (2.0f + t);
    float z = s * s;
    float p = 0.26230822f;
    p = p * z + 0.32059894f;
    p = p * z + 0.41219865f;
    p = p * z + 0.57707801f;
    p = p * z + 0.96179669f;
    p = p * z;
    /* The first term alone would round twice: 2/ln 2 = 2.8853901 = 2 + rest. */
    float low = 0.88539008f * s + p * s;
    return (float)k + (2.0f * s + low);
}

/* Relative error 2e-7 for -126 <= x < 128; below: 0; above: near 3.4e38. */
static inline float
math_exp2f(float x)
{
    float y = x > -127.0f ? x : -127.0f;
    y = y < 127.999f ? y : 127.999f;
    /* The nearest whole number: adding 1.5 * 2^23 rounds it. */
    float k = (y + 12582912.0f) - 12582912.0f;
    float f = y - k;
    float p = 1.5252734e-5f;
    p = p * f + 1.5403530e-4f;
    p = p * f + 1.3333558e-3f;
    p = p * f + 9.6181291e-3f;
    p = p * f + 5.5504109e-2f;
    p = p * f + 2.4022651e-1f;
    p = p * f + 6.9314718e-1f;
    p = p * f + 1.0f;
    /* Two factors, as 2^128 alone is no float. */
    int32_t half = (int32_t)k >> 1;
    int32_t rest = (int32_t)k - half;
    float r = p * math_float((uint32_t)(half + 127) << 23) *
              math_float((uint32_t)(rest + 127) << 23);
    return x < -126.0f ? 0.0f : r;
}

static inline float
math_expf(float x)
{
    return math_exp2f(x * 1.44269504f);
}

/* x >= 0, as the highlights need it. Relative error 3e-7 * (2 + |y log2 x|)
 * where the result is a normal float; x^0 = 1 also for x = 0; x < 0 as 0. */
static inline float
math_powf(float x, float y)
{
    float r = math_exp2f(y * math_log2f(x > 1.2e-38f ? x : 1.2e-38f));
    r = x > 1.2e-38f ? r : 0.0f;
    return y == 0.0f ? 1.0f : r;
}

/* |x| <= 1e4 radians: absolute error 3e-7 * max(1, |x|). */
static inline float
math_sin_quadrant(float x, int32_t add)
{
    float k = (x * 0.63661977f + 12582912.0f) - 12582912.0f;
    /* pi/2 in three parts: the first two have few bits, k times them is exact */
    float r = ((x - k * 1.5703125f) - k * 4.83751296e-4f) - k * 7.5497901e-8f;
    int32_t q = (int32_t)k + add;
    float z = r * r;
    float s = 2.7557319e-6f;
    s = s * z - 1.9841270e-4f;
    s = s * z + 8.3333333e-3f;
    s = s * z - 1.6666667e-1f;
    s = s * z * r + r;
    float c = -2.7557319e-7f;
    c = c * z + 2.4801587e-5f;
    c = c * z - 1.3888889e-3f;
    c = c * z + 4.1666667e-2f;
    c = c * z - 0.5f;
    c = c * z + 1.0f;
    float v = (q & 1) != 0 ? c : s;
    return (q & 2) != 0 ? -v : v;
}

static inline float
math_sinf(float x)
{
    return math_sin_quadrant(x, 0);
}

static inline float
math_cosf(float x)
{
    return math_sin_quadrant(x, 1);
}

/* (-pi, pi], absolute error 5e-7; atan2f(0, 0) is 0. */
static inline float
math_atan2f(float y, float x)
{
    float ax = math_float(math_bits(x) & 0x7fffffffu);
    float ay = math_float(math_bits(y) & 0x7fffffffu);
    float big = ax > ay ? ax : ay;
    float small = ax > ay ? ay : ax;
    float q = small / (big > 1e-37f ? big : 1e-37f);
    /* From tan 15 degrees on, turn by 30 degrees. */
    float turned = (q * 1.7320508f - 1.0f) / (q + 1.7320508f);
    float w = q > 0.26794919f ? turned : q;
    float z = w * w;
    float a = -0.090909091f;
    a = a * z + 0.11111111f;
    a = a * z - 0.14285714f;
    a = a * z + 0.2f;
    a = a * z - 0.33333333f;
    a = a * z * w + w;
    a = q > 0.26794919f ? a + 0.52359878f : a;
    a = ay > ax ? 1.5707963f - a : a;
    a = x < 0.0f ? 3.1415927f - a : a;
    return y < 0.0f ? -a : a;
}

/* Nearest of [-1, 1]; absolute error 5e-7. */
static inline float
math_asinf(float x)
{
    float c = x < -1.0f ? -1.0f : x;
    c = c > 1.0f ? 1.0f : c;
    return math_atan2f(c, __builtin_sqrtf((1.0f - c) * (1.0f + c)));
}

#endif
