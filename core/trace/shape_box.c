/* shape_box.c - record: min x y z, max x y z, 2 unused. */
#include "core/scene/vec.h"
#include "core/trace/shapes.h"

#define SHAPE(name)   box_##name
#define SHAPE_FLOATS  6
#define SHAPE_INVERTS 1

/* Slabs. Entry only with near > 0 unless exits count. */
static inline bool
box_hit(const float *b, const struct shape_rules *rules, float ox, float oy,
        float oz, float dx, float dy, float dz, float ix, float iy, float iz,
        float *t)
{
    (void)dx, (void)dy, (void)dz;
    float ax = (b[0] - ox) * ix, bx = (b[3] - ox) * ix;
    float ay = (b[1] - oy) * iy, by = (b[4] - oy) * iy;
    float az = (b[2] - oz) * iz, bz = (b[5] - oz) * iz;
    float lx = ax < bx ? ax : bx, hx = ax < bx ? bx : ax;
    float ly = ay < by ? ay : by, hy = ay < by ? by : ay;
    float lz = az < bz ? az : bz, hz = az < bz ? bz : az;
    float near = lx > ly ? lx : ly;
    near = near > lz ? near : lz;
    float far = hx < hy ? hx : hy;
    far = far < hz ? far : hz;
    bool use_far = rules->inside & !(near > 0.0f);
    *t = use_far ? far : near;
    return (near <= far) & (*t > 0.0f);
}

#include "core/trace/shape_lanes.h"

static bool
box_prepare(const struct scene_object *object, const struct shape_set *set,
            float *record)
{
    const struct shape_box *b = &object->shape.box;
    const double *m = object->to_world;
    (void)set;
    /* Moved and scaled along the axes it is still a box; a negative scale
     * would turn faces round, so it is left to the transform. */
    bool world =
        !object->transformed || (m[0] > 0.0 && m[5] > 0.0 && m[10] > 0.0 &&
                                 m[1] == 0.0 && m[2] == 0.0 && m[4] == 0.0 &&
                                 m[6] == 0.0 && m[8] == 0.0 && m[9] == 0.0);
    for (int k = 0; k < 3; k++) {
        double lo = b->min[k], hi = b->max[k];
        if (object->transformed && world) {
            lo = m[5 * k] * lo + m[4 * k + 3];
            hi = m[5 * k] * hi + m[4 * k + 3];
        }
        record[k] = (float)lo;
        record[3 + k] = (float)hi;
    }
    return world;
}

static void
box_bounds(const float *b, float lo[3], float hi[3])
{
    for (int k = 0; k < 3; k++) {
        lo[k] = b[k];
        hi[k] = b[3 + k];
    }
}

/* The course's rule: the first face, in this order, that p is within eps of;
 * else +z (SCENE 6.1). Otherwise the face that p is relatively nearest to.
 * *axis 0 ... 2; the sign of the normal is returned. */
static inline __attribute__((always_inline)) float
box_face(const float *b, const struct shape_rules *rules, float x, float y,
         float z, int *axis)
{
    float e = rules->face_epsilon;
    /* course, last rule first */
    int a = 2;
    float sign = 1.0f;
    bool at = y > b[4] - e;
    a = at ? 1 : a;
    at = y < b[1] + e;
    a = at ? 1 : a;
    sign = at ? -1.0f : sign;
    at = x > b[3] - e;
    a = at ? 0 : a;
    sign = at ? 1.0f : sign;
    at = x < b[0] + e;
    a = at ? 0 : a;
    sign = at ? -1.0f : sign;
    /* nearest */
    float qx = (2.0f * x - b[0] - b[3]) / (b[3] - b[0]);
    float qy = (2.0f * y - b[1] - b[4]) / (b[4] - b[1]);
    float qz = (2.0f * z - b[2] - b[5]) / (b[5] - b[2]);
    float mx = qx < 0.0f ? -qx : qx, my = qy < 0.0f ? -qy : qy;
    float mz = qz < 0.0f ? -qz : qz;
    bool yz = my >= mz;
    float m = yz ? my : mz;
    int na = yz ? 1 : 2;
    float q = yz ? qy : qz;
    bool first = mx >= m;
    na = first ? 0 : na;
    q = first ? qx : q;
    float nsign = q < 0.0f ? -1.0f : 1.0f;
    *axis = rules->course ? a : na;
    return rules->course ? sign : nsign;
}

static void
box_surface_transformed(const struct shape_set *set, struct surfaces *s)
{
    for (uint32_t i = 0; i < s->count; i++) {
        uint32_t k = s->index[i];
        if (s->kind[i] != SHAPE_BOX || set->transformed[k] == 0)
            continue;
        const float *m = set->inverse + 12 * (size_t)k;
        float p[3], n[3], face[3] = {0.0f, 0.0f, 0.0f};
        int axis;
        matrix_point(m, s->p[0][i], s->p[1][i], s->p[2][i], p);
        float sign = box_face(set->records + (size_t)k * set->stride,
                              &set->rules, p[0], p[1], p[2], &axis);
        face[axis] = sign;
        matrix_normal(m, face[0], face[1], face[2], n);
        struct vec3 u = vec_unit((struct vec3){n[0], n[1], n[2]});
        s->n[0][i] = s->g[0][i] = u.x;
        s->n[1][i] = s->g[1][i] = u.y;
        s->n[2][i] = s->g[2][i] = u.z;
    }
}

static void
box_surface(const struct shape_set *set, struct surfaces *s)
{
    struct shape_rules rules = set->rules;
    uint32_t n = lanes_up(s->count);
    surfaces_fetch(s, SHAPE_BOX, set->records, 8, 0, 6);
    for (uint32_t i = 0; i < n; i++) {
        bool mine = s->kind[i] == SHAPE_BOX;
        const float b[6] = {s->field[0][i], s->field[1][i], s->field[2][i],
                            s->field[3][i], s->field[4][i], s->field[5][i]};
        int axis;
        float sign =
            box_face(b, &rules, s->p[0][i], s->p[1][i], s->p[2][i], &axis);
        float nx = axis == 0 ? sign : 0.0f;
        float ny = axis == 1 ? sign : 0.0f;
        float nz = axis == 2 ? sign : 0.0f;
        s->n[0][i] = mine ? nx : s->n[0][i];
        s->n[1][i] = mine ? ny : s->n[1][i];
        s->n[2][i] = mine ? nz : s->n[2][i];
        s->g[0][i] = mine ? nx : s->g[0][i];
        s->g[1][i] = mine ? ny : s->g[1][i];
        s->g[2][i] = mine ? nz : s->g[2][i];
    }
    if (set->any_transformed)
        box_surface_transformed(set, s);
}

/* +-x: (z, y), +-y: (x, z), +-z: (x, y), scaled to 0 ... 1. */
static void
box_uv(const struct shape_set *set, struct surfaces *s)
{
    static const int order[3][2] = {{2, 1}, {0, 2}, {0, 1}};
    for (uint32_t i = 0; i < s->count; i++) {
        uint32_t k = s->index[i];
        if (s->kind[i] != SHAPE_BOX)
            continue;
        const float *b = set->records + (size_t)k * set->stride;
        float p[3] = {s->p[0][i], s->p[1][i], s->p[2][i]};
        int axis;
        if (set->transformed[k] != 0)
            matrix_point(set->inverse + 12 * (size_t)k, s->p[0][i], s->p[1][i],
                         s->p[2][i], p);
        box_face(b, &set->rules, p[0], p[1], p[2], &axis);
        for (int c = 0; c < 2; c++) {
            int a = order[axis][c];
            s->uv[c][i] = (p[a] - b[a]) / (b[3 + a] - b[a]);
        }
    }
}

const struct shape_ops shape_box_ops = {
    .stride = 8,
    .prepare = box_prepare,
    .bounds = box_bounds,
    .nearest = box_nearest,
    .any = box_any,
    .surface = box_surface,
    .uv = box_uv,
};
