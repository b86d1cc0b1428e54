/* shape_sphere.c - record: center x y z, radius. */
#include "core/base/math.h"
#include "core/scene/vec.h"
#include "core/trace/shapes.h"

#define SHAPE(name)   sphere_##name
#define SHAPE_FLOATS  4
#define SHAPE_INVERTS 0

/* Roots by the distance of the center from the ray, which keeps its digits
 * where b^2 - 4ac loses them (Ray Tracing Gems, chapter 7), and the second
 * root from the product of both. */
static inline bool
sphere_hit(const float *s, const struct shape_rules *rules, float ox, float oy,
           float oz, float dx, float dy, float dz, float ix, float iy, float iz,
           float *t)
{
    (void)ix, (void)iy, (void)iz;
    float fx = ox - s[0], fy = oy - s[1], fz = oz - s[2];
    float r = s[3];
    float a = dot3(dx, dy, dz, dx, dy, dz);
    float inv_a = 1.0f / a;
    float b = -dot3(fx, fy, fz, dx, dy, dz);
    float m = b * inv_a;
    float gx = madd(m, dx, fx), gy = madd(m, dy, fy), gz = madd(m, dz, fz);
    float d = r * r - dot3(gx, gy, gz, gx, gy, gz);
    float c = dot3(fx, fy, fz, fx, fy, fz) - r * r;
    float root = __builtin_sqrtf((d > 0.0f ? d : 0.0f) * a);
    float q = b >= 0.0f ? b + root : b - root;
    float t_c = c / q, t_a = q * inv_a;
    float near = b >= 0.0f ? t_c : t_a;
    float far = b >= 0.0f ? t_a : t_c;
    bool use_far = rules->inside & !(near > 0.0f);
    *t = use_far ? far : near;
    return (d > 0.0f) & (*t > 0.0f);
}

#include "core/trace/shape_lanes.h"

static bool
sphere_prepare(const struct scene_object *object, const struct shape_set *set,
               float *record)
{
    const struct shape_sphere *s = &object->shape.sphere;
    const double *m = object->to_world;
    (void)set;
    double scale = 1.0, c[3] = {s->center[0], s->center[1], s->center[2]};
    bool world = true;
    if (object->transformed) {
        /* Only moved and evenly scaled: still a sphere of our own kind. */
        scale = m[0];
        world = scale > 0.0 && m[5] == scale && m[10] == scale && m[1] == 0.0 &&
                m[2] == 0.0 && m[4] == 0.0 && m[6] == 0.0 && m[8] == 0.0 &&
                m[9] == 0.0;
        if (!world)
            scale = 1.0;
    }
    for (int k = 0; k < 3; k++)
        record[k] =
            (float)(object->transformed && world ? scale * c[k] + m[4 * k + 3]
                                                 : c[k]);
    record[3] = (float)(scale * s->radius);
    return world;
}

static void
sphere_bounds(const float *s, float lo[3], float hi[3])
{
    for (int k = 0; k < 3; k++) {
        lo[k] = s[k] - s[3];
        hi[k] = s[k] + s[3];
    }
}

/* Back to the world for the few that a transform moved: normal and point. */
static void
sphere_surface_transformed(const struct shape_set *set, struct surfaces *s)
{
    for (uint32_t i = 0; i < s->count; i++) {
        if (s->kind[i] != SHAPE_SPHERE || set->transformed[s->index[i]] == 0)
            continue;
        const float *record = set->records + (size_t)s->index[i] * set->stride;
        const float *m = set->inverse + 12 * (size_t)s->index[i];
        float p[3], n[3];
        matrix_point(m, s->p[0][i], s->p[1][i], s->p[2][i], p);
        matrix_normal(m, p[0] - record[0], p[1] - record[1], p[2] - record[2],
                      n);
        struct vec3 u = vec_unit((struct vec3){n[0], n[1], n[2]});
        s->n[0][i] = s->g[0][i] = u.x;
        s->n[1][i] = s->g[1][i] = u.y;
        s->n[2][i] = s->g[2][i] = u.z;
    }
}

static void
sphere_surface(const struct shape_set *set, struct surfaces *s)
{
    const uint8_t *restrict transformed = set->transformed;
    uint32_t n = lanes_up(s->count);
    if (set->any_transformed)
        for (uint32_t i = 0; i < n; i++) /* a kind of its own, for now */
            s->kind[i] =
                s->kind[i] == SHAPE_SPHERE && transformed[s->index[i]] != 0
                    ? SHAPE_KIND_COUNT + SHAPE_SPHERE
                    : s->kind[i];
    surfaces_fetch(s, SHAPE_SPHERE, set->records, 4, 0, 4);
    for (uint32_t i = 0; i < n; i++) {
        bool mine = s->kind[i] == SHAPE_SPHERE;
        float px = s->p[0][i], py = s->p[1][i], pz = s->p[2][i];
        float cx = s->field[0][i], cy = s->field[1][i], cz = s->field[2][i];
        float r = s->field[3][i];
        float fx = px - cx, fy = py - cy, fz = pz - cz;
        float squared = dot3(fx, fy, fz, fx, fy, fz);
        float w = 1.0f / __builtin_sqrtf(squared > 0.0f ? squared : 1.0f);
        float nx = fx * w, ny = fy * w, nz = fz * w;
        s->n[0][i] = mine ? nx : s->n[0][i];
        s->n[1][i] = mine ? ny : s->n[1][i];
        s->n[2][i] = mine ? nz : s->n[2][i];
        s->g[0][i] = mine ? nx : s->g[0][i];
        s->g[1][i] = mine ? ny : s->g[1][i];
        s->g[2][i] = mine ? nz : s->g[2][i];
        /* Onto the sphere: the point's error then is that of one rounding. */
        s->p[0][i] = mine ? madd(r, nx, cx) : px;
        s->p[1][i] = mine ? madd(r, ny, cy) : py;
        s->p[2][i] = mine ? madd(r, nz, cz) : pz;
    }
    if (set->any_transformed) {
        LANE_LOOP
        for (uint32_t i = 0; i < n; i++)
            s->kind[i] = s->kind[i] == SHAPE_KIND_COUNT + SHAPE_SPHERE
                             ? SHAPE_SPHERE
                             : s->kind[i];
        sphere_surface_transformed(set, s);
    }
}

/* u = phi / 360 with phi = atan2(n.z, n.x) in 0 ... 360, v = 1/2 + asin(n.y) /
 * 180, of the normal in object space. */
static void
sphere_uv(const struct shape_set *set, struct surfaces *s)
{
    for (uint32_t i = 0; i < s->count; i++) {
        if (s->kind[i] != SHAPE_SPHERE)
            continue;
        float n[3] = {s->n[0][i], s->n[1][i], s->n[2][i]};
        uint32_t k = s->index[i];
        if (set->transformed[k] != 0) {
            const float *record = set->records + (size_t)k * set->stride;
            float p[3];
            matrix_point(set->inverse + 12 * (size_t)k, s->p[0][i], s->p[1][i],
                         s->p[2][i], p);
            struct vec3 u = vec_unit((struct vec3){
                p[0] - record[0], p[1] - record[1], p[2] - record[2]});
            n[0] = u.x;
            n[1] = u.y;
            n[2] = u.z;
        }
        float u = math_atan2f(n[2], n[0]) * 0.15915494f;
        s->uv[0][i] = u < 0.0f ? u + 1.0f : u;
        s->uv[1][i] = 0.5f + math_asinf(n[1]) * 0.31830989f;
    }
}

const struct shape_ops shape_sphere_ops = {
    .stride = 4,
    .prepare = sphere_prepare,
    .bounds = sphere_bounds,
    .nearest = sphere_nearest,
    .any = sphere_any,
    .surface = sphere_surface,
    .uv = sphere_uv,
};
