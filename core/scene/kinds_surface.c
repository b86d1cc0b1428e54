/* Textures, materials and lights (SCENE 3.4 to 3.6). */
#include "core/scene/kinds.h"

#include "core/scene/scene.h"
#include "core/scene/scene_reader.h"
#include "core/scene/scene_write.h"

/* --- textures ------------------------------------------------------------------- */

static const struct choice mappings[] = {
    {"uv", MAPPING_UV, true},
    {"world_xz", MAPPING_WORLD_XZ, true},
    {"world_xy", MAPPING_WORLD_XY, true},
    {"world_yz", MAPPING_WORLD_YZ, true},
    {"world_xyz", MAPPING_WORLD_XYZ, true},
    {"object_xz", MAPPING_OBJECT_XZ, true},
    {"object_xy", MAPPING_OBJECT_XY, true},
    {"object_yz", MAPPING_OBJECT_YZ, true},
    {"object_xyz", MAPPING_OBJECT_XYZ, true},
};

/* The default colours differ by kind, so each kind has its own rows of them. */
#define COLORS(a, b)                                                           \
    {"color0", FIELD_COLOR, .max = 1e6, FIELD_AT(scene_texture, color0),       \
     .def = {a, a, a}},                                                        \
    {                                                                          \
        "color1", FIELD_COLOR, .max = 1e6, FIELD_AT(scene_texture, color1),    \
                               .def = {                                        \
                                   b,                                          \
                                   b,                                          \
                                   b                                           \
                               }                                               \
    }

static const struct field texture_common[] = {
    {"name", FIELD_NAME, FIELD_OPTIONAL, FIELD_AT(scene_texture, name)},
    {"mapping", FIELD_ENUM, CHOICES_OF(mappings),
     FIELD_AT(scene_texture, mapping)},
    {"scale", FIELD_SCALE, .min = -1e6, .max = 1e6,
     FIELD_AT(scene_texture, scale), .def = {1, 1, 1}},
    {"offset", FIELD_SCALE, .min = -1e6, .max = 1e6,
     FIELD_AT(scene_texture, offset)},
};
/* One colour: color0 and color1 are allowed like all common fields, and the
 * struct's color0 is `color`. */
static const struct field constant[] = {
    {"color", FIELD_COLOR, FIELD_REQUIRED, .max = 1e6,
     FIELD_AT(scene_texture, color0)},
    {"color0", FIELD_COLOR, FIELD_OPTIONAL | FIELD_DROPPED, .max = 1e6,
     .offset = FIELD_SKIP},
    {"color1", FIELD_COLOR, FIELD_OPTIONAL | FIELD_DROPPED, .max = 1e6,
     .offset = FIELD_SKIP},
};
static const struct field checkerboard[] = {COLORS(0.15, 0.65)};
static const struct field gradient[] = {COLORS(0, 1)};
static const struct field stripes[] = {
    COLORS(0, 1),
    {"width", FIELD_NUMBER, .max = 1, .offset = FIELD_SKIP, .def = {0.5}},
};
static const struct field hexagon[] = {
    COLORS(0, 1),
    {"line_width", FIELD_NUMBER, .max = 1, .offset = FIELD_SKIP, .def = {0.1}},
};
static const struct field brick[] = {
    COLORS(0, 1),
    {"width", FIELD_NUMBER, RANGE_LENGTH, .offset = FIELD_SKIP, .def = {1}},
    {"height", FIELD_NUMBER, RANGE_LENGTH, .offset = FIELD_SKIP, .def = {0.5}},
    {"mortar", FIELD_NUMBER, .max = 1e6, .offset = FIELD_SKIP, .def = {0.05}},
};
static const struct field noise[] = {
    COLORS(0, 1),
    {"seed", FIELD_INTEGER, .max = 4294967295.0, .offset = FIELD_SKIP},
    {"octaves", FIELD_INTEGER, .min = 1, .max = 16, .offset = FIELD_SKIP,
     .def = {5}},
    {"gain", FIELD_NUMBER, .max = 1e6, .offset = FIELD_SKIP, .def = {0.5}},
    {"lacunarity", FIELD_NUMBER, .max = 1e6, .offset = FIELD_SKIP, .def = {2}},
};
static const struct choice filters[] = {{"nearest", 0, true},
                                        {"bilinear", 1, true}};
static const struct choice wraps[] = {{"repeat", 0, true}, {"clamp", 1, true}};
static const struct choice spaces[] = {{"srgb", 0, true}, {"linear", 1, true}};
static const struct field image[] = {
    COLORS(0, 1),
    {"asset", FIELD_CUSTOM, FIELD_REQUIRED, .offset = FIELD_SKIP,
     .read = read_asset_name},
    {"filter", FIELD_ENUM, CHOICES_OF(filters), .offset = FIELD_SKIP},
    {"wrap", FIELD_ENUM, CHOICES_OF(wraps), .offset = FIELD_SKIP},
    {"color_space", FIELD_ENUM, CHOICES_OF(spaces), .offset = FIELD_SKIP},
};

static const struct kind textures[] = {
    {"constant", TEXTURE_CONSTANT, true, FIELDS_OF(constant), NULL},
    {"checkerboard", TEXTURE_CHECKERBOARD, true, FIELDS_OF(checkerboard), NULL},
    {"gradient", -1, false, FIELDS_OF(gradient), NULL},
    {"stripes", -1, false, FIELDS_OF(stripes), NULL},
    {"rings", -1, false, FIELDS_OF(gradient), NULL},
    {"hexagon", -1, false, FIELDS_OF(hexagon), NULL},
    {"brick", -1, false, FIELDS_OF(brick), NULL},
    {"noise", -1, false, FIELDS_OF(noise), NULL},
    {"fbm", -1, false, FIELDS_OF(noise), NULL},
    {"turbulence", -1, false, FIELDS_OF(noise), NULL},
    {"marble", -1, false, FIELDS_OF(noise), NULL},
    {"wood", -1, false, FIELDS_OF(noise), NULL},
    {"image", -1, false, FIELDS_OF(image), NULL},
};

const struct family family_texture = {
    .noun = "texture",
    .common = texture_common,
    .common_count = COUNT_OF(texture_common),
    .kinds = textures,
    .kind_count = COUNT_OF(textures),
    .finish = finish_texture,
};

/* --- materials -------------------------------------------------------------------- */

/* A share of light, 0 ... 1; and what shines by itself. */
#define REFLECTANCE(key, member, grey)                                         \
    {                                                                          \
        key, FIELD_PAINT, .max = 1, FIELD_AT(scene_material, member), .def = { \
            grey,                                                              \
            grey,                                                              \
            grey                                                               \
        }                                                                      \
    }
#define DIFFUSE REFLECTANCE("diffuse", diffuse, 0.8)
#define AMBIENT                                                                \
    {                                                                          \
        "ambient", FIELD_PAINT, .max = 1, FIELD_AT(scene_material, ambient),   \
                                .def = {0.8, 0.8, 0.8}, .same_as = "diffuse"   \
    }
#define EMISSION                                                               \
    {                                                                          \
        "emission", FIELD_PAINT, .max = 1e6,                                   \
                                 FIELD_AT(scene_material, emission)            \
    }
#define GLOSS                                                                  \
    REFLECTANCE("specular", specular, 1),                                      \
        {"shininess", FIELD_NUMBER, .max = 1e5,                                \
         FIELD_AT(scene_material, shininess), .def = {50}},                    \
        REFLECTANCE("mirror", mirror, 0)
#define CHECKED(key, most, grey)                                               \
    {                                                                          \
        key, FIELD_PAINT, .max = most, .offset = FIELD_SKIP, .def = {          \
            grey,                                                              \
            grey,                                                              \
            grey                                                               \
        }                                                                      \
    }

static const struct field material_common[] = {
    {"name", FIELD_NAME, FIELD_OPTIONAL, FIELD_AT(scene_material, name)},
};
static const struct field lambert[] = {DIFFUSE, AMBIENT, EMISSION};
static const struct field blinn_phong[] = {DIFFUSE, AMBIENT, GLOSS, EMISSION};
static const struct field glazed[] = {
    DIFFUSE, AMBIENT, REFLECTANCE("mirror", mirror, 0.2), EMISSION};
static const struct field mirror[] = {REFLECTANCE("reflectance", mirror, 1)};
static const struct field dielectric[] = {
    {"ior", FIELD_NUMBER, .min = 1, .max = 4, .offset = FIELD_SKIP,
     .def = {1.5}},
    CHECKED("tint", 1, 1),
};
static const struct field emissive[] = {
    CHECKED("radiance", 1e6, 1),
    {"two_sided", FIELD_BOOL, .offset = FIELD_SKIP},
};
static const struct field conductor[] = {
    CHECKED("reflectance", 1, 0.9),
    {"roughness", FIELD_NUMBER, .max = 1, .offset = FIELD_SKIP},
};
static const struct field principled[] = {
    CHECKED("base_color", 1, 0.8),
    {"metallic", FIELD_NUMBER, .max = 1, .offset = FIELD_SKIP},
    {"roughness", FIELD_NUMBER, .max = 1, .offset = FIELD_SKIP},
    {"ior", FIELD_NUMBER, .min = 1, .max = 4, .offset = FIELD_SKIP,
     .def = {1.5}},
    {"transmission", FIELD_NUMBER, .max = 1, .offset = FIELD_SKIP},
    CHECKED("emission", 1e6, 0),
};
static const struct field mix[] = {
    {"a", FIELD_CUSTOM, FIELD_REQUIRED, .offset = FIELD_SKIP,
     .read = read_material},
    {"b", FIELD_CUSTOM, FIELD_REQUIRED, .offset = FIELD_SKIP,
     .read = read_material},
    {"weight", FIELD_CUSTOM, FIELD_REQUIRED, .offset = FIELD_SKIP,
     .read = read_weight},
};

static const struct kind materials[] = {
    {"lambert", MATERIAL_LAMBERT, true, FIELDS_OF(lambert), NULL},
    {"blinn_phong", MATERIAL_BLINN_PHONG, true, FIELDS_OF(blinn_phong), NULL},
    {"phong", -1, false, FIELDS_OF(blinn_phong), NULL},
    {"glazed", MATERIAL_GLAZED, true, FIELDS_OF(glazed), NULL},
    {"mirror", MATERIAL_MIRROR, true, FIELDS_OF(mirror), NULL},
    {"dielectric", -1, false, FIELDS_OF(dielectric), NULL},
    {"emissive", -1, false, FIELDS_OF(emissive), NULL},
    {"conductor", -1, false, FIELDS_OF(conductor), NULL},
    {"principled", -1, false, FIELDS_OF(principled), NULL},
    {"mix", -1, false, FIELDS_OF(mix), NULL},
};

const struct family family_material = {
    .noun = "material",
    .common = material_common,
    .common_count = COUNT_OF(material_common),
    .kinds = materials,
    .kind_count = COUNT_OF(materials),
    .finish = finish_material,
};

/* --- lights -------------------------------------------------------------------------- */

static const struct choice falloffs[] = {{"none", 0, true},
                                         {"inverse_square", 1, true}};
static const struct choice loops[] = {{"exact", 0, true}, {"float32", 1, true}};

#define POSITION                                                               \
    {                                                                          \
        "position", FIELD_VECTOR, FIELD_REQUIRED, RANGE_POINT,                 \
            FIELD_AT(light_fields, light.position)                             \
    }
#define FALLOFF                                                                \
    {                                                                          \
        "falloff", FIELD_ENUM, CHOICES_OF(falloffs),                           \
            FIELD_AT(light_fields, falloff)                                    \
    }

static const struct field light_common[] = {
    {"name", FIELD_NAME, FIELD_OPTIONAL, FIELD_AT(light_fields, light.name)},
    {"color", FIELD_COLOR, .max = 1e6, FIELD_AT(light_fields, color),
     .def = {1, 1, 1}},
    {"intensity", FIELD_NUMBER, .max = 1e6, FIELD_AT(light_fields, intensity),
     .def = {1}},
};
static const struct field point[] = {POSITION, FALLOFF};
static const struct field directional[] = {
    {"direction", FIELD_DIRECTION, FIELD_OPTIONAL,
     FIELD_AT(light_fields, direction)},
    {"to_light", FIELD_DIRECTION, FIELD_OPTIONAL,
     FIELD_AT(light_fields, to_light)},
};
static const struct field spot[] = {
    POSITION,
    FALLOFF,
    {"target", FIELD_VECTOR, FIELD_REQUIRED, RANGE_POINT, .offset = FIELD_SKIP},
    {"inner", FIELD_NUMBER, FIELD_REQUIRED | FIELD_BELOW, .max = 90,
     .offset = FIELD_SKIP},
    {"outer", FIELD_NUMBER, FIELD_REQUIRED | FIELD_BELOW, .max = 90,
     .offset = FIELD_SKIP},
};
static const struct field area_grid[] = {
    POSITION,
    FALLOFF,
    {"half_size", FIELD_NUMBER, RANGE_LENGTH,
     FIELD_AT(light_fields, light.half_size), .def = {0.5}},
    {"samples", FIELD_INTEGER, .min = 1, .max = 64,
     FIELD_AT(light_fields, light.samples), .def = {4}},
    {"loop", FIELD_ENUM, CHOICES_OF(loops), FIELD_AT(light_fields, loop)},
};

static const struct kind lights[] = {
    {"point", LIGHT_POINT, true, FIELDS_OF(point), NULL},
    {"directional", LIGHT_DIRECTIONAL, true, FIELDS_OF(directional),
     check_directional},
    {"spot", -1, false, FIELDS_OF(spot), check_spot},
    {"area_grid", LIGHT_AREA_GRID, true, FIELDS_OF(area_grid), NULL},
};

const struct family family_light = {
    .noun = "light",
    .common = light_common,
    .common_count = COUNT_OF(light_common),
    .kinds = lights,
    .kind_count = COUNT_OF(lights),
    .finish = finish_light,
};
