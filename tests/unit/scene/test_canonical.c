/* Canonical text is another spelling of the same scene. */

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/scene/scene_hash.h"
#include "tests/unit/scene/documents.h"

/* Given a good document, its canonical text reads back to the same scene and
 * to itself. */
static void
check_round_trip(const struct document *d, const char *name)
{
    struct document again;
    struct bytes first = {0}, second = {0}, dump1 = {0}, dump2 = {0};
    struct bytes said = {0};
    scene_write_canonical(d->root, &first);
    document_read(&again, first.data, first.len, NULL);
    document_errors(&again, &said);
    if (!again.good)
        fail_msg("%s: %s\n%s", name, said.data, first.data);
    scene_write_canonical(again.root, &second);
    assert_string_equal(first.data, second.data);
    scene_dump(&d->scene, &dump1);
    scene_dump(&again.scene, &dump2);
    if (strcmp(dump1.data, dump2.data) != 0)
        fail_msg("%s:\n%s\n%s", name, dump1.data, dump2.data);
    document_clear(&again);
    bytes_clear(&first);
    bytes_clear(&second);
    bytes_clear(&dump1);
    bytes_clear(&dump2);
    bytes_clear(&said);
}

static void
examples_round_trip(void **unused)
{
    char *names[64];
    size_t count = document_list("schemas/examples", names, 64);
    (void)unused;
    for (size_t i = 0; i < count; i++) {
        struct document d;
        char path[512];
        snprintf(path, sizeof path, "schemas/examples/%s", names[i]);
        document_load(&d, path);
        check_round_trip(&d, path);
        document_clear(&d);
        free(names[i]);
    }
}

/* Each in its own way not what the examples show. */
static const char *const odd[] = {
    "{'objects':[{'type':'plane','point':[1,2,3],'normal':[0,0,2]}]}",
    "{'objects':[{'type':'plane','offset':3,'normal':[0,-4,0]}]}",
    "{'camera':{'fov':170,'fov_axis':'x'},'objects':[{'type':'sphere'}]}",
    "{'camera':{'type':'orthographic','height':3},'objects':[{'type':'sphere'}]"
    "}",
    "{'camera':{'up':[0,1e-300,0]},'objects':[{'type':'sphere'}]}",
    "{'background':{'type':'gradient','bottom':'#ff8000','top':[0,0,1e6]},"
    "'objects':[{'type':'sphere'}]}",
    "{'lights':[],'objects':[{'type':'sphere'}]}",
    "{'lights':[{'type':'directional','direction':[0,-1,0],'intensity':0.25},"
    "{'type':'area_grid','position':[0,9,0],'loop':'float32','samples':7,"
    "'falloff':'inverse_square'}],'objects':[{'type':'sphere'}]}",
    "{'integrator':{'accumulation':'mean','clamp_local':null,'inside_hits':true"
    "},'objects':[{'type':'sphere'}]}",
    "{'integrator':{'accumulation':'fresnel_weighted','fresnel':{'bias':0.1}},"
    "'objects':[{'type':'sphere'}]}",
    "{'sampler':{'type':'sobol','spp':16,'seed':4294967295},'objects':[{'type':"
    "'sphere'}]}",
    "{'objects':[{'type':'sphere','material':{'type':'mirror'}},{'type':"
    "'sphere','material':{'type':'lambert'}},{'type':'sphere'}]}",
    "{'objects':[{'type':'group','material':{'type':'glazed'},'children':[{"
    "'type':'sphere'},{'type':'group','transform':[{'scale':2},{'rotate':{"
    "'axis':[0,1,1],'angle':30}}],'visible':{'shadow':false},'children':[{"
    "'type':'box','min':[0,0,0],'max':[1,1,1],'transform':[{'matrix':[1,0,0,5,0"
    ",0,-1,0,0,1,0,0,0,0,0,1]}],'material':'m'}]}]}],'materials':[{'type':"
    "'blinn_phong','name':'m','diffuse':{'type':'checkerboard','mapping':"
    "'world_xyz','scale':[1,2,3]}}]}",
    "{'objects':[{'type':'triangle','vertices':[[0,0,0],[1,0,0],[0,1,0]],"
    "'normals':[[0,0,2],[0,0,1],[1,0,1]],'uvs':[[0,0],[1,0],[0,1]],'material':"
    "{'type':'lambert','diffuse':'t','emission':[2,2,2]}}],'textures':[{'type':"
    "'constant','color':'#204060','name':'t','scale':2}]}",
    "{'objects':[{'type':'mesh','positions':[[0,0,0],[1,0,0],[0,1,0]],'indices'"
    ":[[0,1,2]],'uvs':[[0,0],[1,0],[0,1]]},{'type':'mesh','smooth':false,"
    "'positions':[[0,0,0],[1,0,0],[0,1,0]],'indices':[[2,1,0]],'normals':[[0,0,"
    "1],[0,0,1],[0,0,1]]}]}",
    "{'version':1,'name':'n','description':'d','extras':{'a':[1]},'assets':{},"
    "'film':{'width':3,'height':5,'filter':{'type':'box','radius':0.5}},"
    "'objects':[{'type':'quad','origin':[0,0,0],'edge_u':[1,0,0],'edge_v':[0,1,"
    "0]}]}",
};

static void
odd_documents_round_trip(void **unused)
{
    (void)unused;
    for (size_t i = 0; i < sizeof odd / sizeof odd[0]; i++) {
        struct document d;
        struct bytes said = {0};
        document_quoted(&d, odd[i]);
        document_errors(&d, &said);
        if (!d.good)
            fail_msg("%s: %s", odd[i], said.data);
        check_round_trip(&d, odd[i]);
        bytes_clear(&said);
        document_clear(&d);
    }
}

static void
canonical_of(const char *text, struct bytes *out)
{
    struct document d;
    document_quoted(&d, text);
    assert_true(d.good);
    scene_write_canonical(d.root, out);
    document_clear(&d);
}

/* Two spellings of one scene: same canonical text, same hash. */
static void
spelling_does_not_matter(void **unused)
{
    static const char *const pairs[][2] = {
        {"{'objects':[{'type':'sphere'}]}",
         "{ 'version': 1.0, 'objects': [ {'radius': 1e0, 'type': 'sphere', "
         "'center': [0, -0, 0.0]} ], 'description': 'x', 'extras': {} }"},
        {"{'objects':[{'type':'sphere'}]}",
         "{'lights':[{'type':'directional','to_light':[1,2,3],'color':[0.8,0.8,"
         "0.8]}],'objects':[{'type':'sphere','material':{'type':'lambert'}}]}"},
        {"{'objects':[{'type':'sphere','material':{'type':'lambert','diffuse':"
         "'#ffffff'}}]}",
         "{'objects':[{'type':'sphere','material':{'ambient':[1,1,1],'diffuse':"
         "[1,1,1],'type':'lambert'}}]}"},
        {"{'objects':[{'type':'sphere','transform':[{'scale':2}]}]}",
         "{'objects':[{'type':'sphere','transform':[{'scale':[2,2,2]}]}]}"},
    };
    (void)unused;
    for (size_t i = 0; i < sizeof pairs / sizeof pairs[0]; i++) {
        struct bytes a = {0}, b = {0};
        char hash_a[SCENE_HASH_SIZE], hash_b[SCENE_HASH_SIZE];
        struct output output;
        output_default(&output);
        canonical_of(pairs[i][0], &a);
        canonical_of(pairs[i][1], &b);
        assert_string_equal(a.data, b.data);
        scene_hash(a.data, a.len, &output, hash_a);
        scene_hash(b.data, b.len, &output, hash_b);
        assert_string_equal(hash_a, hash_b);
        assert_int_equal(strlen(hash_a), 7 + 64);
        output.bit_depth = DEPTH_UINT16;
        scene_hash(b.data, b.len, &output, hash_b);
        assert_string_not_equal(hash_a, hash_b);
        bytes_clear(&a);
        bytes_clear(&b);
    }
}

static void
keys_are_sorted(const struct json *node)
{
    for (const struct json *m = node->child; m != NULL; m = m->next) {
        if (m->key != NULL && m->next != NULL)
            assert_true(strcmp(m->key, m->next->key) < 0);
        keys_are_sorted(m);
    }
}

static void
canonical_text_is_sorted_and_bare(void **unused)
{
    struct document d, again;
    struct bytes text = {0};
    (void)unused;
    document_load(&d, "schemas/examples/course-table-fresnel.json");
    scene_write_canonical(d.root, &text);
    document_read(&again, text.data, text.len, NULL);
    assert_true(again.good);
    keys_are_sorted(again.root);
    assert_null(strstr(text.data, "description"));
    assert_null(strchr(text.data, ' '));
    assert_null(strchr(text.data, '\n'));
    document_clear(&again);
    document_clear(&d);
    bytes_clear(&text);
}

static void
settings_and_counts_are_told(void **unused)
{
    struct document d;
    struct bytes out = {0};
    (void)unused;
    document_load(&d, "schemas/examples/course-table-fresnel.json");
    scene_write_settings(&d.scene, &out);
    assert_string_equal(
        out.data,
        "{\"film\":{\"filter\":{\"radius\":0.5,\"type\":\"box\"},"
        "\"height\":720,\"width\":1280},\"integrator\":{\"accumulation\":"
        "\"fresnel_weighted\",\"ambient\":[0.3,0.3,0.3],\"clamp_local\":1,"
        "\"fresnel\":{\"bias\":0,\"exponent\":2},\"inside_hits\":false,"
        "\"max_bounces\":4,\"ray_offset\":0.0001,\"shadows\":\"soft\","
        "\"type\":\"whitted\"},\"sampler\":{\"seed\":0,\"spp\":1,"
        "\"type\":\"center\"}}");
    bytes_clear(&out);
    scene_write_object_counts(&d.scene, &out);
    assert_string_equal(out.data, "{\"sphere\":3,\"box\":6,\"plane\":1}");
    bytes_clear(&out);
    document_clear(&d);
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(examples_round_trip),
        cmocka_unit_test(odd_documents_round_trip),
        cmocka_unit_test(spelling_does_not_matter),
        cmocka_unit_test(canonical_text_is_sorted_and_bare),
        cmocka_unit_test(settings_and_counts_are_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
