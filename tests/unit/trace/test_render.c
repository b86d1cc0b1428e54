/* test_render.c - whole renders: threads never show, light adds up, cancel. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/base/clock.h"
#include "core/trace/render.h"
#include "scenes.h"

enum { ALL_LAYERS = (1 << LAYER_COUNT) - 1 };

static void
render(const struct scene *scene, unsigned threads, struct film *film)
{
    struct render_options options = {.threads = threads};
    struct error err = {0};
    if (!film_init(film, scene->width, scene->height, ALL_LAYERS, &err) ||
        !render_run(scene, &options, film, NULL, &err))
        fail_msg("%s", err.text);
}

static const float *
pixel(const struct film *film, enum layer layer, uint32_t x, uint32_t y)
{
    size_t channels = layer == LAYER_DEPTH || layer == LAYER_OBJECT_ID ? 1 : 3;
    return film->layers[layer] + channels * ((size_t)y * film->width + x);
}

static void
same_films(const struct film *a, const struct film *b)
{
    size_t pixels = (size_t)a->width * a->height;
    const size_t channels[LAYER_COUNT] = {3, 1, 3, 3, 1};
    for (int i = 0; i < LAYER_COUNT; i++)
        assert_memory_equal(a->layers[i], b->layers[i],
                            pixels * channels[i] * sizeof(float));
}

static void
threads_never_show(void **state)
{
    (void)state;
    for (int which = 0; which < 12; which++) {
        struct built b;
        struct film one, other;
        static const unsigned counts[] = {2, 7};
        if (which == 0)
            built_table(&b, ACCUMULATION_FRESNEL_WEIGHTED, 257, 131, 4);
        else if (which == 1)
            built_table(&b, ACCUMULATION_MEAN, 100, 300, 3);
        else if (which == 2)
            built_sphereflake(&b, 3, 200);
        else
            built_random(&b, (uint64_t)which, (uint32_t)which * 4);
        if (which > 2)
            built_size(&b, 100, 90);
        b.scene.sampler.kind = (enum sampler_kind)(which % 4);
        b.scene.sampler.spp = which % 4 == 0 ? 1 : 3;
        render(&b.scene, 1, &one);
        for (int t = 0; t < 2; t++) {
            render(&b.scene, counts[t], &other);
            same_films(&one, &other);
            film_clear(&other);
        }
        film_clear(&one);
        built_clear(&b);
    }
}

static void
seeds_and_samples_show(void **state)
{
    struct built b;
    struct film film[3];
    (void)state;
    built_table(&b, ACCUMULATION_MEAN, 64, 64, 1);
    b.scene.sampler.kind = SAMPLER_SOBOL;
    b.scene.sampler.spp = 2;
    render(&b.scene, 2, &film[0]);
    b.scene.sampler.seed = 1;
    render(&b.scene, 2, &film[1]);
    b.scene.sampler.spp = 4;
    render(&b.scene, 2, &film[2]);
    size_t bytes = 64 * 64 * 3 * sizeof(float);
    assert_memory_not_equal(film[0].layers[0], film[1].layers[0], bytes);
    assert_memory_not_equal(film[1].layers[0], film[2].layers[0], bytes);
    for (int i = 0; i < 3; i++)
        film_clear(&film[i]);
    built_clear(&b);
}

static void
expect_pixel(const struct film *film, enum layer layer, uint32_t x, uint32_t y,
             double r, double g, double b)
{
    const float *p = pixel(film, layer, x, y);
    if (!(fabs((double)p[0] - r) < 2e-5 && fabs((double)p[1] - g) < 2e-5 &&
          fabs((double)p[2] - b) < 2e-5))
        fail_msg("pixel %u, %u is %g %g %g, wanted %g %g %g", x, y,
                 (double)p[0], (double)p[1], (double)p[2], r, g, b);
}

/* An orthographic window from -2 to 2 over 4 x 4 pixels; rays along -z. */
static void
orthographic_camera_and_layers(void **state)
{
    struct built b;
    struct film film;
    (void)state;
    built_start(&b, 2);
    b.scene.width = b.scene.height = 4;
    b.scene.camera.kind = CAMERA_ORTHOGRAPHIC;
    b.scene.camera.left = b.scene.camera.bottom = -2;
    b.scene.camera.right = b.scene.camera.top = 2;
    built_sphere(&b, 0, 9, 9, 9, 1);
    built_box(&b, 0, 0, 0, -1, 2, 1, 1); /* right, just above the middle */
    render(&b.scene, 1, &film);
    for (uint32_t y = 0; y < 4; y++)
        for (uint32_t x = 0; x < 4; x++) {
            bool inside = x >= 2 && y == 1;
            assert_true(*pixel(&film, LAYER_OBJECT_ID, x, y) ==
                        (inside ? 2.0f : 0.0f));
            float depth = *pixel(&film, LAYER_DEPTH, x, y);
            assert_true(inside ? fabsf(depth - 4.0f) < 1e-5f : isinf(depth));
            expect_pixel(&film, LAYER_NORMAL, x, y, 0, 0, inside ? 1 : 0);
            double a = inside ? 0.8 : 0;
            expect_pixel(&film, LAYER_ALBEDO, x, y, a, a, a);
            a *= 0.1; /* ambient only */
            expect_pixel(&film, LAYER_BEAUTY, x, y, a, a, a);
        }
    film_clear(&film);
    built_clear(&b);
}

static void
gradient_background(void **state)
{
    struct built b;
    struct film film;
    (void)state;
    built_start(&b, 1);
    built_sphere(&b, 0, 100, 0, 0, 1);
    b.scene.background.kind = BACKGROUND_GRADIENT;
    b.scene.background.color[0] = 1;
    b.scene.background.top[2] = 2;
    built_size(&b, 1, 3);
    render(&b.scene, 1, &film);
    double y = 2.0 / 3.0 * tan(M_PI / 8);
    double up = 0.5 * (1 + y / sqrt(1 + y * y));
    expect_pixel(&film, LAYER_BEAUTY, 0, 0, 1 - up, 0, 2 * up);
    expect_pixel(&film, LAYER_BEAUTY, 0, 1, 0.5, 0, 1);
    expect_pixel(&film, LAYER_BEAUTY, 0, 2, up, 0, 2 * (1 - up));
    film_clear(&film);
    built_clear(&b);
}

/* Between two parallel mirrors of 0.5 with emission 1 each: 1 + 1/2 + 1/4 ...
 * up to the last bounce. */
static void
mirrors_add_up(void **state)
{
    const double black[3] = {0, 0, 0}, half[3] = {0.5, 0.5, 0.5};
    (void)state;
    for (uint32_t bounces = 0; bounces <= 12; bounces += 3) {
        struct built b;
        struct film film;
        built_start(&b, 2);
        int32_t m =
            built_material(&b, MATERIAL_BLINN_PHONG, black, black, 1, half);
        for (int k = 0; k < 3; k++)
            b.scene.materials[m].emission.color[k] = 1;
        built_plane(&b, m, 0, 0, 1, -1);
        built_plane(&b, m, 0, 0, -1, -9);
        b.scene.integrator.max_bounces = bounces;
        built_size(&b, 3, 3);
        render(&b.scene, 1, &film);
        double want = 2 * (1 - pow(0.5, bounces + 1));
        expect_pixel(&film, LAYER_BEAUTY, 1, 1, want, want, want);
        film_clear(&film);
        built_clear(&b);
    }
}

/* A mirror ray that leaves the scene brings the background. */
static void
mirror_shows_the_background(void **state)
{
    const double black[3] = {0, 0, 0}, tint[3] = {0.5, 0.25, 1};
    struct built b;
    struct film film;
    (void)state;
    built_start(&b, 1);
    int32_t m = built_material(&b, MATERIAL_MIRROR, black, black, 0, tint);
    built_plane(&b, m, 0, 0, 1, 0);
    for (int k = 0; k < 3; k++)
        b.scene.background.color[k] = 0.8;
    render(&b.scene, 1, &film);
    expect_pixel(&film, LAYER_BEAUTY, 30, 20, 0.4, 0.2, 0.8);
    film_clear(&film);
    b.scene.integrator.max_bounces = 0;
    render(&b.scene, 1, &film);
    expect_pixel(&film, LAYER_BEAUTY, 30, 20, 0, 0, 0);
    film_clear(&film);
    built_clear(&b);
}

/* A white wall facing a light of intensity 1: n.l, and ambient where something
 * stands between. Falloff divides by the squared distance. */
static void
shadows_and_falloff(void **state)
{
    static const enum shadows kinds[] = {SHADOWS_NONE, SHADOWS_HARD,
                                         SHADOWS_SOFT};
    (void)state;
    for (int s = 0; s < 3; s++)
        for (int blocked = 0; blocked < 2; blocked++)
            for (int falloff = 0; falloff < 2; falloff++) {
                struct built b;
                struct film film;
                built_start(&b, 2);
                built_size(&b, 1, 1);
                built_plane(&b, 0, 0, 0, 1, 0);
                struct scene_object *o = built_box(&b, 0, -1, -1, 1, 1, 1, 2);
                o->visible = VISIBLE_SHADOW | VISIBLE_REFLECTION;
                if (blocked == 0)
                    o->visible = VISIBLE_REFLECTION;
                uint32_t l = built_light(&b, LIGHT_POINT, 0, 0, 4, 1);
                b.scene.lights[l].inverse_square = falloff == 1;
                b.scene.integrator.shadows = kinds[s];
                render(&b.scene, 1, &film);
                double lit = blocked == 1 && s > 0 ? 0 : 0.8;
                double want = 0.08 + (falloff == 1 ? lit / 16 : lit);
                expect_pixel(&film, LAYER_BEAUTY, 0, 0, want, want, want);
                film_clear(&film);
                built_clear(&b);
            }
}

/* An area grid is as bright as its point where nothing is between, hard shadows
 * make it one, and half hidden it gives half. */
static void
area_grid_hides_by_halves(void **state)
{
    struct built b;
    struct film film;
    (void)state;
    built_start(&b, 2);
    built_size(&b, 1, 1);
    built_plane(&b, 0, 0, 1, 0, 0);
    const double eye[3] = {0, 3, 0.5}, target[3] = {0, 0, 0},
                 up[3] = {0, 0, -1};
    built_look(&b, eye, target, up, 10);
    struct scene_object *o = built_box(&b, 0, 0, 20, -9, 9, 21, 9);
    o->visible = VISIBLE_SHADOW;
    uint32_t l = built_light(&b, LIGHT_AREA_GRID, 0, 40, 0, 1);
    b.scene.lights[l].half_size = 1;
    render(&b.scene, 1, &film);
    double full = (double)*pixel(&film, LAYER_BEAUTY, 0, 0);
    assert_true(fabs(full - (0.08 + 0.4)) < 1e-3);
    film_clear(&film);
    b.scene.lights[l].position[0] = 0.5; /* the point itself is hidden */
    b.scene.integrator.shadows = SHADOWS_HARD;
    render(&b.scene, 1, &film);
    expect_pixel(&film, LAYER_BEAUTY, 0, 0, 0.08, 0.08, 0.08);
    film_clear(&film);
    built_clear(&b);
}

static void
textures_by_every_mapping(void **state)
{
    (void)state;
    for (int mapping = MAPPING_UV; mapping <= MAPPING_OBJECT_XYZ; mapping++)
        for (int kind = 0; kind < 6; kind++) {
            struct built b;
            struct film film;
            const double o[3] = {-2, -2, -0.3}, u[3] = {4, 0, 0},
                         v[3] = {0, 4, 0.1};
            const double e[3] = {2, -2, 0}, f[3] = {-2, 2, 0.2};
            const float p[] = {-2, -2, -0.3f, 2, -2, 0, -2, 2, 0.2f};
            const uint32_t index[] = {0, 1, 2};
            built_start(&b, 1);
            int32_t t = built_checker(&b, (enum mapping)mapping, 0, 1);
            for (int k = 0; k < 3; k++)
                b.scene.textures[t].scale[k] = 3.3;
            b.scene.materials[0].diffuse.texture = t;
            b.scene.materials[0].ambient.texture = t;
            struct scene_object *object =
                kind == 0   ? built_sphere(&b, 0, 0, 0, 0, 1.5)
                : kind == 1 ? built_box(&b, 0, -1, -1, -1, 1, 1, 1)
                : kind == 2 ? built_plane(&b, 0, 0.1, 0.2, 1, 0)
                : kind == 3 ? built_quad(&b, 0, o, u, v)
                : kind == 4 ? built_triangle(&b, 0, o, e, f)
                            : built_mesh(&b, 0, p, NULL, 3, index, 1);
            const double m[12] = {0.8, 0.3, 0, 0.1, -0.3, 0.8,
                                  0.2, 0,   0, 0,   0.9,  0.2};
            built_transform(object, m);
            render(&b.scene, 2, &film);
            /* Only the two colours, and both of them. */
            unsigned seen[2] = {0, 0};
            for (uint32_t y = 0; y < film.height; y++)
                for (uint32_t x = 0; x < film.width; x++) {
                    float a = *pixel(&film, LAYER_ALBEDO, x, y);
                    if (*pixel(&film, LAYER_OBJECT_ID, x, y) == 0)
                        continue;
                    assert_true(a == 0 || a == 1);
                    seen[a == 1]++;
                }
            if (seen[0] < 20 || seen[1] < 20)
                fail_msg("mapping %d, shape %d: %u dark, %u bright", mapping,
                         kind, seen[0], seen[1]);
            film_clear(&film);
            built_clear(&b);
        }
}

/* Object mapping moves with the object, world mapping does not. */
static void
object_mapping_follows_the_transform(void **state)
{
    struct film film[2];
    (void)state;
    for (int moved = 0; moved < 2; moved++) {
        struct built b;
        const double m[12] = {1, 0, 0, 7, 0, 1, 0, 0, 0, 0, 1, 3};
        const double eye[3] = {7, 2, 8}, target[3] = {7, 0, 3},
                     eye0[3] = {0, 2, 5}, target0[3] = {0, 0, 0},
                     up[3] = {0, 1, 0};
        built_start(&b, 1);
        b.scene.materials[0].diffuse.texture =
            built_checker(&b, MAPPING_OBJECT_XZ, 0, 1);
        struct scene_object *o =
            built_box(&b, 0, -1.9, -1, -1.9, 1.9, -0.45, 1.9);
        if (moved == 1) {
            built_transform(o, m);
            built_look(&b, eye, target, up, 45);
        } else {
            built_look(&b, eye0, target0, up, 45);
        }
        render(&b.scene, 1, &film[moved]);
        built_clear(&b);
    }
    unsigned differ = 0;
    for (size_t i = 0; i < (size_t)film[0].width * film[0].height * 3; i++)
        differ +=
            film[0].layers[LAYER_ALBEDO][i] != film[1].layers[LAYER_ALBEDO][i]
                ? 1
                : 0;
    assert_true(differ < 120); /* cell borders may round differently */
    film_clear(&film[0]);
    film_clear(&film[1]);
}

/* Shading normals of a mesh and of a triangle with normals: the barycentric
 * mean, by the inverse transpose. */
static void
smooth_normals(void **state)
{
    (void)state;
    for (int kind = 0; kind < 2; kind++) {
        struct built b;
        struct film film;
        const float p[] = {-9, -9, 0, 9, -9, 0, 0, 9, 0};
        const double s = sqrt(0.5);
        const float n[] = {(float)-s, 0, (float)s, (float)s, 0,
                           (float)s,  0, 0,        1};
        const uint32_t index[] = {0, 1, 2};
        const double m[12] = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 2, 0};
        built_start(&b, 1);
        struct scene_object *o;
        if (kind == 0) {
            o = built_mesh(&b, 0, p, n, 3, index, 1);
        } else {
            double v[3][3];
            for (int i = 0; i < 9; i++)
                v[i / 3][i % 3] = (double)p[i];
            o = built_triangle(&b, 0, v[0], v[1], v[2]);
            o->shape.triangle.has_normals = true;
            for (int i = 0; i < 9; i++)
                o->shape.triangle.normals[i / 3][i % 3] = (double)n[i];
        }
        built_transform(o, m);
        built_size(&b, 1, 1);
        render(&b.scene, 1, &film);
        /* The middle pixel is (0, 0): weights 1/4, 1/4, 1/2; x cancels. */
        expect_pixel(&film, LAYER_NORMAL, 0, 0, 0, 0, 1);
        film_clear(&film);
        const double eye[3] = {3, 0, 5}, target[3] = {3, 0, 0},
                     up[3] = {0, 1, 0};
        built_look(&b, eye, target, up, 45);
        render(&b.scene, 1, &film);
        /* (3, 0): y' = -y, so in object space also (3, 0): weights u = 1/4 +
         * 1/6, w = 1/4 - 1/6, third 1/2; z by the inverse of 2. */
        double x = s / 3, z = (0.5 * s + 0.5) / 2, len = hypot(x, z);
        expect_pixel(&film, LAYER_NORMAL, 0, 0, x / len, 0, z / len);
        film_clear(&film);
        built_clear(&b);
    }
}

/* A mirrored transform turns no normal inside out. */
static void
mirrored_normals_stay_outside(void **state)
{
    const double o[3] = {-2, -2, 0}, u[3] = {4, 0, 0}, v[3] = {0, 4, 0};
    const double m[12] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    const float p[] = {-9, -9, 0, 9, -9, 0, 0, 9, 0};
    const uint32_t index[] = {0, 1, 2};
    const double a[3] = {-9, -9, 0}, c[3] = {9, -9, 0}, e[3] = {0, 9, 0};
    (void)state;
    for (int kind = 0; kind < 6; kind++) {
        struct built b;
        struct film film;
        built_start(&b, 1);
        built_size(&b, 1, 1);
        struct scene_object *object =
            kind == 0   ? built_sphere(&b, 0, 0, 0, 0, 1.5)
            : kind == 1 ? built_box(&b, 0, -1, -1, -1, 1, 1, 1)
            : kind == 2 ? built_plane(&b, 0, 0, 0, 1, 0)
            : kind == 3 ? built_quad(&b, 0, o, u, v)
            : kind == 4 ? built_triangle(&b, 0, a, c, e)
                        : built_mesh(&b, 0, p, NULL, 3, index, 1);
        built_transform(object, m);
        render(&b.scene, 1, &film);
        expect_pixel(&film, LAYER_NORMAL, 0, 0, 0, 0, 1);
        film_clear(&film);
        built_clear(&b);
    }
}

/* Everything with everything: finite pixels, never negative. */
static void
random_scenes_stay_finite(void **state)
{
    (void)state;
    for (uint64_t seed = 100; seed < 160; seed++) {
        struct built b;
        struct film film;
        built_random(&b, seed, 2 + (uint32_t)seed % 40);
        struct scene_integrator *g = &b.scene.integrator;
        g->accumulation = (enum accumulation)(seed % 3);
        g->shadows = (enum shadows)(seed / 3 % 3);
        g->clamp_local = seed % 2 == 0 ? 0 : 1;
        g->fresnel_bias = (double)(seed % 5) / 5;
        g->fresnel_exponent = (double)(seed % 7);
        g->ray_offset = seed % 11 == 0 ? 0 : 1e-4;
        b.scene.sampler.kind = (enum sampler_kind)(seed / 9 % 4);
        b.scene.sampler.spp = b.scene.sampler.kind == SAMPLER_CENTER ? 1 : 2;
        if (seed % 8 == 0)
            b.scene.camera.kind = CAMERA_ORTHOGRAPHIC;
        built_size(&b, 45, 37);
        render(&b.scene, 2, &film);
        for (size_t i = 0; i < (size_t)45 * 37 * 3; i++) {
            float v = film.layers[LAYER_BEAUTY][i];
            if (!isfinite(v) || v < 0)
                fail_msg("seed %u: pixel value %g", (unsigned)seed, (double)v);
        }
        film_clear(&film);
        built_clear(&b);
    }
}

struct watched {
    unsigned calls, building;
    unsigned stop_after;
    uint32_t last_tiles;
    enum render_phase last_phase;
    uint64_t last_rays;
};

static enum render_verdict
watch(void *user, const struct render_progress *progress)
{
    struct watched *w = user;
    w->calls++;
    assert_true(progress->tiles_done <= progress->tiles_total);
    if (progress->phase == RENDER_BUILDING)
        w->building++;
    if (progress->phase == w->last_phase)
        assert_true(progress->tiles_done >= w->last_tiles);
    w->last_phase = progress->phase;
    w->last_tiles = progress->tiles_done;
    w->last_rays = progress->rays;
    return w->stop_after > 0 && w->calls >= w->stop_after ? RENDER_STOP
                                                          : RENDER_GO;
}

static void
progress_ends_with_everything(void **state)
{
    struct built b;
    struct film film;
    struct watched w = {0};
    struct render_options options = {
        .threads = 2, .on_progress = watch, .user = &w, .interval_ms = 5};
    struct render_stats stats;
    struct error err = {0};
    (void)state;
    built_table(&b, ACCUMULATION_MEAN, 640, 360, 4);
    assert_true(film_init(&film, 640, 360, 1u << LAYER_BEAUTY, &err));
    assert_true(render_run(&b.scene, &options, &film, &stats, &err));
    assert_true(w.building >= 1 && w.calls >= 2);
    assert_int_equal(w.last_phase, RENDER_TRACING);
    assert_int_equal(w.last_tiles, 20 * 12);
    uint64_t rays = 0;
    for (int k = 0; k < RAY_KIND_COUNT; k++)
        rays += stats.rays[k];
    assert_true(w.last_rays == rays);
    assert_true(stats.rays[RAYS_CAMERA] == 640 * 360);
    film_clear(&film);
    built_clear(&b);
}

static void
cancel_ends_soon(void **state)
{
    (void)state;
    for (unsigned after = 1; after <= 3; after++) {
        struct built b;
        struct film film;
        struct watched w = {.stop_after = after};
        struct render_options options = {
            .threads = 2, .on_progress = watch, .user = &w, .interval_ms = 5};
        struct error err = {0};
        const double eye[3] = {1, 20, 5}, target[3] = {1, 2, 5},
                     up[3] = {0, 0, -1};
        built_table(&b, ACCUMULATION_MEAN, 2048, 2048, 64);
        built_look(&b, eye, target, up, 45); /* every tile is dear */
        b.scene.sampler.kind = SAMPLER_SOBOL;
        b.scene.sampler.spp = 4096;
        assert_true(film_init(&film, 2048, 2048, 1u << LAYER_BEAUTY, &err));
        int64_t start = clock_monotonic_us();
        assert_false(render_run(&b.scene, &options, &film, NULL, &err));
        assert_int_equal(err.code, ERROR_CANCELED);
        /* Within a sample of the tiles under way, not after the tile. */
        assert_true(clock_monotonic_us() - start < 1500000);
        film_clear(&film);
        built_clear(&b);
    }
}

static void
crew_follows_threads_now(void **state)
{
    struct built b;
    struct film film, want;
    atomic_uint now = 0;
    struct render_options options = {.threads = 4, .threads_now = &now};
    struct error err = {0};
    (void)state;
    built_table(&b, ACCUMULATION_MEAN, 200, 200, 2);
    render(&b.scene, 1, &want);
    for (unsigned allowed = 0; allowed < 6; allowed++) {
        atomic_store(&now, allowed);
        assert_true(film_init(&film, 200, 200, ALL_LAYERS, &err));
        assert_true(render_run(&b.scene, &options, &film, NULL, &err));
        same_films(&want, &film);
        film_clear(&film);
    }
    film_clear(&want);
    built_clear(&b);
}

static void
films_that_cannot_be_held(void **state)
{
    struct film film;
    struct error err = {0};
    (void)state;
    assert_false(film_init(&film, 0, 10, 1, &err));
    assert_int_equal(err.code, ERROR_MEMORY);
    err = (struct error){0};
    assert_false(film_init(&film, UINT32_MAX, UINT32_MAX, 1, &err));
    assert_int_equal(err.code, ERROR_MEMORY);
    assert_null(film.layers[0]);
    assert_true(film_init(&film, 3, 2, 1u << LAYER_DEPTH, &err) ||
                err.code != ERROR_NONE);
    film_clear(&film);
    film_clear(&film); /* a cleared one too */
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(threads_never_show),
        cmocka_unit_test(seeds_and_samples_show),
        cmocka_unit_test(orthographic_camera_and_layers),
        cmocka_unit_test(gradient_background),
        cmocka_unit_test(mirrors_add_up),
        cmocka_unit_test(mirror_shows_the_background),
        cmocka_unit_test(shadows_and_falloff),
        cmocka_unit_test(area_grid_hides_by_halves),
        cmocka_unit_test(textures_by_every_mapping),
        cmocka_unit_test(object_mapping_follows_the_transform),
        cmocka_unit_test(smooth_normals),
        cmocka_unit_test(mirrored_normals_stay_outside),
        cmocka_unit_test(random_scenes_stay_finite),
        cmocka_unit_test(progress_ends_with_everything),
        cmocka_unit_test(cancel_ends_soon),
        cmocka_unit_test(crew_follows_threads_now),
        cmocka_unit_test(films_that_cannot_be_held),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
