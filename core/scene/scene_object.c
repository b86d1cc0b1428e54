/* Objects: groups, transforms, relations of each shape, and the struct. */
#include "core/scene/scene_reader.h"

#include <math.h>
#include <string.h>

#include "core/scene/transform.h"

/* --- transforms ------------------------------------------------------------------ */

/* Entries of a whole transform, groups included, stay below this. */
#define LIMIT_ENTRY 1e9

static void
check_scale(struct reader *r, const struct json *scale)
{
    const struct json *first = scale->type == JSON_ARRAY ? scale->child : scale;
    for (const struct json *n = first; n != NULL; n = n->next) {
        if (n->type == JSON_NUMBER && n->number == 0)
            fault(r, ERROR_TRANSFORM_SINGULAR, n, NULL, NULL,
                  "a scale must not be 0");
        if (n == scale)
            break;
    }
}

static void
check_matrix(struct reader *r, const struct json *matrix, const double m[16])
{
    static const double last_row[4] = {0, 0, 0, 1};
    const struct json *n = matrix->child;
    for (int i = 0; i < 16; i++, n = n->next) {
        if (i >= 12 && m[i] != last_row[i - 12])
            fault(r,
                  m[i] < last_row[i - 12] ? ERROR_NUMBER_TOO_SMALL
                                          : ERROR_NUMBER_TOO_LARGE,
                  n, "the 16 numbers are written row by row",
                  fix_number(r, n, last_row[i - 12]),
                  "the last row of a matrix is 0 0 0 1, got %s",
                  number_said(r, m[i]));
    }
    if (!transform_regular(m))
        fault(r, ERROR_TRANSFORM_SINGULAR, matrix, NULL, NULL,
              "the matrix cannot be inverted");
}

void
check_step(struct reader *r, const struct json *object, void *to)
{
    static const char *const names[] = {"translate", "rotate", "scale",
                                        "matrix", "bounce"};
    double m[16];
    (void)to;
    if (object->count == 0)
        fault(r, ERROR_PROPERTY_MISSING, object,
              "one of `translate`, `rotate`, `scale`, `matrix`", NULL,
              "a transform step has one key");
    check_one_of(r, object, names, COUNT_OF(names));
    const struct json *scale = json_member(object, "scale");
    if (scale != NULL)
        check_scale(r, scale);
    if (numbers_of(object, "matrix", 16, m))
        check_matrix(r, json_member(object, "matrix"), m);
}

/* One step as a map; false if something is wrong with it. */
static bool
step_matrix(struct reader *r, const struct json *step, double m[12])
{
    struct step_fields f = {.scale = {1, 1, 1}};
    uint32_t before = r->faults;
    read_members(r, step, NULL, &kind_step, &f);
    transform_identity(m);
    if (r->faults != before)
        return false;
    if (json_member(step, "matrix") != NULL) {
        memcpy(m, f.matrix, 12 * sizeof(double));
    } else if (json_member(step, "rotate") != NULL) {
        transform_rotation(f.axis, f.angle, m);
    } else {
        for (int i = 0; i < 3; i++) {
            m[5 * i] = f.scale[i];
            m[4 * i + 3] = f.translate[i];
        }
    }
    return true;
}

void
read_transform(struct reader *r, const struct json *value,
               const struct field *field, void *to)
{
    double m[12], step[12];
    bool good = true;
    transform_identity(m);
    if (value != NULL && value->type != JSON_ARRAY) {
        fault_type(r, value, "an array of steps");
    } else if (value != NULL) {
        for (const struct json *n = value->child; n != NULL; n = n->next) {
            good = step_matrix(r, n, step) && good;
            transform_multiply(step, m, m);
        }
    }
    if (!good)
        transform_identity(m);
    if (field->offset != FIELD_SKIP)
        memcpy((char *)to + field->offset, m, sizeof m);
}

/* The object's own transform inside of its groups'. */
static void
compose(struct reader *r, const struct json *object, const double own[12],
        double world[12])
{
    const struct json *transform = json_member(object, "transform");
    transform_multiply(r->context->to_world, own, world);
    if (transform == NULL)
        return;
    if (!transform_within(world, LIMIT_ENTRY))
        fault(r, ERROR_NUMBER_TOO_LARGE, transform,
              "keep the numbers of the whole transform, groups included, "
              "within 1e-9 ... 1e9",
              NULL, "the steps together move or scale too far");
    else if (!transform_regular(world))
        fault(r, ERROR_TRANSFORM_SINGULAR, transform, NULL, NULL,
              "the steps together cannot be inverted");
}

static bool
is_identity(const double m[12])
{
    double identity[12];
    transform_identity(identity);
    for (int i = 0; i < 12; i++) {
        if (m[i] != identity[i])
            return false;
    }
    return true;
}

/* --- the tree ----------------------------------------------------------------------- */

static uint32_t
count_drawn(const struct json *array)
{
    uint32_t count = 0;
    if (array == NULL || array->type != JSON_ARRAY)
        return 0;
    for (const struct json *n = array->child; n != NULL; n = n->next) {
        if (is_text(json_member(n, "type"), "group"))
            count += count_drawn(json_member(n, "children"));
        else
            count++;
    }
    return count;
}

/* Read one object below r->context. */
static void
read_object(struct reader *r, const struct json *value, const char *path)
{
    const char *outer = r->path;
    r->path = or_word(path);
    read_family_value(r, value, &family_shape);
    r->path = outer;
}

static void
read_array(struct reader *r, const struct json *value,
           struct object_context *context)
{
    struct object_context *outer = r->context;
    uint32_t i = 0;
    if (value->count == 0) {
        fault(r, ERROR_ARRAY_LENGTH, value, NULL, NULL,
              "at least one object, got none");
        return;
    }
    r->context = context;
    for (const struct json *n = value->child; n != NULL; n = n->next) {
        if (r->arena->failed)
            break;
        read_object(r, n, arena_printf(r->arena, "%s/%u", context->path, i));
        i++;
    }
    r->context = outer;
}

static struct object_context
top_context(const char *path, bool drawn)
{
    struct object_context top = {
        .path = path,
        .material = SCENE_NONE,
        .visible = VISIBLE_CAMERA | VISIBLE_SHADOW | VISIBLE_REFLECTION,
        .drawn = drawn,
    };
    transform_identity(top.to_world);
    return top;
}

static void
read_children(struct reader *r, const struct json *value,
              const struct scene_object *group)
{
    const struct json *object = value->parent;
    struct object_context inner = *r->context;
    inner.path = or_word(arena_printf(r->arena, "%s/children", r->path));
    inner.depth++;
    if (inner.depth > LIMIT_NESTING) {
        fault(r, ERROR_BUDGET_DEPTH, object, NULL, NULL,
              "groups are nested %u deep, at most %d", inner.depth,
              LIMIT_NESTING);
        return;
    }
    compose(r, object, group->to_world, inner.to_world);
    if (group->material != SCENE_NONE)
        inner.material = group->material;
    inner.visible &= group->visible;
    read_array(r, value, &inner);
}

void
read_objects(struct reader *r, const struct json *value,
             const struct field *field, void *to)
{
    if (value == NULL)
        return;
    if (value->type != JSON_ARRAY) {
        fault_type(r, value, "an array of objects");
        return;
    }
    if (strcmp(field->name, "children") == 0) {
        read_children(r, value, to);
        return;
    }
    uint32_t count = count_drawn(value);
    if (count > LIMIT_OBJECTS) {
        fault(r, ERROR_BUDGET_OBJECTS, value,
              "many small triangles are one `mesh`", NULL,
              "%u objects, at most %d", count, LIMIT_OBJECTS);
        return;
    }
    struct object_context top = top_context("/objects", true);
    read_array(r, value, &top);
}

void
read_definitions(struct reader *r, const struct json *value,
                 const struct field *field, void *to)
{
    struct object_context top = top_context("/definitions", false);
    (void)field, (void)to;
    if (value == NULL)
        return;
    if (value->type != JSON_ARRAY) {
        fault_type(r, value, "an array of objects");
        return;
    }
    if (value->count > LIMIT_SURFACES) {
        fault(r, ERROR_BUDGET_LIST, value, NULL, NULL,
              "%u definitions, at most %d", value->count, LIMIT_SURFACES);
        return;
    }
    for (const struct json *n = value->child; n != NULL; n = n->next) {
        if (n->type == JSON_OBJECT && json_member(n, "name") == NULL)
            fault(r, ERROR_PROPERTY_MISSING, n, "add `name`", NULL,
                  "a definition needs `name`");
    }
    if (value->count > 0)
        read_array(r, value, &top);
}

void
finish_object(struct reader *r, const struct json *object,
              const struct kind *kind, void *to)
{
    struct scene_object made = *(const struct scene_object *)to;
    const struct object_context *context = r->context;
    const struct json *name = json_member(object, "name");

    if (name != NULL && name->type == JSON_STRING && context->drawn)
        names_add(&r->objects, name, 0, r->arena);
    if (kind->value == OBJECT_GROUP || !kind->ready || !context->drawn)
        return;
    made.kind = (enum shape_kind)kind->value;
    made.pointer = r->path;
    made.visible &= context->visible;
    if (made.material == SCENE_NONE)
        made.material = context->material;
    if (made.material == SCENE_NONE)
        made.material = default_material(r);
    compose(r, object, made.to_world, made.to_world);
    made.transformed = !is_identity(made.to_world);
    r->scene->triangle_count += kind->value == SHAPE_TRIANGLE;
    reader_push(r, &r->object_items, &made, sizeof made);
}

/* --- csg, instances, distance fields: checked, not drawn yet ------------------------------ */

static bool
is_closed(const struct json *object, const struct json **culprit)
{
    static const char *const closed[] = {"sphere",  "box",   "cylinder", "cone",
                                         "capsule", "torus", "csg",      "sdf"};
    const struct json *type = json_member(object, "type");
    const struct json *caps = json_member(object, "caps");
    *culprit = type;
    if (type == NULL || family_kind_of(&family_shape, object) == NULL)
        return true; /* said elsewhere */
    if (caps != NULL && caps->type == JSON_FALSE) {
        *culprit = caps;
        return false;
    }
    for (size_t i = 0; i < COUNT_OF(closed); i++) {
        if (is_text(type, closed[i]))
            return true;
    }
    return false;
}

void
read_operand(struct reader *r, const struct json *value,
             const struct field *field, void *to)
{
    struct object_context inner = *r->context, *outer = r->context;
    const struct json *culprit;
    (void)to;
    if (value == NULL)
        return;
    inner.depth++;
    inner.drawn = false;
    if (inner.depth > LIMIT_NESTING) {
        fault(r, ERROR_BUDGET_DEPTH, value, NULL, NULL,
              "csg is nested %u deep, at most %d", inner.depth, LIMIT_NESTING);
        return;
    }
    if (!is_closed(value, &culprit))
        fault(r, ERROR_CSG_OPEN_OPERAND, culprit, "operands are closed shapes",
              NULL, "a `%s` %s has no inside", text_of(value, "type"),
              culprit->key);
    r->context = &inner;
    read_object(r, value,
                arena_printf(r->arena, "%s/%s", r->path, field->name));
    r->context = outer;
}

void
read_definition_name(struct reader *r, const struct json *value,
                     const struct field *field, void *to)
{
    const char *name;
    (void)field, (void)to;
    if (value != NULL && read_name(r, value, &name) &&
        names_find(&r->definitions, name) == NULL)
        fault_reference(r, value, "definition", &r->definitions);
}

void
read_node(struct reader *r, const struct json *value, const struct field *field,
          void *to)
{
    (void)to;
    if (value == NULL)
        return;
    if (strcmp(field->name, "root") == 0)
        r->sdf_depth = r->sdf_nodes = 0;
    if (r->sdf_depth == LIMIT_NESTING) {
        fault(r, ERROR_BUDGET_DEPTH, value, NULL, NULL,
              "nodes are nested more than %d deep", LIMIT_NESTING);
        return;
    }
    if (++r->sdf_nodes == LIMIT_SDF_NODES + 1)
        fault(r, ERROR_BUDGET_OBJECTS, value, NULL, NULL,
              "more than %d nodes in one distance field", LIMIT_SDF_NODES);
    r->sdf_depth++;
    read_family_value(r, value, &family_sdf);
    r->sdf_depth--;
}

void
read_nodes(struct reader *r, const struct json *value,
           const struct field *field, void *to)
{
    if (value == NULL)
        return;
    if (value->type != JSON_ARRAY) {
        fault_type(r, value, "an array of nodes");
        return;
    }
    if (value->count == 0)
        fault(r, ERROR_ARRAY_LENGTH, value, NULL, NULL,
              "at least one node, got none");
    for (const struct json *n = value->child; n != NULL; n = n->next)
        read_node(r, n, field, to);
}

void
finish_sdf(struct reader *r, const struct json *object, const struct kind *kind,
           void *to)
{
    const struct scene_object *node = to;
    const struct json *transform = json_member(object, "transform");
    (void)kind;
    if (transform != NULL && !transform_uniform(node->to_world))
        fault(r, ERROR_TRANSFORM_NOT_UNIFORM, transform,
              "a distance field keeps its distances: scale all axes alike",
              NULL, "the transform of a distance field node is not uniform");
}
