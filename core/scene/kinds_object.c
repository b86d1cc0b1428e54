/* Objects, the nodes of distance fields, and transform steps (SCENE 2, 3.7). */
#include "core/scene/kinds.h"

#include "core/scene/scene.h"
#include "core/scene/scene_reader.h"
#include "core/scene/scene_write.h"

/* --- transform steps -------------------------------------------------------------- */

static const struct field rotate[] = {
    {"axis", FIELD_DIRECTION, FIELD_REQUIRED, FIELD_AT(step_fields, axis)},
    {"angle", FIELD_NUMBER, FIELD_REQUIRED, .min = -1e6, .max = 1e6,
     FIELD_AT(step_fields, angle)},
};
static const struct kind kind_rotate = {"rotate", 0, true, FIELDS_OF(rotate),
                                        NULL};
static const struct field bounce[] = {
    {"height", FIELD_NUMBER, FIELD_REQUIRED, .max = 1e6, .offset = FIELD_SKIP},
    {"period", FIELD_NUMBER, FIELD_REQUIRED, RANGE_LENGTH,
     .offset = FIELD_SKIP},
};
static const struct kind kind_bounce = {"bounce", 0, true, FIELDS_OF(bounce),
                                        NULL};
static const struct field step[] = {
    {"translate", FIELD_VECTOR, FIELD_OPTIONAL, RANGE_POINT,
     FIELD_AT(step_fields, translate)},
    {"rotate", FIELD_PART, FIELD_OPTIONAL, .part = &kind_rotate, .offset = 0},
    {"scale", FIELD_SCALE, FIELD_OPTIONAL, RANGE_POINT,
     FIELD_AT(step_fields, scale)},
    {"matrix", FIELD_VECTOR, FIELD_OPTIONAL, .count = 16, .min = -1e6,
     .max = 1e6, FIELD_AT(step_fields, matrix)},
    {"bounce", FIELD_PART, FIELD_OPTIONAL | FIELD_NOT_YET, .part = &kind_bounce,
     .offset = 0},
};
const struct kind kind_step = {"transform step", 0, true, FIELDS_OF(step),
                               check_step};

/* --- objects ------------------------------------------------------------------------ */

/* FIELD_BOOL with a count sets that bit of the unsigned. */
static const struct field visible[] = {
    {"camera", FIELD_BOOL, .count = VISIBLE_CAMERA, .def = {1}},
    {"shadow", FIELD_BOOL, .count = VISIBLE_SHADOW, .def = {1}},
    {"reflection", FIELD_BOOL, .count = VISIBLE_REFLECTION, .def = {1}},
};
static const struct kind kind_visible = {"visible", 0, true, FIELDS_OF(visible),
                                         NULL};

static const struct field object_common[] = {
    {"name", FIELD_NAME, FIELD_OPTIONAL, FIELD_AT(scene_object, name)},
    {"material", FIELD_CUSTOM, FIELD_AT(scene_object, material),
     .read = read_material, .write = write_material},
    {"transform", FIELD_CUSTOM, FIELD_AT(scene_object, to_world),
     .read = read_transform, .write = write_transform},
    {"visible", FIELD_PART, .part = &kind_visible,
     FIELD_AT(scene_object, visible)},
};

#define POINT_REQUIRED(key)                                                    \
    {                                                                          \
        key, FIELD_VECTOR, FIELD_REQUIRED, RANGE_POINT, .offset = FIELD_SKIP   \
    }
#define LENGTH_REQUIRED(key)                                                   \
    {                                                                          \
        key, FIELD_NUMBER, FIELD_REQUIRED, RANGE_LENGTH, .offset = FIELD_SKIP  \
    }

static const struct field sphere[] = {
    {"center", FIELD_VECTOR, RANGE_POINT,
     FIELD_AT(scene_object, shape.sphere.center)},
    {"radius", FIELD_NUMBER, RANGE_LENGTH,
     FIELD_AT(scene_object, shape.sphere.radius), .def = {1}},
};
static const struct field box[] = {
    {"min", FIELD_VECTOR, FIELD_REQUIRED, RANGE_POINT,
     FIELD_AT(scene_object, shape.box.min)},
    {"max", FIELD_VECTOR, FIELD_REQUIRED, RANGE_POINT,
     FIELD_AT(scene_object, shape.box.max)},
};

static bool
fill_offset(const struct json *root, const struct json *plane, double def[4])
{
    (void)root, (void)def;
    return json_member(plane, "point") == NULL;
}

static const struct field plane[] = {
    {"normal", FIELD_DIRECTION, FIELD_AT(scene_object, shape.plane.normal),
     .def = {0, 1, 0}},
    {"offset", FIELD_NUMBER, .min = -1e6, .max = 1e6,
     FIELD_AT(scene_object, shape.plane.offset), .fill = fill_offset},
    {"point", FIELD_VECTOR, FIELD_OPTIONAL, RANGE_POINT, .offset = FIELD_SKIP},
};
static const struct field triangle[] = {
    {"vertices", FIELD_CUSTOM, FIELD_REQUIRED, .count = 3,
     FIELD_AT(scene_object, shape.triangle.vertices), .read = read_vertices,
     .write = write_numbers},
    {"normals", FIELD_CUSTOM, FIELD_OPTIONAL, .count = 3,
     FIELD_AT(scene_object, shape.triangle.normals), .read = read_vertices,
     .write = write_numbers},
    {"uvs", FIELD_CUSTOM, FIELD_OPTIONAL, .count = 2,
     FIELD_AT(scene_object, shape.triangle.uvs), .read = read_vertices,
     .write = write_numbers},
};
static const struct field quad[] = {
    {"origin", FIELD_VECTOR, FIELD_REQUIRED, RANGE_POINT,
     FIELD_AT(scene_object, shape.quad.origin)},
    {"edge_u", FIELD_DIRECTION, FIELD_REQUIRED,
     FIELD_AT(scene_object, shape.quad.edge_u)},
    {"edge_v", FIELD_DIRECTION, FIELD_REQUIRED,
     FIELD_AT(scene_object, shape.quad.edge_v)},
};
static const struct field disk[] = {
    POINT_REQUIRED("center"),
    {"normal", FIELD_DIRECTION, FIELD_REQUIRED, .offset = FIELD_SKIP},
    LENGTH_REQUIRED("radius"),
    {"inner_radius", FIELD_NUMBER, .max = 1e6, .offset = FIELD_SKIP},
};
static const struct field cylinder[] = {
    POINT_REQUIRED("from"),
    POINT_REQUIRED("to"),
    LENGTH_REQUIRED("radius"),
    {"caps", FIELD_BOOL, .offset = FIELD_SKIP, .def = {1}},
};
static const struct field cone[] = {
    POINT_REQUIRED("from"),
    POINT_REQUIRED("to"),
    LENGTH_REQUIRED("radius"),
    {"radius_to", FIELD_NUMBER, .max = 1e6, .offset = FIELD_SKIP},
    {"caps", FIELD_BOOL, .offset = FIELD_SKIP, .def = {1}},
};
static const struct field capsule[] = {
    POINT_REQUIRED("from"),
    POINT_REQUIRED("to"),
    LENGTH_REQUIRED("radius"),
};
static const struct field torus[] = {
    {"center", FIELD_VECTOR, RANGE_POINT, .offset = FIELD_SKIP},
    {"axis", FIELD_DIRECTION, .offset = FIELD_SKIP, .def = {0, 1, 0}},
    LENGTH_REQUIRED("major_radius"),
    LENGTH_REQUIRED("minor_radius"),
};

static bool
fill_smooth(const struct json *root, const struct json *mesh, double def[4])
{
    (void)root;
    def[0] = json_member(mesh, "normals") != NULL;
    return true;
}

static const struct field mesh[] = {
    {"positions", FIELD_CUSTOM, FIELD_OPTIONAL, .offset = FIELD_SKIP,
     .read = read_positions, .write = write_numbers},
    {"indices", FIELD_CUSTOM, FIELD_OPTIONAL, .offset = FIELD_SKIP,
     .read = read_indices, .write = write_numbers},
    {"normals", FIELD_CUSTOM, FIELD_OPTIONAL, .offset = FIELD_SKIP,
     .read = read_mesh_normals, .write = write_numbers},
    {"uvs", FIELD_CUSTOM, FIELD_OPTIONAL, .offset = FIELD_SKIP,
     .read = read_mesh_uvs, .write = write_numbers},
    {"asset", FIELD_CUSTOM, FIELD_OPTIONAL | FIELD_NOT_YET,
     .offset = FIELD_SKIP, .read = read_asset_name},
    {"smooth", FIELD_BOOL, FIELD_AT(scene_object, shape.mesh.smooth),
     .fill = fill_smooth},
};

static const struct choice march_normals[] = {{"central_difference", 0, true}};
static const struct choice exhausted[] = {{"hit", 0, true}, {"miss", 1, true}};
static const struct field march[] = {
    {"max_steps", FIELD_INTEGER, .min = 1, .max = 4096, .offset = FIELD_SKIP,
     .def = {256}},
    {"epsilon", FIELD_NUMBER, RANGE_LENGTH, .offset = FIELD_SKIP,
     .def = {1e-4}},
    {"near", FIELD_NUMBER, .max = 1e6, .offset = FIELD_SKIP, .def = {0.01}},
    {"far", FIELD_NUMBER, RANGE_LENGTH, .offset = FIELD_SKIP, .def = {100}},
    {"normal", FIELD_ENUM, CHOICES_OF(march_normals), .offset = FIELD_SKIP},
    {"normal_epsilon", FIELD_NUMBER, RANGE_LENGTH, .offset = FIELD_SKIP,
     .def = {1e-3}},
    {"on_exhausted", FIELD_ENUM, CHOICES_OF(exhausted), .offset = FIELD_SKIP},
};
static const struct kind kind_march = {"march", 0, true, FIELDS_OF(march),
                                       NULL};
static const struct field sdf[] = {
    {"root", FIELD_CUSTOM, FIELD_REQUIRED, .offset = FIELD_SKIP,
     .read = read_node},
    {"march", FIELD_PART, .part = &kind_march, .offset = 0},
};
static const struct field group[] = {
    {"children", FIELD_CUSTOM, FIELD_REQUIRED | FIELD_LATE,
     .offset = FIELD_SKIP, .read = read_objects, .write = write_objects},
};
static const struct field instance[] = {
    {"of", FIELD_CUSTOM, FIELD_REQUIRED, .offset = FIELD_SKIP,
     .read = read_definition_name},
};
static const struct choice operations[] = {
    {"union", 0, true}, {"intersection", 1, true}, {"difference", 2, true}};
static const struct field csg[] = {
    {"operation", FIELD_ENUM, FIELD_REQUIRED, CHOICES_OF(operations),
     .offset = FIELD_SKIP},
    {"left", FIELD_CUSTOM, FIELD_REQUIRED, .offset = FIELD_SKIP,
     .read = read_operand},
    {"right", FIELD_CUSTOM, FIELD_REQUIRED, .offset = FIELD_SKIP,
     .read = read_operand},
};

static const struct kind shapes[] = {
    {"sphere", SHAPE_SPHERE, true, FIELDS_OF(sphere), NULL},
    {"box", SHAPE_BOX, true, FIELDS_OF(box), check_box},
    {"plane", SHAPE_PLANE, true, FIELDS_OF(plane), check_plane},
    {"triangle", SHAPE_TRIANGLE, true, FIELDS_OF(triangle), check_triangle},
    {"quad", SHAPE_QUAD, true, FIELDS_OF(quad), check_quad},
    {"disk", -1, false, FIELDS_OF(disk), check_disk},
    {"cylinder", -1, false, FIELDS_OF(cylinder), check_axis},
    {"cone", -1, false, FIELDS_OF(cone), check_axis},
    {"capsule", -1, false, FIELDS_OF(capsule), check_axis},
    {"torus", -1, false, FIELDS_OF(torus), check_torus},
    {"mesh", SHAPE_MESH, true, FIELDS_OF(mesh), check_mesh},
    {"sdf", -1, false, FIELDS_OF(sdf), NULL},
    {"group", OBJECT_GROUP, true, FIELDS_OF(group), NULL},
    {"instance", -1, false, FIELDS_OF(instance), NULL},
    {"csg", -1, false, FIELDS_OF(csg), NULL},
};

const struct family family_shape = {
    .noun = "shape",
    .common = object_common,
    .common_count = COUNT_OF(object_common),
    .kinds = shapes,
    .kind_count = COUNT_OF(shapes),
    .finish = finish_object,
};

/* --- distance fields ------------------------------------------------------------------ */

/* `ready` here means: as soon as sdf itself is. */
static const struct field node_common[] = {
    {"name", FIELD_NAME, FIELD_OPTIONAL, .offset = FIELD_SKIP},
    {"material", FIELD_CUSTOM, FIELD_OPTIONAL, .offset = FIELD_SKIP,
     .read = read_material},
    {"transform", FIELD_CUSTOM, FIELD_AT(scene_object, to_world),
     .read = read_transform},
};
static const struct field node_sphere[] = {LENGTH_REQUIRED("radius")};
static const struct field node_box[] = {
    {"half_size", FIELD_VECTOR, FIELD_REQUIRED, .count = 3, RANGE_LENGTH,
     .offset = FIELD_SKIP},
};
static const struct field node_plane[] = {
    {"normal", FIELD_DIRECTION, .offset = FIELD_SKIP, .def = {0, 1, 0}},
    {"offset", FIELD_NUMBER, .min = -1e6, .max = 1e6, .offset = FIELD_SKIP},
};
static const struct field node_torus[] = {
    LENGTH_REQUIRED("major_radius"),
    LENGTH_REQUIRED("minor_radius"),
};
static const struct field node_cylinder[] = {
    LENGTH_REQUIRED("radius"),
    LENGTH_REQUIRED("half_height"),
};
#define NODE(key)                                                              \
    {                                                                          \
        key, FIELD_CUSTOM, FIELD_REQUIRED, .offset = FIELD_SKIP,               \
                                           .read = read_node                   \
    }
#define NODES                                                                  \
    {                                                                          \
        "children", FIELD_CUSTOM, FIELD_REQUIRED, .offset = FIELD_SKIP,        \
                                                  .read = read_nodes           \
    }
static const struct field node_many[] = {NODES};
static const struct field node_pair[] = {NODE("left"), NODE("right")};
static const struct field node_smooth_many[] = {NODES, LENGTH_REQUIRED("k")};
static const struct field node_smooth_pair[] = {NODE("left"), NODE("right"),
                                                LENGTH_REQUIRED("k")};
static const struct field node_repeat[] = {
    NODE("child"),
    {"period", FIELD_VECTOR, FIELD_REQUIRED, .count = 3, .max = 1e6,
     .offset = FIELD_SKIP},
};

static const struct kind nodes[] = {
    {"sphere", 0, true, FIELDS_OF(node_sphere), NULL},
    {"box", 0, true, FIELDS_OF(node_box), NULL},
    {"plane", 0, true, FIELDS_OF(node_plane), NULL},
    {"torus", 0, true, FIELDS_OF(node_torus), check_torus},
    {"capsule", 0, true, FIELDS_OF(capsule), check_axis},
    {"union", 0, true, FIELDS_OF(node_many), NULL},
    {"intersection", 0, true, FIELDS_OF(node_many), NULL},
    {"difference", 0, true, FIELDS_OF(node_pair), NULL},
    {"cylinder", -1, false, FIELDS_OF(node_cylinder), NULL},
    {"smooth_union", -1, false, FIELDS_OF(node_smooth_many), NULL},
    {"smooth_intersection", -1, false, FIELDS_OF(node_smooth_many), NULL},
    {"smooth_difference", -1, false, FIELDS_OF(node_smooth_pair), NULL},
    {"repeat", -1, false, FIELDS_OF(node_repeat), NULL},
};

const struct family family_sdf = {
    .noun = "distance field node",
    .common = node_common,
    .common_count = COUNT_OF(node_common),
    .kinds = nodes,
    .kind_count = COUNT_OF(nodes),
    .finish = finish_sdf,
};
