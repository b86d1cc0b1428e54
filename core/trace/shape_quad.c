/* shape_quad.c - record: cramer.h's 13 floats, then the geometric normal; in
 * the world. Edges are inclusive. */
#include "core/scene/vec.h"
#include "core/trace/cramer.h"
#include "core/trace/flat.h"
#include "core/trace/shapes.h"

#define SHAPE(name)   quad_##name
#define SHAPE_FLOATS  CRAMER_FLOATS
#define SHAPE_INVERTS 0

enum { NORMAL = 13, STRIDE = 16 };

static inline bool
quad_hit(const float *s, const struct shape_rules *rules, float ox, float oy,
         float oz, float dx, float dy, float dz, float ix, float iy, float iz,
         float *t)
{
    (void)ix, (void)iy, (void)iz, (void)rules;
    struct cramer c = cramer_solve(s, ox, oy, oz, dx, dy, dz);
    float size = c.d0 < 0.0f ? -c.d0 : c.d0;
    float length = __builtin_sqrtf(dot3(dx, dy, dz, dx, dy, dz));
    *t = c.t;
    return (size > s[12] * length) & (c.t > 0.0f) & (c.u >= 0.0f) &
           (c.u <= 1.0f) & (c.v >= 0.0f) & (c.v <= 1.0f);
}

#include "core/trace/shape_lanes.h"

static bool
quad_prepare(const struct scene_object *object, const struct shape_set *set,
             float *record)
{
    const struct shape_quad *s = &object->shape.quad;
    double p[3], a[3], b[3], e1[3], e2[3];
    (void)set;
    for (int k = 0; k < 3; k++) {
        a[k] = s->origin[k] + s->edge_u[k];
        b[k] = s->origin[k] + s->edge_v[k];
    }
    flat_point(object, s->origin, p);
    flat_point(object, a, e1);
    flat_point(object, b, e2);
    for (int k = 0; k < 3; k++) {
        e1[k] -= p[k];
        e2[k] -= p[k];
    }
    cramer_record(p, e1, e2, record);
    flat_normal(object, e1, e2, record + NORMAL);
    return true;
}

static void
quad_bounds(const float *s, float lo[3], float hi[3])
{
    for (int k = 0; k < 3; k++) {
        float u = s[3 + k], v = s[6 + k];
        lo[k] = s[k] + (u < 0.0f ? u : 0.0f) + (v < 0.0f ? v : 0.0f);
        hi[k] = s[k] + (u > 0.0f ? u : 0.0f) + (v > 0.0f ? v : 0.0f);
    }
}

static void
quad_surface(const struct shape_set *set, struct surfaces *f)
{
    flat_surface(set, f, SHAPE_QUAD, STRIDE, NORMAL);
}

static void
quad_uv(const struct shape_set *set, struct surfaces *f)
{
    for (uint32_t i = 0; i < f->count; i++) {
        if (f->kind[i] != SHAPE_QUAD)
            continue;
        const float *s = set->records + (size_t)f->index[i] * STRIDE;
        struct cramer c = cramer_solve(s, f->p[0][i], f->p[1][i], f->p[2][i],
                                       s[9], s[10], s[11]);
        f->uv[0][i] = c.u;
        f->uv[1][i] = c.v;
    }
}

const struct shape_ops shape_quad_ops = {
    .stride = STRIDE,
    .prepare = quad_prepare,
    .bounds = quad_bounds,
    .nearest = quad_nearest,
    .any = quad_any,
    .surface = quad_surface,
    .uv = quad_uv,
};
