/* vec.h - three floats, and the one multiply-add.
 *
 * madd(a, b, c) = a * b + c. Contraction by the compiler is off everywhere, so
 * this is the only place that decides between one rounding and two (HOUSE 7):
 * it is fused where the translation unit's ISA class has FMA. */
#ifndef CORE_SCENE_VEC_H
#define CORE_SCENE_VEC_H

struct vec3 {
    float x, y, z;
};

struct rgb {
    float r, g, b;
};

static inline float
madd(float a, float b, float c)
{
#if defined(__FMA__)
    return __builtin_fmaf(a, b, c);
#else
    return a * b + c;
#endif
}

/* ax bx + ay by + az bz, the x product innermost. */
static inline float
dot3(float ax, float ay, float az, float bx, float by, float bz)
{
    return madd(az, bz, madd(ay, by, ax * bx));
}

static inline float
vec_dot(struct vec3 a, struct vec3 b)
{
    return dot3(a.x, a.y, a.z, b.x, b.y, b.z);
}

static inline struct vec3
vec_sub(struct vec3 a, struct vec3 b)
{
    struct vec3 r = {a.x - b.x, a.y - b.y, a.z - b.z};
    return r;
}

static inline struct vec3
vec_cross(struct vec3 a, struct vec3 b)
{
    struct vec3 r = {madd(a.y, b.z, -(a.z * b.y)), madd(a.z, b.x, -(a.x * b.z)),
                     madd(a.x, b.y, -(a.y * b.x))};
    return r;
}

/* a + s b */
static inline struct vec3
vec_madd(struct vec3 a, float s, struct vec3 b)
{
    struct vec3 r = {madd(s, b.x, a.x), madd(s, b.y, a.y), madd(s, b.z, a.z)};
    return r;
}

/* Unit length; zero and non-finite vectors give (0, 0, 0). */
static inline struct vec3
vec_unit(struct vec3 a)
{
    float squared = vec_dot(a, a);
    float s = 1.0f / __builtin_sqrtf(squared);
    int fine = squared > 0.0f && squared < 3.0e38f;
    s = fine ? s : 0.0f;
    struct vec3 r = {fine ? a.x * s : 0.0f, fine ? a.y * s : 0.0f,
                     fine ? a.z * s : 0.0f};
    return r;
}

#endif
