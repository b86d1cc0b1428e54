/* test_hits.c - rays against shapes: analytic truths, ties, and that no way of
 * tracing (kernel, packet width, with or without BVH) shows in a result. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/base/isa.h"
#include "core/trace/kernel.h"
#include "scenes.h"

static const enum isa_level levels[] = {ISA_V1, ISA_V3, ISA_V4};
static const struct {
    enum accel_way way;
    unsigned width;
} ways[] = {{ACCEL_SMALL, 0},  {ACCEL_EMBREE, 1},  {ACCEL_EMBREE, 4},
            {ACCEL_EMBREE, 8}, {ACCEL_EMBREE, 16}, {ACCEL_AUTO, 0}};
enum { WAYS = sizeof ways / sizeof *ways };

/* What the rays met; surfaces too, by the batch's own stage. */
static struct rays rays;
static struct hits hits;

static void
ray_add(double ox, double oy, double oz, double dx, double dy, double dz)
{
    uint32_t i = rays.count++;
    assert_in_range(i, 0, BATCH_MAX - 1);
    rays.o[0][i] = (float)ox;
    rays.o[1][i] = (float)oy;
    rays.o[2][i] = (float)oz;
    rays.d[0][i] = (float)dx;
    rays.d[1][i] = (float)dy;
    rays.d[2][i] = (float)dz;
    rays.far[i] = INFINITY;
}

static void
ask_one(const struct kernel *kernel, const struct scene *scene,
        enum accel_way way, unsigned width, enum ray_kind kind,
        struct hits *out, struct rays *shadow)
{
    struct accel_options options = {.way = way, .width = width, .threads = 1};
    struct error err = {0};
    struct plan *plan = kernel->plan_build(scene, &options, &err);
    if (plan == NULL)
        fail_msg("%s", err.text);
    kernel->intersect(plan->accel, kind, &rays, out);
    *shadow = rays;
    kernel->occluded(plan->accel, shadow);
    kernel->plan_free(plan);
}

/* Fill `hits` and check that every kernel finds the same objects, and every way
 * of one kernel the same bits. */
static void
ask(struct built *built, enum ray_kind kind)
{
    static struct hits first, other;
    static struct rays first_shadow, shadow;
    for (size_t l = 0; l < 3 && levels[l] <= isa_level(); l++) {
        const struct kernel *kernel = kernel_choose(levels[l]);
        for (int w = 0; w < WAYS; w++) {
            struct hits *to = w == 0 ? &first : &other;
            ask_one(kernel, &built->scene, ways[w].way, ways[w].width, kind, to,
                    w == 0 ? &first_shadow : &shadow);
            for (uint32_t i = 0; w > 0 && i < rays.count; i++)
                if (memcmp(&to->t[i], &first.t[i], sizeof(float)) != 0 ||
                    to->object[i] != first.object[i] ||
                    to->primitive[i] != first.primitive[i] ||
                    (shadow.far[i] < 0) != (first_shadow.far[i] < 0))
                    fail_msg("level %d, way %d, width %u, ray %u: t %.9g "
                             "object %d triangle %u shadow %g, not t %.9g "
                             "object %d triangle %u shadow %g",
                             (int)levels[l], (int)ways[w].way, ways[w].width, i,
                             (double)to->t[i], (int)to->object[i],
                             to->primitive[i], (double)shadow.far[i],
                             (double)first.t[i], (int)first.object[i],
                             first.primitive[i], (double)first_shadow.far[i]);
        }
        if (l == 0)
            hits = first;
    }
}

static void
begin(struct built *built, uint32_t objects)
{
    built_start(built, objects);
    memset(&rays, 0, sizeof rays);
}

static void
expect_hit(uint32_t i, uint32_t object, double t)
{
    if (hits.object[i] != object ||
        !(fabs((double)hits.t[i] - t) <= 2e-6 * fmax(1, t)))
        fail_msg("ray %u: object %d at %.9g, wanted %d at %.9g", i,
                 (int)hits.object[i], (double)hits.t[i], (int)object, t);
}

static void
expect_miss(uint32_t i)
{
    if (hits.object[i] != OBJECT_NONE || !isinf(hits.t[i]))
        fail_msg("ray %u: object %d at %.9g, wanted nothing", i,
                 (int)hits.object[i], (double)hits.t[i]);
}

static void
sphere(void **state)
{
    struct built b;
    (void)state;
    begin(&b, 1);
    built_sphere(&b, 0, 0, 0, 0, 1);
    ray_add(0, 0, 5, 0, 0, -1);
    ray_add(0, 0, 0, 0, 0, -1);  /* from inside */
    ray_add(0, 0, -5, 0, 0, -1); /* behind */
    ray_add(-5, 1, 0, 1, 0, 0);  /* tangent: a miss */
    ray_add(0, 0, 5, 0, 0, -2);  /* t in units of the direction */
    ray_add(0, 0.6, 5, 0, 0, -1);
    ask(&b, RAYS_CAMERA);
    expect_hit(0, 0, 4);
    expect_hit(1, 0, 1);
    expect_miss(2);
    expect_miss(3);
    expect_hit(4, 0, 2);
    expect_hit(5, 0, 4.2);
    b.scene.integrator.inside_hits = false;
    ask(&b, RAYS_CAMERA);
    expect_hit(0, 0, 4);
    expect_miss(1);
    built_clear(&b);
}

static void
box(void **state)
{
    struct built b;
    (void)state;
    begin(&b, 1);
    built_box(&b, 0, -1, -2, -3, 1, 2, 3);
    ray_add(0, 0, 9, 0, 0, -1);
    ray_add(0, 0, 0, 0, 1, 0); /* from inside */
    ray_add(0, 0, 0, -1, -1, 0);
    ray_add(2, 0, 9, 0, 0, -1);  /* beside */
    ray_add(9, 0, 0, 1, 0, 0);   /* behind */
    ray_add(-1, 0, 9, 0, 0, -1); /* along a face: min counts, max does not */
    ray_add(1, 0, 9, 0, 0, -1);
    ask(&b, RAYS_BOUNCE);
    expect_hit(0, 0, 6);
    expect_hit(1, 0, 2);
    expect_hit(2, 0, 1);
    expect_miss(3);
    expect_miss(4);
    expect_hit(5, 0, 6);
    expect_miss(6);
    b.scene.integrator.inside_hits = false;
    ask(&b, RAYS_BOUNCE);
    expect_miss(1);
    expect_miss(2);
    built_clear(&b);
}

/* n.x = offset, as the lecture's code has it. */
static void
plane_sign(void **state)
{
    struct built b;
    (void)state;
    begin(&b, 2);
    built_plane(&b, 0, 0, 1, 0, 2);
    ray_add(0, 5, 0, 0, -1, 0);
    ray_add(0, 0, 0, 0, 1, 0);
    ray_add(0, 0, 0, 0, -1, 0);
    ray_add(0, 0, 0, 1, 0, 0); /* parallel */
    ray_add(0, 5, 0, 1, -1e-7, 0);
    ask(&b, RAYS_CAMERA);
    expect_hit(0, 0, 3);
    expect_hit(1, 0, 2);
    expect_miss(2);
    expect_miss(3);
    expect_hit(4, 0, 3e7);
    b.scene.integrator.accumulation = ACCUMULATION_MEAN;
    ask(&b, RAYS_CAMERA);
    expect_hit(0, 0, 3);
    expect_miss(4); /* the course's threshold */
    built_clear(&b);
}

static void
triangle_acceptance(void **state)
{
    struct built b;
    const double p[3] = {0, 0, 0}, q[3] = {1, 0, 0}, r[3] = {0, 1, 0};
    const double flat[3] = {2, 0, 0};
    (void)state;
    begin(&b, 2);
    built_triangle(&b, 0, p, q, r);
    built_triangle(&b, 0, p, q, flat); /* no area: never hit */
    ray_add(0.25, 0.25, 1, 0, 0, -1);
    ray_add(0, 0.5, 1, 0, 0, -1);     /* u = 0 */
    ray_add(0.5, 0, 1, 0, 0, -1);     /* v = 0 */
    ray_add(0.5, 0.5, 1, 0, 0, -1);   /* v = 1 - u */
    ray_add(0, 0, 1, 0, 0, -1);       /* corner */
    ray_add(1, 0, 1, 0, 0, -1);       /* corner */
    ray_add(0.25, 0.25, -1, 0, 0, 1); /* from behind: open */
    ray_add(0.51, 0.5, 1, 0, 0, -1);
    ray_add(-0.01, 0.5, 1, 0, 0, -1);
    ray_add(0.5, -0.01, 1, 0, 0, -1);
    ray_add(0.25, 0.25, 0, 0, 0, -1); /* t = 0 does not count */
    ray_add(0.25, 0.25, 1, 1, 0, 0);  /* parallel */
    ask(&b, RAYS_CAMERA);
    for (uint32_t i = 0; i < 7; i++)
        expect_hit(i, 0, 1);
    for (uint32_t i = 7; i < rays.count; i++)
        expect_miss(i);
    built_clear(&b);
}

static void
quad_edges_are_inclusive(void **state)
{
    struct built b;
    const double o[3] = {0, 0, 0}, u[3] = {2, 0, 0}, v[3] = {0, 4, 0};
    (void)state;
    begin(&b, 1);
    built_quad(&b, 0, o, u, v);
    for (int i = 0; i <= 4; i++) {
        ray_add(0.5 * i, 0, 3, 0, 0, -1);
        ray_add(0.5 * i, 4, 3, 0, 0, -1);
        ray_add(0, i, 3, 0, 0, -1);
        ray_add(2, i, 3, 0, 0, -1);
    }
    uint32_t inside = rays.count;
    ray_add(-0.001, 2, 3, 0, 0, -1);
    ray_add(2.001, 2, 3, 0, 0, -1);
    ray_add(1, -0.001, 3, 0, 0, -1);
    ray_add(1, 4.001, 3, 0, 0, -1);
    ask(&b, RAYS_CAMERA);
    for (uint32_t i = 0; i < inside; i++)
        expect_hit(i, 0, 3);
    for (uint32_t i = inside; i < rays.count; i++)
        expect_miss(i);
    built_clear(&b);
}

/* Of several surfaces at one distance the first object wins, whichever kind it
 * is. */
static void
ties_go_to_the_earlier_object(void **state)
{
    const double o[3] = {-1, -1, 1}, u[3] = {2, 0, 0}, v[3] = {0, 2, 0};
    const double a[3] = {-1, -1, 1}, c[3] = {3, -1, 1}, e[3] = {-1, 3, 1};
    (void)state;
    for (int start = 0; start < 4; start++) {
        struct built b;
        begin(&b, 24);
        for (int i = 0; i < 20; i++)
            switch ((start + i) % 4) {
            case 0: built_box(&b, 0, -1, -1, -1, 1, 1, 1); break;
            case 1: built_quad(&b, 0, o, u, v); break;
            case 2: built_triangle(&b, 0, a, c, e); break;
            default: built_plane(&b, 0, 0, 0, 1, 1);
            }
        for (int i = 0; i < 200; i++)
            ray_add(-0.9 + 0.009 * i, 0.3 - 0.004 * i, 5, 0, 0, -1);
        ask(&b, RAYS_CAMERA);
        for (uint32_t i = 0; i < rays.count; i++)
            expect_hit(i, 0, 4);
        built_clear(&b);
    }
}

static void
ties_in_meshes(void **state)
{
    struct built b;
    const float p[] = {-1, -1, 1, 3, -1, 1, -1, 3, 1};
    const uint32_t index[] = {0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2,
                              0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2};
    (void)state;
    begin(&b, 8);
    built_plane(&b, 0, 0, 0, 1, -7);
    for (int i = 0; i < 5; i++)
        built_mesh(&b, 0, p, NULL, 3, index, 8);
    for (int i = 0; i < 300; i++)
        ray_add(-0.9 + 0.005 * i, 0.3 - 0.003 * i, 5, 0.01 * (i % 7), 0, -1);
    ask(&b, RAYS_CAMERA);
    for (uint32_t i = 0; i < rays.count; i++) {
        expect_hit(i, 1, 4);
        assert_int_equal(hits.primitive[i], 0);
    }
    built_clear(&b);
}

/* No ray from the middle of a closed mesh gets out, be it aimed exactly at an
 * edge. Of those aimed exactly at a corner Embree 3.13's robust mode loses
 * about one in 3 000 (docs/decisions); more would be a fault of ours. */
static void
mesh_is_watertight(void **state)
{
    enum { RINGS = 24, SIDES = 36 };
    struct built b;
    float p[(RINGS - 1) * SIDES * 3 + 6];
    uint32_t index[6 * RINGS * SIDES], used = 0;
    uint32_t top = (RINGS - 1) * SIDES, bottom = top + 1;
    unsigned lost = 0;
    struct dice d = {4};
    (void)state;
    for (uint32_t r = 0; r < RINGS - 1; r++)
        for (uint32_t s = 0; s < SIDES; s++) {
            double theta = M_PI * (r + 1) / RINGS, phi = 2 * M_PI * s / SIDES;
            double radius = 1 + 0.2 * sin(5 * theta) * cos(3 * phi);
            float *q = p + 3 * (r * SIDES + s);
            q[0] = (float)(radius * sin(theta) * cos(phi));
            q[1] = (float)(radius * cos(theta));
            q[2] = (float)(radius * sin(theta) * sin(phi));
        }
    const float poles[6] = {0, 1, 0, 0, -1, 0};
    memcpy(p + 3 * top, poles, sizeof poles);
    for (uint32_t s = 0; s < SIDES; s++) {
        uint32_t t = (s + 1) % SIDES, last = (RINGS - 2) * SIDES;
        const uint32_t caps[6] = {top, t, s, bottom, last + s, last + t};
        memcpy(index + used, caps, sizeof caps);
        used += 6;
        for (uint32_t r = 0; r < RINGS - 2; r++) {
            uint32_t i = r * SIDES;
            const uint32_t q[6] = {i + s, i + t,         i + SIDES + s,
                                   i + t, i + SIDES + t, i + SIDES + s};
            memcpy(index + used, q, sizeof q);
            used += 6;
        }
    }
    uint32_t triangles = used / 3;
    for (int round = 0; round < 12; round++) {
        begin(&b, 1);
        built_mesh(&b, 0, p, NULL, bottom + 1, index, triangles);
        double o[3] = {dice_range(&d, -0.2, 0.2), dice_range(&d, -0.2, 0.2),
                       dice_range(&d, -0.2, 0.2)};
        while (rays.count < BATCH_MAX) {
            const uint32_t *tri =
                index + 3 * (uint32_t)dice_range(&d, 0, triangles);
            double w = round % 3 == 0 ? 0 : dice_unit(&d), to[3];
            for (int k = 0; k < 3; k++)
                to[k] = (1 - w) * (double)p[3 * tri[0] + (uint32_t)k] +
                        w * (double)p[3 * tri[1] + (uint32_t)k] - o[k];
            if (round % 3 == 2)
                ray_add(o[0], o[1], o[2], dice_range(&d, -1, 1),
                        dice_range(&d, -1, 1), dice_range(&d, -1, 1));
            else
                ray_add(o[0], o[1], o[2], to[0], to[1], to[2]);
        }
        ask(&b, RAYS_BOUNCE);
        for (uint32_t i = 0; i < rays.count; i++)
            if (hits.object[i] != 0 && (round % 3 != 0 || ++lost > 8))
                fail_msg("round %d, ray %u from %.9g %.9g %.9g to %.9g %.9g "
                         "%.9g got out",
                         round, i, (double)rays.o[0][i], (double)rays.o[1][i],
                         (double)rays.o[2][i], (double)rays.d[0][i],
                         (double)rays.d[1][i], (double)rays.d[2][i]);
        built_clear(&b);
    }
}

/* ---- Transforms, against double precision ---- */

static bool
reference_sphere(const double o[3], const double d[3], double *t)
{
    double a = 0, b = 0, c = -1;
    for (int k = 0; k < 3; k++) {
        a += d[k] * d[k];
        b += o[k] * d[k];
        c += o[k] * o[k];
    }
    double disc = b * b - a * c;
    if (disc <= 1e-4 * a) /* near the silhouette floats may differ */
        return false;
    *t = (-b - sqrt(disc)) / a;
    if (*t <= 0)
        *t = (-b + sqrt(disc)) / a;
    return *t > 0;
}

static bool
reference_box(const double o[3], const double d[3], double *t)
{
    double near = -INFINITY, far = INFINITY;
    for (int k = 0; k < 3; k++) {
        double a = (-1 - o[k]) / d[k], b = (1 - o[k]) / d[k];
        near = fmax(near, fmin(a, b));
        far = fmin(far, fmax(a, b));
    }
    *t = near > 0 ? near : far;
    return near < far - 1e-3 && *t > 0;
}

static void
to_object(const double m[12], const double o[3], const double d[3],
          double object_o[3], double object_d[3])
{
    double c[3][3], det = 0;
    for (int r = 0; r < 3; r++)
        for (int k = 0; k < 3; k++) {
            int r1 = (r + 1) % 3, r2 = (r + 2) % 3;
            int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
            c[r][k] = m[4 * r1 + k1] * m[4 * r2 + k2] -
                      m[4 * r1 + k2] * m[4 * r2 + k1];
        }
    for (int k = 0; k < 3; k++)
        det += m[k] * c[0][k];
    for (int r = 0; r < 3; r++) {
        object_o[r] = object_d[r] = 0;
        for (int k = 0; k < 3; k++) {
            object_o[r] += c[k][r] / det * (o[k] - m[4 * k + 3]);
            object_d[r] += c[k][r] / det * d[k];
        }
    }
}

static void
transforms(void **state)
{
    static const double fixed[][12] = {
        {2, 0, 0, 1, 0, 2, 0, 0, 0, 0, 2, 0},     /* even scale */
        {3, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1, 1},   /* uneven */
        {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},    /* mirrored */
        {-2, 0, 0, 0, 0, -1, 0, 0.5, 0, 0, -3, 0} /* all negative */
    };
    struct dice dice = {6};
    (void)state;
    for (int kind = 0; kind < 2; kind++)
        for (int round = 0; round < 16; round++) {
            struct built b;
            double m[12];
            begin(&b, 1);
            for (int k = 0; k < 12; k++)
                m[k] = round < 4 ? fixed[round][k]
                                 : (k % 5 == 0) + dice_range(&dice, -0.6, 0.6);
            struct scene_object *object =
                kind == 0 ? built_sphere(&b, 0, 0, 0, 0, 1)
                          : built_box(&b, 0, -1, -1, -1, 1, 1, 1);
            built_transform(object, m);
            while (rays.count < BATCH_MAX)
                ray_add(dice_range(&dice, -4, 4), dice_range(&dice, -4, 4),
                        dice_range(&dice, -4, 4), dice_range(&dice, -1, 1),
                        dice_range(&dice, -1, 1), dice_range(&dice, -1, 1));
            ask(&b, RAYS_BOUNCE);
            unsigned met = 0;
            for (uint32_t i = 0; i < rays.count; i++) {
                double o[3], d[3], oo[3], od[3], t = 0;
                for (int k = 0; k < 3; k++) {
                    o[k] = (double)rays.o[k][i];
                    d[k] = (double)rays.d[k][i];
                }
                to_object(m, o, d, oo, od);
                bool want = kind == 0 ? reference_sphere(oo, od, &t)
                                      : reference_box(oo, od, &t);
                if (!want || t < 0.01)
                    continue;
                met++;
                if (hits.object[i] != 0 ||
                    fabs((double)hits.t[i] - t) > 2e-3 * fmax(1, t))
                    fail_msg("kind %d round %d ray %u: t %g, wanted %g", kind,
                             round, i, (double)hits.t[i], t);
            }
            assert_true(met > 10);
            built_clear(&b);
        }
}

/* ---- The batch as a whole ---- */

static void
visible_masks(void **state)
{
    static const enum ray_kind kinds[] = {RAYS_CAMERA, RAYS_BOUNCE};
    static const unsigned bits[] = {VISIBLE_CAMERA, VISIBLE_REFLECTION};
    const float p[] = {-1, -1, 1, 3, -1, 1, -1, 3, 1};
    const uint32_t index[] = {0, 1, 2};
    (void)state;
    for (unsigned visible = 0; visible < 8; visible++)
        for (int mesh = 0; mesh < 2; mesh++) {
            struct built b;
            begin(&b, 4);
            struct scene_object *o =
                mesh == 1 ? built_mesh(&b, 0, p, NULL, 3, index, 1)
                          : built_box(&b, 0, -1, -1, -1, 1, 1, 1);
            o->visible = visible;
            built_plane(&b, 0, 0, 0, 1, 1)->visible = visible;
            ray_add(0, 0, 5, 0, 0, -1);
            for (int k = 0; k < 2; k++) {
                ask(&b, kinds[k]);
                if ((visible & bits[k]) != 0)
                    expect_hit(0, 0, 4);
                else
                    expect_miss(0);
            }
            struct rays shadow;
            struct hits unused;
            ask_one(kernel_choose(isa_level()), &b.scene, ACCEL_AUTO, 0,
                    RAYS_CAMERA, &unused, &shadow);
            assert_true((shadow.far[0] < 0) ==
                        ((visible & VISIBLE_SHADOW) != 0));
            built_clear(&b);
        }
}

static void
shadow_rays_stop_at_the_light(void **state)
{
    struct built b;
    (void)state;
    begin(&b, 40);
    for (int i = 0; i < 30; i++)
        built_sphere(&b, 0, 3 * i, 0, 0, 1);
    ray_add(0, 0, 5, 0, 0, -1);
    ray_add(0, 0, 5, 0, 0, -1);
    ray_add(0, 5, 0, 0, 1, 0);
    rays.far[0] = 4.5f;
    rays.far[1] = 3.5f;
    struct rays shadow;
    struct hits unused;
    for (size_t l = 0; l < 3 && levels[l] <= isa_level(); l++)
        for (int w = 0; w < WAYS; w++) {
            ask_one(kernel_choose(levels[l]), &b.scene, ways[w].way,
                    ways[w].width, RAYS_CAMERA, &unused, &shadow);
            assert_true(shadow.far[0] < 0);
            assert_true(shadow.far[1] > 0);
            assert_true(shadow.far[2] > 0);
        }
    built_clear(&b);
}

/* Not one of these may reach Embree, which would abort. */
static void
rays_that_are_not_finite_miss(void **state)
{
    static const double bad[] = {NAN, INFINITY, -INFINITY, 1e30, 3e38};
    const float p[] = {-1, -1, 1, 3, -1, 1, -1, 3, 1};
    const uint32_t index[] = {0, 1, 2};
    struct built b;
    (void)state;
    begin(&b, 64);
    for (int i = 0; i < 30; i++)
        built_box(&b, 0, -1, -1, i, 1, 1, i + 1);
    built_sphere(&b, 0, 0, 0, 0, 1e6);
    built_plane(&b, 0, 0, 0, 1, -2);
    built_mesh(&b, 0, p, NULL, 3, index, 1);
    for (int k = 0; k < 6; k++)
        for (int i = 0; i < 5; i++) {
            double r[6] = {0, 0, 50, 0.01, 0.02, -1};
            r[k] = bad[i];
            ray_add(r[0], r[1], r[2], r[3], r[4], r[5]);
        }
    uint32_t count = rays.count;
    ray_add(0, 0, 50, 0.01, 0.002, -1);
    ask(&b, RAYS_CAMERA);
    for (uint32_t i = 0; i < count; i++)
        expect_miss(i);
    expect_hit(count, 29, 20.0);
    struct rays shadow;
    struct hits unused;
    ask_one(kernel_choose(isa_level()), &b.scene, ACCEL_AUTO, 0, RAYS_CAMERA,
            &unused, &shadow);
    for (uint32_t i = 0; i < count; i++)
        assert_true(shadow.far[i] >= 0);
    built_clear(&b);
}

/* Random scenes with random rays: ask() compares all ways. */
static void
ways_agree_on_random_scenes(void **state)
{
    struct dice d = {11};
    (void)state;
    for (uint64_t seed = 0; seed < 40; seed++) {
        struct built b;
        memset(&rays, 0, sizeof rays);
        built_random(&b, seed, 1 + (uint32_t)seed);
        while (rays.count < BATCH_MAX - 5)
            ray_add(dice_range(&d, -4, 4), dice_range(&d, -4, 4),
                    dice_range(&d, -4, 4), dice_range(&d, -1, 1),
                    dice_range(&d, -1, 1), dice_range(&d, -1, 1));
        ask(&b, seed % 2 == 0 ? RAYS_CAMERA : RAYS_BOUNCE);
        built_clear(&b);
    }
}

static void
huge_coordinates(void **state)
{
    struct built b;
    struct dice d = {12};
    (void)state;
    begin(&b, 40);
    for (int i = 0; i < 12; i++) {
        built_sphere(&b, 0, dice_range(&d, -1e6, 1e6),
                     dice_range(&d, -1e6, 1e6), dice_range(&d, -1e6, 1e6),
                     dice_range(&d, 1e-6, 1e6));
        double x = dice_range(&d, -1e6, 9e5);
        built_box(&b, 0, x, -1e6, -1e6, x + 1e-6 + 1e5 * dice_unit(&d), 1e6,
                  1e6);
        built_plane(&b, 0, 1, dice_unit(&d), 0, dice_range(&d, -1e6, 1e6));
    }
    struct accel_options options = {.way = ACCEL_EMBREE};
    struct error err = {0};
    const struct kernel *kernel = kernel_choose(isa_level());
    struct plan *plan = kernel->plan_build(&b.scene, &options, &err);
    assert_non_null(plan);
    while (rays.count < BATCH_MAX)
        ray_add(dice_range(&d, -1e6, 1e6), dice_range(&d, -1e6, 1e6),
                dice_range(&d, -1e6, 1e6), dice_range(&d, -1, 1),
                dice_range(&d, -1, 1), dice_range(&d, -1, 1));
    kernel->intersect(plan->accel, RAYS_CAMERA, &rays, &hits);
    for (uint32_t i = 0; i < rays.count; i++)
        assert_true(hits.t[i] > 0 &&
                    (hits.t[i] < INFINITY) == (hits.object[i] != OBJECT_NONE));
    kernel->plan_free(plan);
    built_clear(&b);
}

static bool
refuse(void *user)
{
    (void)user;
    return false;
}

static void
builds_stop_when_told_or_out_of_memory(void **state)
{
    struct built b;
    (void)state;
    built_sphereflake(&b, 4, 64);
    const struct kernel *kernel = kernel_choose(isa_level());
    struct accel_options canceled = {.go_on = refuse};
    struct error err = {0};
    assert_null(kernel->plan_build(&b.scene, &canceled, &err));
    assert_int_equal(err.code, ERROR_CANCELED);
    struct accel_options poor = {.memory_max = 400000};
    err = (struct error){0};
    assert_null(kernel->plan_build(&b.scene, &poor, &err));
    assert_int_equal(err.code, ERROR_MEMORY);
    built_clear(&b);
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sphere),
        cmocka_unit_test(box),
        cmocka_unit_test(plane_sign),
        cmocka_unit_test(triangle_acceptance),
        cmocka_unit_test(quad_edges_are_inclusive),
        cmocka_unit_test(ties_go_to_the_earlier_object),
        cmocka_unit_test(ties_in_meshes),
        cmocka_unit_test(mesh_is_watertight),
        cmocka_unit_test(transforms),
        cmocka_unit_test(visible_masks),
        cmocka_unit_test(shadow_rays_stop_at_the_light),
        cmocka_unit_test(rays_that_are_not_finite_miss),
        cmocka_unit_test(ways_agree_on_random_scenes),
        cmocka_unit_test(huge_coordinates),
        cmocka_unit_test(builds_stop_when_told_or_out_of_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
