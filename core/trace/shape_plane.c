/* shape_plane.c - record: normal x y z, offset (n.x = offset, in the world),
 * the largest coordinate of the object's own normal (0, 1, 2), 3 unused. */
#include "core/scene/vec.h"
#include "core/trace/flat.h"
#include "core/trace/shapes.h"

#define SHAPE(name)   plane_##name
#define SHAPE_FLOATS  4
#define SHAPE_INVERTS 0

static inline bool
plane_hit(const float *s, const struct shape_rules *rules, float ox, float oy,
          float oz, float dx, float dy, float dz, float ix, float iy, float iz,
          float *t)
{
    (void)ix, (void)iy, (void)iz;
    float across = dot3(s[0], s[1], s[2], dx, dy, dz);
    float size = across < 0.0f ? -across : across;
    *t = (s[3] - dot3(s[0], s[1], s[2], ox, oy, oz)) / across;
    return (size >= rules->plane_parallel) & (*t > 0.0f) & (*t < 3.0e38f);
}

#include "core/trace/shape_lanes.h"

/* With x' = Mx + b and w = M^-T n: n.x = offset becomes w.x' = offset + w.b,
 * which is then divided by the length of w. */
static bool
plane_prepare(const struct scene_object *object, const struct shape_set *set,
              float *record)
{
    const struct shape_plane *s = &object->shape.plane;
    double n[3] = {s->normal[0], s->normal[1], s->normal[2]};
    double offset = s->offset;
    if (object->transformed) {
        const double *m = object->to_world;
        double c[3][3], w[3];
        double det = flat_cofactors(m, c);
        for (int r = 0; r < 3; r++)
            w[r] = (c[r][0] * n[0] + c[r][1] * n[1] + c[r][2] * n[2]) / det;
        double len = __builtin_sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
        offset = (offset + w[0] * m[3] + w[1] * m[7] + w[2] * m[11]) / len;
        for (int r = 0; r < 3; r++)
            n[r] = w[r] / len;
    }
    (void)set;
    for (int k = 0; k < 3; k++)
        record[k] = (float)n[k];
    record[3] = (float)offset;
    int largest = 0;
    for (int k = 1; k < 3; k++)
        if (__builtin_fabs(s->normal[k]) > __builtin_fabs(s->normal[largest]))
            largest = k;
    record[4] = (float)largest;
    return true;
}

static void
plane_surface(const struct shape_set *set, struct surfaces *s)
{
    uint32_t n = lanes_up(s->count);
    surfaces_fetch(s, SHAPE_PLANE, set->records, 8, 0, 3);
    for (uint32_t i = 0; i < n; i++) {
        bool mine = s->kind[i] == SHAPE_PLANE;
        float nx = s->field[0][i], ny = s->field[1][i], nz = s->field[2][i];
        s->n[0][i] = mine ? nx : s->n[0][i];
        s->n[1][i] = mine ? ny : s->n[1][i];
        s->n[2][i] = mine ? nz : s->n[2][i];
        s->g[0][i] = mine ? nx : s->g[0][i];
        s->g[1][i] = mine ? ny : s->g[1][i];
        s->g[2][i] = mine ? nz : s->g[2][i];
    }
}

/* The two coordinates other than the normal's largest, of the object's own
 * space. */
static void
plane_uv(const struct shape_set *set, struct surfaces *s)
{
    for (uint32_t i = 0; i < s->count; i++) {
        if (s->kind[i] != SHAPE_PLANE)
            continue;
        size_t k = s->index[i];
        float p[3] = {s->p[0][i], s->p[1][i], s->p[2][i]};
        if (set->inverse != NULL)
            matrix_point(set->inverse + 12 * k, s->p[0][i], s->p[1][i],
                         s->p[2][i], p);
        int largest = (int)set->records[8 * k + 4];
        s->uv[0][i] = largest == 0 ? p[1] : p[0];
        s->uv[1][i] = largest == 2 ? p[1] : p[2];
    }
}

const struct shape_ops shape_plane_ops = {
    .stride = 8,
    .prepare = plane_prepare,
    .bounds = NULL,
    .nearest = plane_nearest,
    .any = plane_any,
    .surface = plane_surface,
    .uv = plane_uv,
};
