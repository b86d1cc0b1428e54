/* Each likely mistake is told at its place, and a scene without one is not
 * told anything. */

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/scene/scene_lint.h"
#include "tests/unit/scene/documents.h"

#define LIT(fields) "{'lights':[],'objects':[" fields "]}"
#define BALL        "{'type':'sphere'}"

static const char *const rows[][2] = {
    {LIT(BALL), ""},
    {"{'objects':[" BALL "]}", "lights.default_used \n"},
    {"{'lights':[],'integrator':{'max_bounces':0},'objects':[{'type':'sphere',"
     "'name':'steel','material':{'type':'mirror'}}]}",
     "mirror.no_bounces /integrator/max_bounces\n"},
    {"{'lights':[],'integrator':{'max_bounces':3},'objects':[" BALL "]}",
     "bounces.unused /integrator/max_bounces\n"},
    {"{'lights':[],'integrator':{'max_bounces':3,'accumulation':'mean'},"
     "'objects':[" BALL "]}",
     ""},
    {"{'lights':[],'materials':[{'name':'a','type':'lambert'},{'name':'b',"
     "'type':'lambert','diffuse':'t'}],'textures':[{'name':'t','type':"
     "'constant','color':[0,0,0]},{'name':'u','type':'constant','color':[0,0,0]"
     "}],'objects':[{'type':'group','children':[{'type':'sphere','material':'a'"
     "}]}]}",
     "material.unused /materials/1\ntexture.unused /textures/1\n"},
    {LIT("{'type':'plane','normal':[0,2,0]}"),
     "normal.not_unit /objects/0/normal\n"},
    {LIT("{'type':'plane','normal':[0,1,0]}"), ""},
    {LIT("{'type':'sphere','material':{'type':'lambert','emission':[1,1,1]}}"),
     "light.emissive_in_whitted /objects/0\n"},
    {"{'lights':[{'type':'area_grid','position':[0,9,0],'samples':1}],"
     "'objects':[" BALL "]}",
     "area_light.one_sample /lights/0\n"},
    {"{'lights':[{'type':'point','position':[0,9,0]},{'type':'point',"
     "'position':[0.5,0,0]}],'objects':[" BALL "]}",
     "light.inside_object /lights/1/position\n"},
    {"{'integrator':{'shadows':'none'},'lights':[{'type':'point','position':"
     "[0.5,0,0]}],'objects':[" BALL "]}",
     ""},
    {"{'lights':[{'type':'point','position':[10.4,2,0]}],'objects':[{'type':"
     "'box','min':[0,0,0],'max':[1,1,1],'transform':[{'scale':[1,4,2]},{"
     "'rotate':{'axis':[0,1,0],'angle':90}},{'translate':[10,0,0.5]}]}]}",
     "light.inside_object /lights/0/position\n"},
    {"{'lights':[],'camera':{'eye':[0,0,0.5]},'objects':[" BALL "]}",
     "camera.inside_object /camera/eye\n"},
    {"{'lights':[],'objects':[{'type':'box','min':[-9,-9,-9],'max':[9,9,9]}]}",
     "camera.inside_object \n"},
    {LIT("{'type':'triangle','vertices':[[0,0,0],[1,1,1],[2,2,2]]}"),
     "triangle.degenerate /objects/0/vertices\n"},
    {LIT("{'type':'mesh','positions':[[0,0,0],[1,0,0],[0,1,0]],'indices':[[0,1,"
         "2],[0,1,1]]}"),
     "triangle.degenerate /objects/0/indices/1\n"
     "mesh.winding /objects/0/indices/1\n"},
    {LIT("{'type':'mesh','positions':[[0,0,0],[1,0,0],[0,1,0],[1,1,0]],"
         "'indices':[[0,1,2],[1,3,2]]}"),
     ""},
    {LIT("{'type':'mesh','positions':[[0,0,0],[1,0,0],[0,1,0],[1,1,0]],"
         "'indices':[[0,1,2],[3,1,2]]}"),
     "mesh.winding /objects/0/indices/1\n"},
    {LIT("{'type':'mesh','positions':[[0,0,0],[1,0,0],[0,1,0],[1,0,0]],"
         "'indices':[[0,1,2]]}"),
     "mesh.duplicate_vertex /objects/0/positions/3\n"},
    {LIT("{'type':'mesh','positions':[[0,0,0],[1,0,0],[0,1,0],[1,0,0]],"
         "'indices':[[0,1,2]],'uvs':[[0,0],[1,0],[0,1],[1,1]]}"),
     ""},
    {LIT("{'type':'mesh','positions':[[0,0,0],[1,0,0],[0,1,0]],'indices':[[0,1,"
         "2]],'material':{'type':'lambert','diffuse':{'type':'checkerboard'}}"
         "}"),
     "texture.no_uv /objects/0\n"},
    {LIT("{'type':'mesh','positions':[[0,0,0],[1,0,0],[0,1,0]],'indices':[[0,1,"
         "2]],'material':{'type':'lambert','diffuse':{'type':'checkerboard',"
         "'mapping':'world_xz'}}}"),
     ""},
};

static void
each_mistake_is_told_at_its_place(void **unused)
{
    int wrong = 0;
    (void)unused;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        struct document d;
        struct bytes said = {0};
        const struct lint_item *items;
        document_quoted(&d, rows[i][0]);
        if (!d.good)
            fail_msg("%s: %s", rows[i][0], d.errors.items[0].detail);
        size_t count = scene_lint(d.root, &d.scene, &d.arena, &items);
        bytes_append(&said, "", 0);
        for (size_t k = 0; k < count; k++) {
            assert_true(items[k].line >= 1 && items[k].column >= 1);
            assert_true(strlen(items[k].detail) > 0);
            bytes_printf(&said, "%s %s\n", items[k].code, items[k].pointer);
        }
        if (strcmp(said.data, rows[i][1]) != 0) {
            print_error("%s\nexpected:\n%sgot:\n%s", rows[i][0], rows[i][1],
                        said.data);
            wrong++;
        }
        bytes_clear(&said);
        document_clear(&d);
    }
    assert_int_equal(wrong, 0);
}

static void
examples_have_few_mistakes(void **unused)
{
    char *names[64];
    size_t count = document_list("schemas/examples", names, 64);
    (void)unused;
    for (size_t i = 0; i < count; i++) {
        struct document d;
        const struct lint_item *items;
        char path[512];
        snprintf(path, sizeof path, "schemas/examples/%s", names[i]);
        document_load(&d, path);
        size_t told = scene_lint(d.root, &d.scene, &d.arena, &items);
        bool smallest = strcmp(names[i], "smallest.json") == 0;
        if (told != (smallest ? 1 : 0))
            fail_msg("%s: %s", path, items[0].detail);
        document_clear(&d);
        free(names[i]);
    }
}

static void
fifty_at_most(void **unused)
{
    struct document d;
    struct bytes text = {0};
    const struct lint_item *items;
    (void)unused;
    bytes_text(&text, "{'objects':[");
    for (int i = 0; i < 200; i++)
        bytes_text(&text, "{'type':'plane','normal':[0,3,0]},");
    bytes_text(&text, BALL "]}");
    document_quoted(&d, text.data);
    assert_true(d.good);
    assert_int_equal(scene_lint(d.root, &d.scene, &d.arena, &items), 50);
    bytes_clear(&text);
    document_clear(&d);
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_mistake_is_told_at_its_place),
        cmocka_unit_test(examples_have_few_mistakes),
        cmocka_unit_test(fifty_at_most),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
