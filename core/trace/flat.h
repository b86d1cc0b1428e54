/* flat.h - what triangle and quad share: world space baked in, one normal. */
#ifndef CORE_TRACE_FLAT_H
#define CORE_TRACE_FLAT_H

#include <stdbool.h>
#include <stddef.h>

#include "core/scene/scene.h"
#include "core/trace/shapes.h"

static inline void
flat_point(const struct scene_object *object, const double p[3], double out[3])
{
    const double *m = object->to_world;
    for (int r = 0; r < 3; r++)
        out[r] = object->transformed ? m[4 * r] * p[0] + m[4 * r + 1] * p[1] +
                                           m[4 * r + 2] * p[2] + m[4 * r + 3]
                                     : p[r];
}

/* Cofactor matrix of the linear part (inverse transpose times determinant) and
 * the determinant. */
static inline double
flat_cofactors(const double *m, double c[3][3])
{
    for (int r = 0; r < 3; r++)
        for (int k = 0; k < 3; k++) {
            int r1 = (r + 1) % 3, r2 = (r + 2) % 3;
            int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
            c[r][k] = m[4 * r1 + k1] * m[4 * r2 + k2] -
                      m[4 * r1 + k2] * m[4 * r2 + k1];
        }
    return m[0] * c[0][0] + m[1] * c[0][1] + m[2] * c[0][2];
}

static inline void
flat_store_unit(const double n[3], float out[3])
{
    double len = __builtin_sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int k = 0; k < 3; k++)
        out[k] = len > 0.0 ? (float)(n[k] / len) : 0.0f;
}

/* A normal of object space, in the world. Not unit: the mean of several is only
 * right if all were stretched alike. */
static inline void
flat_direction(const struct scene_object *object, const double n[3],
               float out[3])
{
    double c[3][3], det = 1.0;
    if (object->transformed)
        det = flat_cofactors(object->to_world, c);
    for (int r = 0; r < 3; r++)
        out[r] =
            (float)(object->transformed
                        ? (c[r][0] * n[0] + c[r][1] * n[1] + c[r][2] * n[2]) /
                              det
                        : n[r]);
}

/* Of two edges in the world: their product, turned where the transform
 * mirrors, so that it is the inverse transpose of the object's normal. */
static inline void
flat_normal(const struct scene_object *object, const double a[3],
            const double b[3], float out[3])
{
    double n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                   a[0] * b[1] - a[1] * b[0]};
    double c[3][3];
    if (object->transformed && flat_cofactors(object->to_world, c) < 0.0)
        for (int k = 0; k < 3; k++)
            n[k] = -n[k];
    flat_store_unit(n, out);
}

/* Both normals of the entries of `kind` from the record at `offset`. */
static inline void
flat_surface(const struct shape_set *set, struct surfaces *f, uint32_t kind,
             uint32_t stride, int32_t offset)
{
    uint32_t n = lanes_up(f->count);
    surfaces_fetch(f, kind, set->records, stride, offset, 3);
    for (uint32_t i = 0; i < n; i++) {
        bool mine = f->kind[i] == kind;
        float nx = f->field[0][i], ny = f->field[1][i], nz = f->field[2][i];
        f->n[0][i] = mine ? nx : f->n[0][i];
        f->n[1][i] = mine ? ny : f->n[1][i];
        f->n[2][i] = mine ? nz : f->n[2][i];
        f->g[0][i] = mine ? nx : f->g[0][i];
        f->g[1][i] = mine ? ny : f->g[1][i];
        f->g[2][i] = mine ? nz : f->g[2][i];
    }
}

#endif
