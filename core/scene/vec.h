/* vec.h - three floats, and the one multiply-add.
 *
 * madd(a, b, c) = a * b + c. Contraction by the compiler is off everywhere, so
 * this is the only place that decides between one rounding and two (HOUSE 7):
 * it is fused where the ISA class has FMA, chosen with the kernel's class. */
#ifndef CORE_SCENE_VEC_H
#define CORE_SCENE_VEC_H

struct vec3 {
    float x, y, z;
};

struct rgb {
    float r, g, b;
};

#endif
