/* The output block: what is accepted, what is refused, and its canonical form. */

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <string.h>

#include "core/scene/output.h"

struct reading {
    struct arena arena;
    struct error_list errors;
    struct output output;
    bool good;
};

static void
begin(struct reading *r, const char *text)
{
    struct bytes copy = {0};
    memset(r, 0, sizeof *r);
    arena_init(&r->arena, 0);
    r->errors.arena = &r->arena;
    bytes_text(&copy, text);
    for (size_t i = 0; i < copy.len; i++) {
        if (copy.data[i] == '\'')
            copy.data[i] = '"';
    }
    const struct json *root =
        json_read(copy.data, copy.len, NULL, &r->arena, &r->errors);
    assert_non_null(root);
    r->good = output_read(json_member(root, "output"), &r->output, &r->errors);
    bytes_clear(&copy);
}

static void
outputs_are_accepted(void **unused)
{
    static const char *const rows[][2] = {
        {"{}", "{\"bit_depth\":\"uint8\",\"color_space\":\"srgb\",\"format\":"
               "\"png\",\"layers\":[\"beauty\"]}"},
        {"{'output':{}}",
         "{\"bit_depth\":\"uint8\",\"color_space\":\"srgb\",\"format\":\"png\","
         "\"layers\":[\"beauty\"]}"},
        {"{'output':{'format':'exr'}}",
         "{\"bit_depth\":\"float\",\"color_space\":\"linear\",\"format\":"
         "\"exr\",\"layers\":[\"beauty\"]}"},
        {"{'output':{'layers':['normal','beauty','object_id'],'bit_depth':"
         "'half','format':'exr','color_space':'linear'}}",
         "{\"bit_depth\":\"half\",\"color_space\":\"linear\",\"format\":\"exr\""
         ",\"layers\":[\"normal\",\"beauty\",\"object_id\"]}"},
        {"{'output':{'bit_depth':'uint16','color_space':'linear','layers':["
         "'depth']}}",
         "{\"bit_depth\":\"uint16\",\"color_space\":\"linear\",\"format\":"
         "\"png\",\"layers\":[\"depth\"]}"},
    };
    (void)unused;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        struct reading r;
        struct bytes text = {0}, again = {0};
        begin(&r, rows[i][0]);
        assert_true(r.good);
        output_write(&r.output, &text);
        assert_string_equal(text.data, rows[i][1]);
        arena_clear(&r.arena);
        bytes_text(&again, "{\"output\":");
        bytes_append(&again, text.data, text.len);
        bytes_text(&again, "}");
        begin(&r, again.data);
        assert_true(r.good);
        bytes_clear(&again);
        output_write(&r.output, &again);
        assert_string_equal(again.data, text.data);
        arena_clear(&r.arena);
        bytes_clear(&again);
        bytes_clear(&text);
    }
}

static void
outputs_are_refused(void **unused)
{
    static const char *const rows[][2] = {
        {"{'output':3}", "type.mismatch /output\n"},
        {"{'output':{'format':'bmp'}}", "enum.unknown /output/format\n"},
        {"{'output':{'format':'jpeg'}}", "enum.not_yet /output/format\n"},
        {"{'output':{'format':'gif'}}", "enum.not_yet /output/format\n"},
        {"{'output':{'layers':[]}}", "array.length /output/layers\n"},
        {"{'output':{'layers':'beauty'}}", "type.mismatch /output/layers\n"},
        {"{'output':{'layers':['beauty','depth']}}",
         "array.length /output/layers\n"},
        {"{'output':{'format':'exr','layers':['beauty','beauty']}}",
         "name.duplicate /output/layers/1\n"},
        {"{'output':{'format':'exr','layers':['alpha','bounce_3','beuty']}}",
         "enum.not_yet /output/layers/0\nenum.not_yet /output/layers/1\n"
         "enum.unknown /output/layers/2\n"},
        {"{'output':{'bit_depth':'float'}}",
         "property.conflict /output/bit_depth\n"},
        {"{'output':{'bit_depth':'uint8','format':'exr'}}",
         "property.conflict /output/format\n"},
        {"{'output':{'format':'exr','color_space':'srgb'}}",
         "property.conflict /output/color_space\n"},
        {"{'output':{'exposure':1}}", "property.not_yet /output/exposure\n"},
        {"{'output':{'tonemap':'none'}}", "property.not_yet /output/tonemap\n"},
        {"{'output':{'tonemap':'hdr'}}", "enum.unknown /output/tonemap\n"},
        {"{'output':{'fromat':'png'}}", "property.unknown /output/fromat\n"},
    };
    (void)unused;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        struct reading r;
        struct bytes said = {0};
        begin(&r, rows[i][0]);
        for (size_t k = 0; k < r.errors.count; k++)
            bytes_printf(&said, "%s %s\n",
                         error_code_name(r.errors.items[k].code),
                         r.errors.items[k].pointer);
        assert_false(r.good);
        assert_string_equal(said.data, rows[i][1]);
        bytes_clear(&said);
        arena_clear(&r.arena);
    }
}

static void
layers_have_names(void **unused)
{
    (void)unused;
    for (unsigned i = 0; i < LAYER_COUNT; i++)
        assert_int_equal(layer_find(layer_name((enum layer)i)), i);
    assert_int_equal(layer_find("nope"), LAYER_COUNT);
    assert_int_equal(layer_channels(LAYER_NORMAL), 3);
    assert_string_equal(layer_kind(LAYER_DEPTH), "scalar");
    struct output output;
    output_default(&output);
    assert_string_equal(output_media_type(&output), "image/png");
    assert_string_equal(output_extension(&output), "png");
    output.format = OUTPUT_EXR;
    assert_string_equal(output_media_type(&output), "image/x-exr");
    assert_string_equal(output_extension(&output), "exr");
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(outputs_are_accepted),
        cmocka_unit_test(outputs_are_refused),
        cmocka_unit_test(layers_have_names),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
