/* The document itself, how it is seen and how light is followed (SCENE 3.1 to
 * 3.3). */
#include "core/scene/kinds.h"

#include <math.h>
#include <string.h>

#include "core/scene/scene.h"
#include "core/scene/scene_reader.h"
#include "core/scene/scene_write.h"

/* --- defaults that depend on something else ------------------------------------- */

static bool
given(const struct json *object, const char *key)
{
    return json_member(object, key) != NULL;
}

static bool
fill_fov(const struct json *root, const struct json *camera, double def[4])
{
    (void)root, (void)def;
    return !given(camera, "focal_length") && !given(camera, "window");
}

static bool
fill_distance(const struct json *root, const struct json *camera, double def[4])
{
    (void)root, (void)def;
    return given(camera, "window");
}

static bool
fill_height(const struct json *root, const struct json *camera, double def[4])
{
    (void)root, (void)def;
    return !given(camera, "window");
}

static bool
is_whitted(const struct json *root)
{
    const struct json *integrator = json_member(root, "integrator");
    const struct kind *kind = family_kind_of(&family_integrator, integrator);
    return kind == family_integrator.fallback;
}

static bool
fill_sampler(const struct json *root, const struct json *sampler, double def[4])
{
    (void)sampler;
    def[0] = is_whitted(root) ? SAMPLER_CENTER : SAMPLER_SOBOL;
    return true;
}

static bool
fill_spp(const struct json *root, const struct json *sampler, double def[4])
{
    (void)sampler;
    def[0] = is_whitted(root) ? 1 : 64;
    return true;
}

static bool
is_course(const struct json *integrator)
{
    const char *accumulation = text_of(integrator, "accumulation");
    return accumulation != NULL && strcmp(accumulation, "recursive") != 0;
}

static bool
fill_clamp(const struct json *root, const struct json *integrator,
           double def[4])
{
    (void)root;
    def[0] = is_course(integrator) ? 1 : NAN;
    return true;
}

static bool
fill_inside(const struct json *root, const struct json *integrator,
            double def[4])
{
    (void)root;
    def[0] = is_course(integrator) ? 0 : 1;
    return true;
}

/* --- camera ------------------------------------------------------------------------ */

static const struct choice axes[] = {{"x", 0, true}, {"y", 1, true}};

static const struct field camera_common[] = {
    {"eye", FIELD_VECTOR, RANGE_POINT, FIELD_AT(camera_fields, eye),
     .def = {0, 0, 5}},
    {"target", FIELD_VECTOR, RANGE_POINT, FIELD_AT(camera_fields, target)},
    {"up", FIELD_DIRECTION, FIELD_AT(camera_fields, up), .def = {0, 1, 0}},
    {"near", FIELD_NUMBER, FIELD_NOT_YET, .max = 1e6, .offset = FIELD_SKIP},
    {"far", FIELD_NUMBER, FIELD_NOT_YET | FIELD_NULLABLE | FIELD_NULL,
     .min = 1e-6, .max = 1e6, .offset = FIELD_SKIP},
};

#define PERSPECTIVE_FIELDS                                                     \
    {"fov",                                                                    \
     FIELD_NUMBER,                                                             \
     FIELD_ABOVE | FIELD_BELOW,                                                \
     .max = 180,                                                               \
     FIELD_AT(camera_fields, fov),                                             \
     .def = {45},                                                              \
     .fill = fill_fov},                                                        \
        {"fov_axis",       FIELD_ENUM,                                         \
         CHOICES_OF(axes), FIELD_AT(camera_fields, fov_axis),                  \
         .def = {1},       .fill = fill_fov},                                  \
        {"focal_length", FIELD_NUMBER, FIELD_OPTIONAL, RANGE_LENGTH,           \
         FIELD_AT(camera_fields, focal_length)},                               \
        {"window",                                                             \
         FIELD_VECTOR,                                                         \
         FIELD_OPTIONAL,                                                       \
         .count = 4,                                                           \
         .min = -1e6,                                                          \
         .max = 1e6,                                                           \
         FIELD_AT(camera_fields, window)},                                     \
    {                                                                          \
        "distance", FIELD_NUMBER, RANGE_LENGTH,                                \
            FIELD_AT(camera_fields, distance), .def = {1},                     \
                                               .fill = fill_distance           \
    }

static const struct field perspective[] = {PERSPECTIVE_FIELDS};

static const struct field orthographic[] = {
    {"height", FIELD_NUMBER, RANGE_LENGTH, FIELD_AT(camera_fields, height),
     .def = {2}, .fill = fill_height},
    {"window", FIELD_VECTOR, FIELD_OPTIONAL, .count = 4, .min = -1e6,
     .max = 1e6, FIELD_AT(camera_fields, window)},
};

static const struct field thin_lens[] = {
    PERSPECTIVE_FIELDS,
    {"aperture_radius", FIELD_NUMBER, .max = 1e6, .offset = FIELD_SKIP},
    {"focus_distance", FIELD_NUMBER, FIELD_OPTIONAL, RANGE_LENGTH,
     .offset = FIELD_SKIP},
};

static const struct kind cameras[] = {
    {"perspective", CAMERA_PERSPECTIVE, true, FIELDS_OF(perspective),
     check_perspective},
    {"orthographic", CAMERA_ORTHOGRAPHIC, true, FIELDS_OF(orthographic),
     check_orthographic},
    {"thin_lens", -1, false, FIELDS_OF(thin_lens), check_perspective},
};

const struct family family_camera = {
    .noun = "camera",
    .common = camera_common,
    .common_count = COUNT_OF(camera_common),
    .kinds = cameras,
    .kind_count = COUNT_OF(cameras),
    .fallback = &cameras[0],
    .finish = finish_camera_fields,
};

/* --- film and sampler ----------------------------------------------------------------- */

static const struct choice filters[] = {{"box", 0, true},
                                        {"tent", 1, false},
                                        {"gaussian", 2, false},
                                        {"mitchell", 3, false}};

static const struct field filter[] = {
    {"type", FIELD_ENUM, CHOICES_OF(filters), .offset = FIELD_SKIP},
    {"radius", FIELD_NUMBER, .min = 0.5, .max = 4, .offset = FIELD_SKIP,
     .def = {0.5}},
};
static const struct kind kind_filter = {"filter", 0, true, FIELDS_OF(filter),
                                        check_filter};

static const struct field film[] = {
    {"width", FIELD_INTEGER, .min = 1, .max = 8192, FIELD_AT(scene, width),
     .def = {640}},
    {"height", FIELD_INTEGER, .min = 1, .max = 8192, FIELD_AT(scene, height),
     .def = {360}},
    {"crop", FIELD_VECTOR, FIELD_OPTIONAL | FIELD_NOT_YET, .count = 4,
     .max = 8192, .offset = FIELD_SKIP},
    {"filter", FIELD_PART, .part = &kind_filter, .offset = FIELD_SKIP},
};
const struct kind kind_film = {"film", 0, true, FIELDS_OF(film), check_film};

static const struct choice samplers[] = {
    {"center", SAMPLER_CENTER, true},
    {"independent", SAMPLER_INDEPENDENT, false},
    {"stratified", SAMPLER_STRATIFIED, true},
    {"sobol", SAMPLER_SOBOL, true}};

static const struct field sampler[] = {
    {"type", FIELD_ENUM, CHOICES_OF(samplers), FIELD_AT(scene, sampler.kind),
     .fill = fill_sampler},
    {"spp", FIELD_INTEGER, .min = 1, .max = 65536, FIELD_AT(scene, sampler.spp),
     .fill = fill_spp},
    {"seed", FIELD_INTEGER, .max = 4294967295.0, FIELD_AT(scene, sampler.seed)},
    {"target_error", FIELD_NUMBER,
     FIELD_NOT_YET | FIELD_NULLABLE | FIELD_NULL | FIELD_ABOVE, .max = 1e6,
     .offset = FIELD_SKIP},
};
const struct kind kind_sampler = {"sampler", 0, true, FIELDS_OF(sampler),
                                  check_sampler};

/* --- background ------------------------------------------------------------------------- */

static const struct field constant[] = {
    {"color", FIELD_COLOR, .max = 1e6, FIELD_AT(scene_background, color)},
};
static const struct field gradient[] = {
    {"bottom", FIELD_COLOR, FIELD_REQUIRED, .max = 1e6,
     FIELD_AT(scene_background, color)},
    {"top", FIELD_COLOR, FIELD_REQUIRED, .max = 1e6,
     FIELD_AT(scene_background, top)},
};
static const struct field image[] = {
    {"asset", FIELD_CUSTOM, FIELD_REQUIRED, .offset = FIELD_SKIP,
     .read = read_asset_name},
    {"rotation", FIELD_NUMBER, .min = -1e6, .max = 1e6, .offset = FIELD_SKIP},
};
static const struct kind backgrounds[] = {
    {"constant", BACKGROUND_CONSTANT, true, FIELDS_OF(constant), NULL},
    {"gradient", BACKGROUND_GRADIENT, true, FIELDS_OF(gradient), NULL},
    {"image", -1, false, FIELDS_OF(image), NULL},
};
const struct family family_background = {
    .noun = "background",
    .kinds = backgrounds,
    .kind_count = COUNT_OF(backgrounds),
    .fallback = &backgrounds[0],
    .finish = finish_background,
};

/* --- integrator ------------------------------------------------------------------------------ */

static const struct choice accumulations[] = {
    {"recursive", ACCUMULATION_RECURSIVE, true},
    {"mean", ACCUMULATION_MEAN, true},
    {"fresnel_weighted", ACCUMULATION_FRESNEL_WEIGHTED, true}};
static const struct choice shadow_kinds[] = {{"none", SHADOWS_NONE, true},
                                             {"hard", SHADOWS_HARD, true},
                                             {"soft", SHADOWS_SOFT, true}};
static const struct choice light_samplings[] = {
    {"none", 0, true}, {"nee", 1, true}, {"mis", 2, true}};

/* Stored as two neighbours: fresnel_bias, fresnel_exponent. */
static const struct field fresnel[] = {
    {"bias", FIELD_NUMBER, .max = 1, .offset = 0},
    {"exponent", FIELD_NUMBER, .max = 16,
     .offset = offsetof(struct scene_integrator, fresnel_exponent) -
               offsetof(struct scene_integrator, fresnel_bias),
     .def = {2}},
};
static const struct kind kind_fresnel = {"fresnel", 0, true, FIELDS_OF(fresnel),
                                         NULL};

static bool
fill_fresnel(const struct json *root, const struct json *integrator,
             double def[4])
{
    (void)root, (void)def;
    return is_text(json_member(integrator, "accumulation"), "fresnel_weighted");
}

static const struct field roulette[] = {
    {"start", FIELD_INTEGER, .min = 1, .max = 64, .offset = FIELD_SKIP,
     .def = {4}},
};
static const struct kind kind_roulette = {"russian_roulette", 0, true,
                                          FIELDS_OF(roulette), NULL};

static const struct field integrator_common[] = {
    {"ray_offset", FIELD_NUMBER, .max = 1,
     FIELD_AT(scene_integrator, ray_offset), .def = {1e-4}},
};
static const struct field whitted[] = {
    {"max_bounces", FIELD_INTEGER, .max = 64,
     FIELD_AT(scene_integrator, max_bounces), .def = {4}},
    {"accumulation", FIELD_ENUM, CHOICES_OF(accumulations),
     FIELD_AT(scene_integrator, accumulation)},
    {"ambient", FIELD_COLOR, .max = 1e6, FIELD_AT(scene_integrator, ambient),
     .def = {0.1, 0.1, 0.1}},
    {"shadows", FIELD_ENUM, CHOICES_OF(shadow_kinds),
     FIELD_AT(scene_integrator, shadows), .def = {SHADOWS_SOFT}},
    {"clamp_local", FIELD_NUMBER, FIELD_NULLABLE | FIELD_ABOVE, .max = 1e6,
     FIELD_AT(scene_integrator, clamp_local), .fill = fill_clamp},
    {"fresnel", FIELD_PART, .part = &kind_fresnel,
     FIELD_AT(scene_integrator, fresnel_bias), .fill = fill_fresnel},
    {"inside_hits", FIELD_BOOL, FIELD_AT(scene_integrator, inside_hits),
     .fill = fill_inside},
};
static const struct field path[] = {
    {"max_bounces", FIELD_INTEGER, .max = 64,
     FIELD_AT(scene_integrator, max_bounces), .def = {8}},
    {"light_sampling", FIELD_ENUM, CHOICES_OF(light_samplings),
     .offset = FIELD_SKIP, .def = {2}},
    {"russian_roulette", FIELD_PART, FIELD_NULLABLE, .part = &kind_roulette,
     .offset = FIELD_SKIP},
    {"clamp_indirect", FIELD_NUMBER,
     FIELD_NOT_YET | FIELD_NULLABLE | FIELD_NULL | FIELD_ABOVE, .max = 1e6,
     .offset = FIELD_SKIP},
};
static const struct field ao[] = {
    {"distance", FIELD_NUMBER, FIELD_NULLABLE | FIELD_NULL, RANGE_LENGTH,
     .offset = FIELD_SKIP},
};
static const struct kind integrators[] = {
    {"whitted", INTEGRATOR_WHITTED, true, FIELDS_OF(whitted), check_whitted},
    {"path", -1, false, FIELDS_OF(path), NULL},
    {"ao", -1, false, FIELDS_OF(ao), NULL},
};
const struct family family_integrator = {
    .noun = "integrator",
    .common = integrator_common,
    .common_count = COUNT_OF(integrator_common),
    .kinds = integrators,
    .kind_count = COUNT_OF(integrators),
    .fallback = &integrators[0],
    .finish = finish_integrator,
};

/* --- the document ------------------------------------------------------------------------------ */

static const struct field document[] = {
    {"version", FIELD_INTEGER, .min = 1, .max = 1, .offset = FIELD_SKIP,
     .def = {1}},
    {"name", FIELD_TEXT, FIELD_OPTIONAL, .count = 64, FIELD_AT(scene, name)},
    {"description", FIELD_TEXT, FIELD_OPTIONAL | FIELD_DROPPED,
     .count = LIMIT_TEXT, .offset = FIELD_SKIP},
    {"extras", FIELD_CUSTOM, FIELD_OPTIONAL | FIELD_DROPPED,
     .offset = FIELD_SKIP, .read = read_extras},
    {"time", FIELD_NUMBER, FIELD_NOT_YET, .max = 1e6, .offset = FIELD_SKIP},
    {"camera", FIELD_FAMILY, .family = &family_camera, .offset = FIELD_SKIP},
    {"film", FIELD_PART, .part = &kind_film, .offset = 0},
    {"sampler", FIELD_PART, .part = &kind_sampler, .offset = 0},
    {"integrator", FIELD_FAMILY, .family = &family_integrator,
     .offset = FIELD_SKIP},
    {"background", FIELD_FAMILY, .family = &family_background,
     .offset = FIELD_SKIP},
    {"assets", FIELD_CUSTOM, .offset = FIELD_SKIP, .read = read_assets,
     .write = write_assets},
    {"textures", FIELD_LIST, FIELD_NAMED, .family = &family_texture,
     .count = LIMIT_SURFACES, .offset = FIELD_SKIP},
    {"materials", FIELD_LIST, FIELD_NAMED, .family = &family_material,
     .count = LIMIT_SURFACES, .offset = FIELD_SKIP},
    {"lights", FIELD_CUSTOM, .offset = FIELD_SKIP, .read = read_lights,
     .write = write_lights},
    {"definitions", FIELD_CUSTOM, FIELD_OPTIONAL | FIELD_NOT_YET,
     .offset = FIELD_SKIP, .read = read_definitions},
    {"objects", FIELD_CUSTOM, FIELD_REQUIRED, .offset = FIELD_SKIP,
     .read = read_objects, .write = write_objects},
};
const struct kind kind_scene = {"scene", 0, true, FIELDS_OF(document), NULL};
