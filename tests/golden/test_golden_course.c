/* test_golden_course.c - the lecture's three table scenes, pixel by pixel.
 *
 * course-golden.json holds numbers computed in double precision from the
 * formulas of SCENE.md, with tolerances. Given the example scenes as they are
 * shipped, when they are rendered by every kernel of this machine with 0, 2 and
 * 4 bounces, then colour, depth, normal and object of each pixel agree. */
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
#include "core/base/json.h"
#include "core/scene/scene_json.h"
#include "core/trace/kernel.h"
#include "core/trace/render.h"

static struct arena arena;
static const struct json *golden;

static char *
read_whole(const char *relative, size_t *len)
{
    const char *source = getenv("GLINT_SOURCE");
    char *path =
        arena_printf(&arena, "%s/%s", source != NULL ? source : ".", relative);
    FILE *f = fopen(path, "rb");
    if (f == NULL)
        fail_msg("cannot open %s", path);
    fseek(f, 0, SEEK_END);
    *len = (size_t)ftell(f);
    rewind(f);
    char *text = arena_alloc(&arena, *len + 1);
    assert_int_equal(fread(text, 1, *len, f), *len);
    fclose(f);
    return text;
}

static int
setup(void **state)
{
    struct error_list errors = {.arena = &arena};
    size_t len;
    (void)state;
    arena_init(&arena, 0);
    char *text = read_whole("tests/golden/course-golden.json", &len);
    golden = json_read(text, len, NULL, &arena, &errors);
    return golden == NULL;
}

static int
teardown(void **state)
{
    (void)state;
    arena_clear(&arena);
    return 0;
}

static void
read_scene(const char *name, uint32_t bounces, struct scene *scene)
{
    struct error_list *errors = arena_alloc(&arena, sizeof *errors);
    struct scene_limits limits = {0};
    size_t len;
    char *text = read_whole(
        arena_printf(&arena, "schemas/examples/%s.json", name), &len);
    errors->arena = &arena;
    if (!scene_read_text(text, len, &limits, &arena, scene, errors))
        fail_msg("%s: %s", name, errors->items[0].detail);
    scene->integrator.max_bounces = bounces;
}

static void
render(const struct scene *scene, enum isa_level isa, struct film *film)
{
    struct render_options options = {.threads = 2, .isa = isa};
    struct error err = {0};
    if (!film_init(film, scene->width, scene->height, (1u << LAYER_COUNT) - 1,
                   &err) ||
        !render_run(scene, &options, film, NULL, &err))
        fail_msg("%s", err.text);
}

static double
tolerance(const char *name)
{
    return json_member(json_member(golden, "tolerance"), name)->number;
}

static void
expect_near(const char *what, const struct json *pixel, double got, double want,
            double within)
{
    if (!(fabs(got - want) <= within))
        fail_msg("pixel %g, %g: %s is %.9g, wanted %.9g within %g",
                 json_member(pixel, "pixel")->child->number,
                 json_member(pixel, "pixel")->child->next->number, what, got,
                 want, within);
}

/* Depth, normal and object of one pixel. */
static void
check_hit(const struct json *pixel, size_t p, const struct scene *scene,
          const struct film *film)
{
    double depth = film->layers[LAYER_DEPTH][p];
    uint32_t id = (uint32_t)film->layers[LAYER_OBJECT_ID][p];
    if (json_member(pixel, "hit")->type != JSON_TRUE) {
        assert_true(isinf(depth));
        assert_int_equal(id, 0);
        return;
    }
    double t = json_member(pixel, "t")->number;
    expect_near("t", pixel, depth, t, t * tolerance("t_relative"));
    assert_in_range(id, 1, scene->object_count);
    assert_string_equal(scene->objects[id - 1].name,
                        json_member(pixel, "object")->string);
    const struct json *n = json_member(pixel, "normal")->child;
    for (size_t k = 0; k < 3; k++, n = n->next)
        expect_near("normal", pixel, film->layers[LAYER_NORMAL][3 * p + k],
                    n->number, tolerance("normal_absolute"));
}

static unsigned
check_pixels(const char *list, const char *key, uint32_t bounces,
             const struct scene *scene, const struct film *film)
{
    char depth[8];
    unsigned checked = 0;
    snprintf(depth, sizeof depth, "%u", (unsigned)bounces);
    for (const struct json *pixel = json_member(golden, list)->child;
         pixel != NULL; pixel = pixel->next) {
        const struct json *at = json_member(pixel, "pixel")->child;
        size_t p = (size_t)at->next->number * scene->width + (size_t)at->number;
        check_hit(pixel, p, scene, film);
        const struct json *rgb =
            json_member(json_member(json_member(pixel, "rgb"), key), depth);
        if (rgb == NULL)
            continue;
        size_t k = 0;
        for (const struct json *c = rgb->child; c != NULL; c = c->next, k++)
            expect_near("colour", pixel, film->layers[LAYER_BEAUTY][3 * p + k],
                        c->number, tolerance("rgb_absolute"));
        assert_int_equal(k, 3);
        checked++;
    }
    return checked;
}

static void
check_scene(const char *name, const char *key)
{
    static const enum isa_level levels[] = {ISA_V1, ISA_V3, ISA_V4};
    for (size_t l = 0; l < 3 && levels[l] <= isa_level(); l++)
        for (uint32_t bounces = 0; bounces <= 4; bounces += 2) {
            /* Every depth on the best kernel, the deepest on the others. */
            if (kernel_choose(levels[l]) != kernel_choose(isa_level()) &&
                bounces < 4)
                continue;
            struct scene scene;
            struct film film;
            read_scene(name, bounces, &scene);
            render(&scene, levels[l], &film);
            assert_true(check_pixels("pixels", key, bounces, &scene, &film) >
                        5);
            assert_true(check_pixels("penumbra", key, bounces, &scene, &film) >
                        1);
            film_clear(&film);
        }
}

static void
mean_of_hits(void **state)
{
    (void)state;
    check_scene("course-table-mean", "mean");
}

static void
fresnel_weights(void **state)
{
    (void)state;
    check_scene("course-table-fresnel", "fresnel_weighted");
}

static void
soft_shadows(void **state)
{
    (void)state;
    check_scene("course-table-soft", "soft");
}

/* The slide's loop in single precision loses or keeps its last row. */
static void
float32_loop(void **state)
{
    (void)state;
    const struct json *list = json_member(
        json_member(golden, "float32_loop_positions"), "rays_by_samples");
    assert_true(list->count >= 16);
    for (const struct json *row = list->child; row != NULL; row = row->next) {
        struct scene_light light = {.kind = LIGHT_AREA_GRID,
                                    .samples = (uint32_t)atoi(row->key),
                                    .half_size = 0.5,
                                    .loop_float32 = true};
        assert_int_equal(scene_light_positions(&light), row->number);
    }
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(mean_of_hits),
        cmocka_unit_test(fresnel_weights),
        cmocka_unit_test(soft_shadows),
        cmocka_unit_test(float32_loop),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
