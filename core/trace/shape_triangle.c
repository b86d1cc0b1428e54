/* shape_triangle.c - record: cramer.h's 13 floats, then the geometric normal,
 * a flag (1: shading normals, 2: uvs, 3: both), three shading normals, three
 * uvs; all in the world. */
#include "core/scene/vec.h"
#include "core/trace/cramer.h"
#include "core/trace/flat.h"
#include "core/trace/shapes.h"

#define SHAPE(name)   triangle_##name
#define SHAPE_FLOATS  CRAMER_FLOATS
#define SHAPE_INVERTS 0

enum { NORMAL = 13, FLAG = 16, NORMALS = 17, UVS = 26, STRIDE = 32 };

/* The acceptance order of SCENE 6.4; all conditions are inclusive. */
static inline bool
triangle_hit(const float *s, const struct shape_rules *rules, float ox,
             float oy, float oz, float dx, float dy, float dz, float ix,
             float iy, float iz, float *t)
{
    (void)ix, (void)iy, (void)iz, (void)rules;
    struct cramer c = cramer_solve(s, ox, oy, oz, dx, dy, dz);
    float size = c.d0 < 0.0f ? -c.d0 : c.d0;
    float length = __builtin_sqrtf(dot3(dx, dy, dz, dx, dy, dz));
    *t = c.t;
    return (size > s[12] * length) & (c.t > 0.0f) & (c.u >= 0.0f) &
           (c.u <= 1.0f) & (c.v >= 0.0f) & (c.v <= 1.0f - c.u);
}

#include "core/trace/shape_lanes.h"

static bool
triangle_prepare(const struct scene_object *object, const struct shape_set *set,
                 float *record)
{
    const struct shape_triangle *s = &object->shape.triangle;
    double p[3][3], e1[3], e2[3];
    (void)set;
    for (int i = 0; i < 3; i++)
        flat_point(object, s->vertices[i], p[i]);
    for (int k = 0; k < 3; k++) {
        e1[k] = p[1][k] - p[0][k];
        e2[k] = p[2][k] - p[0][k];
    }
    cramer_record(p[0], e1, e2, record);
    flat_normal(object, e1, e2, record + NORMAL);
    record[FLAG] = (float)((s->has_normals ? 1 : 0) + (s->has_uvs ? 2 : 0));
    for (int i = 0; i < 3; i++) {
        if (s->has_normals)
            flat_direction(object, s->normals[i], record + NORMALS + 3 * i);
        for (int k = 0; k < 2; k++)
            record[UVS + 2 * i + k] = (float)s->uvs[i][k];
    }
    return true;
}

static void
triangle_bounds(const float *s, float lo[3], float hi[3])
{
    for (int k = 0; k < 3; k++) {
        float a = s[k], b = s[k] + s[3 + k], c = s[k] + s[6 + k];
        lo[k] = a < b ? a : b;
        lo[k] = lo[k] < c ? lo[k] : c;
        hi[k] = a > b ? a : b;
        hi[k] = hi[k] > c ? hi[k] : c;
    }
}

/* Weights of the second and third corner at surface i: from its point, which
 * lies in the plane of the record. */
static inline struct cramer
triangle_weights(const float *s, const struct surfaces *f, uint32_t i)
{
    /* Seen from the point itself along the normal, t is about 0. */
    return cramer_solve(s, f->p[0][i], f->p[1][i], f->p[2][i], s[9], s[10],
                        s[11]);
}

static void
triangle_surface(const struct shape_set *set, struct surfaces *f)
{
    flat_surface(set, f, SHAPE_TRIANGLE, STRIDE, NORMAL);
    for (uint32_t i = 0; i < f->count; i++) {
        if (f->kind[i] != SHAPE_TRIANGLE)
            continue;
        const float *s = set->records + (size_t)f->index[i] * STRIDE;
        if (((int)s[FLAG] & 1) == 0)
            continue;
        struct cramer c = triangle_weights(s, f, i);
        const float *n = s + NORMALS;
        float w = 1.0f - c.u - c.v, v[3];
        for (int k = 0; k < 3; k++)
            v[k] = w * n[k] + c.u * n[3 + k] + c.v * n[6 + k];
        struct vec3 u = vec_unit((struct vec3){v[0], v[1], v[2]});
        if (u.x == 0.0f && u.y == 0.0f && u.z == 0.0f)
            continue;
        f->n[0][i] = u.x;
        f->n[1][i] = u.y;
        f->n[2][i] = u.z;
    }
}

static void
triangle_uv(const struct shape_set *set, struct surfaces *f)
{
    for (uint32_t i = 0; i < f->count; i++) {
        if (f->kind[i] != SHAPE_TRIANGLE)
            continue;
        const float *s = set->records + (size_t)f->index[i] * STRIDE;
        struct cramer c = triangle_weights(s, f, i);
        f->uv[0][i] = c.u;
        f->uv[1][i] = c.v;
        if (((int)s[FLAG] & 2) == 0)
            continue;
        const float *q = s + UVS;
        float w = 1.0f - c.u - c.v;
        for (int k = 0; k < 2; k++)
            f->uv[k][i] = w * q[k] + c.u * q[2 + k] + c.v * q[4 + k];
    }
}

const struct shape_ops shape_triangle_ops = {
    .stride = STRIDE,
    .prepare = triangle_prepare,
    .bounds = triangle_bounds,
    .nearest = triangle_nearest,
    .any = triangle_any,
    .surface = triangle_surface,
    .uv = triangle_uv,
};
