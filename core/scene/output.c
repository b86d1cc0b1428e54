#include "core/scene/output.h"

#include <string.h>

#include "core/scene/kinds.h"
#include "core/scene/scene_reader.h"

/* --- rows ------------------------------------------------------------------------ */

static const struct choice formats[] = {{"png", OUTPUT_PNG, true},
                                        {"exr", OUTPUT_EXR, true},
                                        {"jpeg", -1, false},
                                        {"gif", -1, false},
                                        {"zip", -1, false}};
static const struct choice depths[] = {{"uint8", DEPTH_UINT8, true},
                                       {"uint16", DEPTH_UINT16, true},
                                       {"half", DEPTH_HALF, true},
                                       {"float", DEPTH_FLOAT, true}};
static const struct choice spaces[] = {{"srgb", COLOR_SRGB, true},
                                       {"linear", COLOR_LINEAR, true}};
static const struct choice tonemaps[] = {
    {"none", 0, true}, {"reinhard", 1, true}, {"filmic", 2, true}};

/* Layers of SCENE section 4 that no film holds yet. */
static const char *const later_layers[] = {"alpha",
                                           "position",
                                           "geometric_normal",
                                           "uv",
                                           "primitive_id",
                                           "bounce_0",
                                           "sample_count",
                                           "variance",
                                           "material_id",
                                           "barycentric",
                                           "hits",
                                           "ray_count",
                                           "sdf_steps",
                                           "z",
                                           "direct",
                                           "indirect",
                                           "cost"};

static bool
is_exr(const struct json *output)
{
    return is_text(json_member(output, "format"), "exr");
}

static bool
fill_depth(const struct json *root, const struct json *output, double def[4])
{
    (void)root;
    def[0] = is_exr(output) ? DEPTH_FLOAT : DEPTH_UINT8;
    return true;
}

static bool
fill_space(const struct json *root, const struct json *output, double def[4])
{
    (void)root;
    def[0] = is_exr(output) ? COLOR_LINEAR : COLOR_SRGB;
    return true;
}

static bool
is_bounce(const char *name)
{
    return strncmp(name, "bounce_", 7) == 0 && name[7] != '\0' &&
           strspn(name + 7, "0123456789") == strlen(name + 7);
}

static void
read_layer(struct reader *r, const struct json *value, struct output *output)
{
    const char *words[LAYER_COUNT + COUNT_OF(later_layers)];
    size_t count = 0;
    if (value->type != JSON_STRING) {
        fault_type(r, value, "a string, the name of a layer");
        return;
    }
    enum layer layer = layer_find(value->string);
    for (unsigned i = 0; i < LAYER_COUNT; i++)
        words[count++] = layer_name((enum layer)i);
    for (size_t i = 0; i < COUNT_OF(later_layers); i++)
        words[count++] = later_layers[i];
    if (layer == LAYER_COUNT) {
        bool later = is_bounce(value->string);
        for (size_t i = LAYER_COUNT; i < count; i++)
            later = later || strcmp(value->string, words[i]) == 0;
        if (later)
            fault_not_yet(r, ERROR_ENUM_NOT_YET, value,
                          or_word(arena_printf(r->arena, "the layer `%.32s`",
                                               value->string)),
                          "there are `beauty`, `depth`, `normal`, `albedo` and "
                          "`object_id`");
        else
            fault_unknown_word(r, ERROR_ENUM_UNKNOWN, value, "layer", words,
                               count);
        return;
    }
    for (uint32_t i = 0; i < output->layer_count; i++) {
        if (output->layers[i] == layer) {
            fault(r, ERROR_NAME_DUPLICATE, value, NULL, fix_remove(r, value),
                  "the layer `%s` is there already", layer_name(layer));
            return;
        }
    }
    output->layers[output->layer_count++] = layer;
}

static void
read_layers(struct reader *r, const struct json *value,
            const struct field *field, void *to)
{
    struct output *output = to;
    (void)field;
    if (value == NULL) {
        output->layers[0] = LAYER_BEAUTY;
        output->layer_count = 1;
        return;
    }
    if (value->type != JSON_ARRAY) {
        fault_type(r, value, "an array of layer names");
        return;
    }
    if (value->count == 0)
        fault(r, ERROR_ARRAY_LENGTH, value, "`beauty` is the picture", NULL,
              "at least one layer, got none");
    else if (value->count > 1 && !is_exr(value->parent))
        fault(r, ERROR_ARRAY_LENGTH, value, "`exr` carries many", NULL,
              "a png carries one layer, got %u", value->count);
    for (const struct json *n = value->child; n != NULL; n = n->next)
        read_layer(r, n, output);
}

static void
check_output(struct reader *r, const struct json *object, void *to)
{
    const struct json *format = json_member(object, "format");
    const struct json *depth = json_member(object, "bit_depth");
    const struct json *space = json_member(object, "color_space");
    bool exr = is_exr(object), png = format == NULL || is_text(format, "png");
    bool deep = is_text(depth, "half") || is_text(depth, "float");
    bool flat = is_text(depth, "uint8") || is_text(depth, "uint16");
    (void)to;
    if ((png && deep) || (exr && flat))
        fault(r, ERROR_PROPERTY_CONFLICT, later_of(format, depth),
              exr ? "exr takes `half` or `float`"
                  : "png takes `uint8` or `uint16`; exr `half` or `float`",
              NULL, "`%s` has no bit depth `%s`", exr ? "exr" : "png",
              depth->string);
    if (exr && is_text(space, "srgb"))
        fault(r, ERROR_PROPERTY_CONFLICT, later_of(format, space),
              "leave `color_space` out", fix_remove(r, space),
              "an exr is always `linear`");
}

static const struct field fields[] = {
    {"format", FIELD_ENUM, CHOICES_OF(formats), FIELD_AT(output, format)},
    {"layers", FIELD_CUSTOM, .offset = FIELD_SKIP, .read = read_layers},
    {"bit_depth", FIELD_ENUM, CHOICES_OF(depths), FIELD_AT(output, bit_depth),
     .fill = fill_depth},
    {"color_space", FIELD_ENUM, CHOICES_OF(spaces),
     FIELD_AT(output, color_space), .fill = fill_space},
    {"tonemap", FIELD_ENUM, FIELD_NOT_YET, CHOICES_OF(tonemaps),
     .offset = FIELD_SKIP},
    {"exposure", FIELD_NUMBER, FIELD_NOT_YET, .min = -1e6, .max = 1e6,
     .offset = FIELD_SKIP},
};
static const struct kind kind_output = {"output", 0, true, FIELDS_OF(fields),
                                        check_output};

/* --- the struct -------------------------------------------------------------------- */

void
output_default(struct output *output)
{
    *output = (struct output){.format = OUTPUT_PNG,
                              .layers = {LAYER_BEAUTY},
                              .layer_count = 1,
                              .bit_depth = DEPTH_UINT8,
                              .color_space = COLOR_SRGB};
}

bool
output_read(const struct json *node, struct output *output,
            struct error_list *errors)
{
    struct reader r = {.arena = errors->arena, .errors = errors, .root = node};
    output_default(output);
    if (node == NULL)
        return true;
    output->layer_count = 0;
    read_members(&r, node, NULL, &kind_output, output);
    return reader_tell_all(&r);
}

void
output_write(const struct output *output, struct bytes *out)
{
    struct json_writer w = {.out = out};
    json_begin_object(&w, NULL);
    json_put_string(&w, "bit_depth", depths[output->bit_depth].name);
    json_put_string(&w, "color_space", spaces[output->color_space].name);
    json_put_string(&w, "format", formats[output->format].name);
    json_begin_array(&w, "layers");
    for (uint32_t i = 0; i < output->layer_count; i++)
        json_put_string(&w, NULL, layer_name(output->layers[i]));
    json_end_array(&w);
    json_end_object(&w);
}

const char *
output_media_type(const struct output *output)
{
    return output->format == OUTPUT_PNG ? "image/png" : "image/x-exr";
}

const char *
output_extension(const struct output *output)
{
    return output->format == OUTPUT_PNG ? "png" : "exr";
}
