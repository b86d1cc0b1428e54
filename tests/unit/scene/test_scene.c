/* What the reader makes of a document: frames, transforms, materials, meshes,
 * lights; and the small tools beneath. */

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/scene/angle.h"
#include "core/scene/scene_cost.h"
#include "core/scene/srgb.h"
#include "core/scene/transform.h"
#include "tests/unit/scene/documents.h"

static void
near(double got, double want, double tolerance)
{
    if (!(fabs(got - want) <= tolerance))
        fail_msg("got %.17g, want %.17g", got, want);
}

static void
near3(const double got[3], double x, double y, double z)
{
    near(got[0], x, 1e-12);
    near(got[1], y, 1e-12);
    near(got[2], z, 1e-12);
}

static void
load(struct document *d, const char *text)
{
    struct bytes said = {0};
    document_quoted(d, text);
    document_errors(d, &said);
    if (!d->good)
        fail_msg("%s: %s", text, said.data);
    bytes_clear(&said);
}

/* --- tools ------------------------------------------------------------------ */

static void
angles_agree_with_libm(void **unused)
{
    (void)unused;
    for (int i = -200000; i <= 200000; i++) {
        double degrees = i * 0.0137, s, c;
        angle_sin_cos(degrees, &s, &c);
        long double x =
            (long double)degrees * 3.14159265358979323846264338L / 180.0L;
        near(s, (double)sinl(x), 4.5e-16);
        near(c, (double)cosl(x), 4.5e-16);
    }
    static const double turns[][3] = {
        {0, 0, 1},    {90, 1, 0},  {180, 0, -1},    {270, -1, 0},
        {-90, -1, 0}, {360, 0, 1}, {999990, -1, 0}, {-450, -1, 0},
    };
    for (size_t i = 0; i < sizeof turns / sizeof turns[0]; i++) {
        double s, c;
        angle_sin_cos(turns[i][0], &s, &c);
        assert_true(s == turns[i][1] && c == turns[i][2]);
    }
}

static void
srgb_table_follows_the_curve(void **unused)
{
    double rgb[3];
    (void)unused;
    for (int i = 0; i < 256; i++) {
        long double v = (long double)i / 255;
        long double want =
            v <= 0.04045L ? v / 12.92L : powl((v + 0.055L) / 1.055L, 2.4L);
        near(srgb_linear[i], (double)want, 0);
    }
    assert_true(srgb_hex("#ff0080", rgb));
    assert_true(rgb[0] == 1 && rgb[1] == 0 && rgb[2] == srgb_linear[128]);
    assert_true(srgb_hex("#FfAa00", rgb));
    static const char *const bad[] = {"",        "#",        "#ff00", "ff0080",
                                      "#ff008g", "#ff00800", "#ff008"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        assert_false(srgb_hex(bad[i], rgb));
}

static void
vectors_of_any_length_are_normalised(void **unused)
{
    static const double lengths[] = {5e-324, 1e-300, 1e-20, 1, 1e6, 1e300};
    (void)unused;
    for (size_t i = 0; i < sizeof lengths / sizeof lengths[0]; i++) {
        double v[3] = {0, -lengths[i], 0};
        vector_unit(v, v);
        near3(v, 0, -1, 0);
    }
    double v[3] = {1e-200, 1e-200, 0};
    vector_unit(v, v);
    near(vector_length(v), 1, 1e-15);
}

/* --- camera ---------------------------------------------------------------------- */

static void
every_camera_becomes_a_window(void **unused)
{
    static const struct {
        const char *camera;
        double right, top, distance;
    } rows[] = {
        {"'fov':90", 2, 1, 1},
        {"'fov':90,'fov_axis':'x'", 1, 0.5, 1},
        {"'fov':60", 2 * 0.57735026918962573, 0.57735026918962573, 1},
        {"'focal_length':1.8", 2, 1, 1.8},
        {"'window':[-3,3,-1,1],'distance':7", 3, 1, 7},
        {"'window':[-3,3,-1,1]", 3, 1, 1},
        {"'type':'orthographic'", 2, 1, 0},
        {"'type':'orthographic','height':5", 5, 2.5, 0},
        {"'type':'orthographic','window':[-4,4,-3,3]", 4, 3, 0},
    };
    (void)unused;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        struct document d;
        char text[512];
        snprintf(text, sizeof text,
                 "{'objects':[{'type':'sphere'}],'camera':{%s},'film':{'width':"
                 "200,'height':100}}",
                 rows[i].camera);
        load(&d, text);
        const struct scene_camera *c = &d.scene.camera;
        near(c->right, rows[i].right, 1e-15);
        near(c->left, -rows[i].right, 1e-15);
        near(c->top, rows[i].top, 1e-15);
        near(c->bottom, -rows[i].top, 1e-15);
        if (c->kind == CAMERA_PERSPECTIVE)
            near(c->distance, rows[i].distance, 0);
        document_clear(&d);
    }
}

static void
the_frame_looks_along_minus_w(void **unused)
{
    struct document d;
    (void)unused;
    load(&d, "{'camera':{'eye':[1,2,3],'target':[1,2,-7],'up':[0,9,4]},"
             "'objects':[{'type':'sphere'}]}");
    near3(d.scene.camera.w, 0, 0, 1);
    near3(d.scene.camera.u, 1, 0, 0);
    near3(d.scene.camera.v, 0, 1, 0);
    document_clear(&d);
}

/* --- objects ------------------------------------------------------------------------ */

static void
transform_point(const double m[12], double x, double y, double z, double out[3])
{
    for (int row = 0; row < 3; row++)
        out[row] = m[4 * row] * x + m[4 * row + 1] * y + m[4 * row + 2] * z +
                   m[4 * row + 3];
}

static void
steps_act_first_to_last(void **unused)
{
    struct document d;
    double p[3];
    (void)unused;
    /* (1, 0, 0) scaled to (2, 0, 0), turned to (0, 0, -2), moved. */
    load(&d, "{'objects':[{'type':'sphere','transform':[{'scale':[2,1,1]},"
             "{'rotate':{'axis':[0,5,0],'angle':90}},{'translate':[10,0,0]}]},"
             "{'type':'sphere'},{'type':'sphere','transform':[{'scale':2},"
             "{'scale':0.5}]}]}");
    transform_point(d.scene.objects[0].to_world, 1, 0, 0, p);
    near3(p, 10, 0, -2);
    assert_true(d.scene.objects[0].transformed);
    assert_false(d.scene.objects[1].transformed);
    assert_false(d.scene.objects[2].transformed);
    document_clear(&d);
}

static void
groups_hand_down_what_they_have(void **unused)
{
    struct document d;
    double p[3];
    (void)unused;
    load(&d,
         "{'materials':[{'name':'a','type':'lambert'},{'name':'b','type':"
         "'mirror'}],'objects':[{'type':'sphere'},{'type':'group','material':"
         "'b','transform':[{'rotate':{'axis':[0,0,1],'angle':90}}],'visible':"
         "{'shadow':false},'children':[{'type':'sphere','transform':[{"
         "'translate':[1,0,0]}],'visible':{'camera':false}},{'type':'group',"
         "'children':[{'type':'box','name':'deep','min':[0,0,0],'max':[1,1,1],"
         "'material':'a'}]}]},{'type':'plane'}]}");
    const struct scene *s = &d.scene;
    assert_int_equal(s->object_count, 4);
    assert_string_equal(s->objects[1].pointer, "/objects/1/children/0");
    assert_string_equal(s->objects[2].pointer,
                        "/objects/1/children/1/children/0");
    assert_string_equal(s->objects[2].name, "deep");
    assert_int_equal(s->objects[1].material, 1);
    assert_int_equal(s->objects[2].material, 0);
    assert_int_equal(s->objects[0].material, s->objects[3].material);
    assert_int_equal(s->materials[s->objects[0].material].kind,
                     MATERIAL_LAMBERT);
    assert_int_equal(s->objects[0].visible, 7);
    assert_int_equal(s->objects[1].visible, VISIBLE_REFLECTION);
    assert_int_equal(s->objects[2].visible,
                     VISIBLE_CAMERA | VISIBLE_REFLECTION);
    transform_point(s->objects[1].to_world, 0, 0, 0, p);
    near3(p, 0, 1, 0);
    document_clear(&d);
}

static void
planes_are_normalised(void **unused)
{
    struct document d;
    (void)unused;
    load(&d, "{'objects':[{'type':'plane','normal':[0,0,4],'offset':8},"
             "{'type':'plane','normal':[0,-2,0],'point':[1,3,5]},"
             "{'type':'plane'}]}");
    const struct scene_object *o = d.scene.objects;
    near3(o[0].shape.plane.normal, 0, 0, 1);
    near(o[0].shape.plane.offset, 2, 0);
    near3(o[1].shape.plane.normal, 0, -1, 0);
    near(o[1].shape.plane.offset, -3, 0);
    near3(o[2].shape.plane.normal, 0, 1, 0);
    near(o[2].shape.plane.offset, 0, 0);
    document_clear(&d);
}

static void
meshes_are_flat_arrays(void **unused)
{
    struct document d;
    (void)unused;
    load(&d, "{'objects':[{'type':'mesh','positions':[[0,0,0],[1,0,0],[0,2,0],"
             "[0,0,3]],'indices':[[0,1,2],[3,2,1]],'normals':[[0,0,5],[0,0,1],"
             "[0,3,4],[1,0,0]],'uvs':[[0,0],[1,0],[0,1],[0.5,0.5]]},{'type':"
             "'triangle','vertices':[[0,0,0],[1,0,0],[0,1,0]]}]}");
    const struct scene_mesh *m = &d.scene.meshes[0];
    assert_int_equal(d.scene.triangle_count, 3);
    assert_int_equal(m->position_count, 4);
    assert_int_equal(m->triangle_count, 2);
    assert_true(m->positions[7] == 2.0f && m->positions[11] == 3.0f);
    assert_int_equal(m->indices[3], 3);
    assert_true(m->normals[2] == 1.0f && m->normals[7] == 0.6f);
    assert_true(m->uvs[6] == 0.5f);
    assert_true(d.scene.objects[0].shape.mesh.smooth);
    assert_false(d.scene.objects[1].shape.triangle.has_normals);
    document_clear(&d);
}

static void
materials_fill_in_their_defaults(void **unused)
{
    struct document d;
    (void)unused;
    load(&d,
         "{'textures':[{'name':'t','type':'checkerboard'}],'materials':[{'name'"
         ":'b','type':'blinn_phong','diffuse':'t'},{'name':'g','type':'glazed'}"
         ",{'name':'m','type':'mirror'},{'name':'l','type':'lambert','diffuse':"
         "[0.1,0.2,0.3]}],'objects':[{'type':'sphere'}]}");
    const struct scene_material *m = d.scene.materials;
    assert_int_equal(d.scene.material_count, 5);
    assert_int_equal(m[0].diffuse.texture, 0);
    assert_int_equal(m[0].ambient.texture, 0);
    assert_int_equal(m[0].specular.texture, SCENE_NONE);
    near3(m[0].specular.color, 1, 1, 1);
    near(m[0].shininess, 50, 0);
    near3(m[0].mirror.color, 0, 0, 0);
    near3(m[1].mirror.color, 0.2, 0.2, 0.2);
    near3(m[1].ambient.color, 0.8, 0.8, 0.8);
    near3(m[2].mirror.color, 1, 1, 1);
    near3(m[2].diffuse.color, 0, 0, 0);
    assert_int_equal(m[2].diffuse.texture, SCENE_NONE);
    near3(m[3].ambient.color, 0.1, 0.2, 0.3);
    near3(m[3].specular.color, 0, 0, 0);
    near3(d.scene.textures[0].color0, 0.15, 0.15, 0.15);
    near3(d.scene.textures[0].color1, 0.65, 0.65, 0.65);
    near3(d.scene.textures[0].scale, 1, 1, 1);
    document_clear(&d);
}

static void
dialects_have_their_defaults(void **unused)
{
    struct document d;
    (void)unused;
    load(&d, "{'objects':[{'type':'sphere'}]}");
    assert_true(d.scene.integrator.inside_hits);
    assert_true(d.scene.integrator.clamp_local == 0);
    assert_int_equal(d.scene.integrator.max_bounces, 4);
    assert_int_equal(d.scene.integrator.shadows, SHADOWS_SOFT);
    assert_true(d.scene.default_light);
    assert_int_equal(d.scene.light_count, 1);
    near(d.scene.lights[0].to_light[2], 3 / sqrt(14), 1e-15);
    near3(d.scene.lights[0].intensity, 0.8, 0.8, 0.8);
    document_clear(&d);
    load(&d, "{'integrator':{'accumulation':'mean'},'objects':[{'type':"
             "'sphere'}],'lights':[]}");
    assert_false(d.scene.integrator.inside_hits);
    assert_true(d.scene.integrator.clamp_local == 1);
    assert_int_equal(d.scene.light_count, 0);
    assert_false(d.scene.default_light);
    document_clear(&d);
}

/* --- lights -------------------------------------------------------------------------- */

static void
lights_combine_colour_and_intensity(void **unused)
{
    struct document d;
    (void)unused;
    load(&d, "{'lights':[{'type':'point','position':[1,2,3],'color':[1,0.5,0],"
             "'intensity':4,'falloff':'inverse_square'},{'type':'directional',"
             "'direction':[0,-8,0]}],'objects':[{'type':'sphere'}]}");
    near3(d.scene.lights[0].intensity, 4, 2, 0);
    assert_true(d.scene.lights[0].inverse_square);
    near3(d.scene.lights[1].to_light, 0, 1, 0);
    document_clear(&d);
}

/* Counts of seed 000's loop: reference values, made by the slide's code. */
static void
the_lecture_loop_loses_its_last_row(void **unused)
{
    static const uint32_t counts[] = {1,  4,   9,   16,  25,  36,  36,  64,
                                      81, 100, 121, 144, 144, 196, 225, 256};
    (void)unused;
    for (uint32_t n = 1; n <= 64; n++) {
        struct scene_light light = {
            .kind = LIGHT_AREA_GRID, .samples = n, .loop_float32 = true};
        uint32_t count = scene_light_positions(&light);
        if (n <= 16)
            assert_int_equal(count, counts[n - 1]);
        bool loses = n == 7 || n == 13 || n == 20 || n == 21 || n == 23 ||
                     n == 28 || n == 29;
        if (n < 30)
            assert_int_equal(count, loses ? (n - 1) * (n - 1) : n * n);
        float x, z;
        scene_light_offset(&light, 0, &x, &z);
        assert_true(x == -1.0f && z == -1.0f);
        scene_light_offset(&light, count - 1, &x, &z);
        assert_true(x <= 1.0f && z <= 1.0f);
    }
}

static void
an_exact_grid_is_symmetric(void **unused)
{
    (void)unused;
    for (uint32_t n = 1; n <= 64; n++) {
        struct scene_light light = {.kind = LIGHT_AREA_GRID, .samples = n};
        uint32_t count = scene_light_positions(&light);
        float x, z, end_x, end_z;
        assert_int_equal(count, n * n);
        for (uint32_t k = 0; k < count; k++) {
            scene_light_offset(&light, k, &x, &z);
            scene_light_offset(&light, count - 1 - k, &end_x, &end_z);
            near((double)(x + end_x), 0, 1.2e-7);
            near((double)(z + end_z), 0, 1.2e-7);
        }
        scene_light_offset(&light, 0, &x, &z);
        assert_true(n == 1 ? x == 0.0f : x == -1.0f && z == -1.0f);
        if (n > 1) { /* the outer loop is x */
            scene_light_offset(&light, 1, &x, &z);
            assert_true(x == -1.0f && z > -1.0f);
        }
    }
    struct scene_light point = {.kind = LIGHT_POINT};
    assert_int_equal(scene_light_positions(&point), 1);
}

/* --- cost ------------------------------------------------------------------------------ */

static void
cost_follows_the_formula(void **unused)
{
    struct document d;
    struct output output;
    (void)unused;
    output_default(&output);
    document_load(&d, "schemas/examples/course-table-fresnel.json");
    struct scene_cost cost = scene_cost(&d.scene, &output, 1e6);
    near(cost.rays, 9216000, 0);
    near(cost.seconds, 9.216, 1e-12);
    near(cost.memory_bytes, 29491200, 0);
    document_clear(&d);
    document_load(&d, "schemas/examples/course-table-soft.json");
    cost = scene_cost(&d.scene, &output, 0);
    near(cost.rays, 1280.0 * 720 * 3 * 17, 0);
    assert_true(cost.seconds > 0);
    document_clear(&d);
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(angles_agree_with_libm),
        cmocka_unit_test(srgb_table_follows_the_curve),
        cmocka_unit_test(vectors_of_any_length_are_normalised),
        cmocka_unit_test(every_camera_becomes_a_window),
        cmocka_unit_test(the_frame_looks_along_minus_w),
        cmocka_unit_test(steps_act_first_to_last),
        cmocka_unit_test(groups_hand_down_what_they_have),
        cmocka_unit_test(planes_are_normalised),
        cmocka_unit_test(meshes_are_flat_arrays),
        cmocka_unit_test(materials_fill_in_their_defaults),
        cmocka_unit_test(dialects_have_their_defaults),
        cmocka_unit_test(lights_combine_colour_and_intensity),
        cmocka_unit_test(the_lecture_loop_loses_its_last_row),
        cmocka_unit_test(an_exact_grid_is_symmetric),
        cmocka_unit_test(cost_follows_the_formula),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
