/* Inline meshes: arrays of triples into flat arrays, and their relations. */
#include "core/scene/scene_reader.h"

#include <math.h>

#include "core/scene/transform.h"

/* An array of at least `least` entries; NULL after an error. */
static const struct json *
entries(struct reader *r, const struct json *value, uint32_t least,
        const char *noun)
{
    if (value->type != JSON_ARRAY) {
        fault_type(r, value,
                   or_word(arena_printf(r->arena, "an array of %s", noun)));
        return NULL;
    }
    if (value->count < least) {
        fault(r, ERROR_ARRAY_LENGTH, value, NULL, NULL,
              "at least %u %s, got %u", least, noun, value->count);
        return NULL;
    }
    /* A flat array is the commonest slip; one error says it, not thousands. */
    if (value->child != NULL && value->child->type == JSON_NUMBER) {
        fault(r, ERROR_TYPE_MISMATCH, value->child,
              "write one array per entry: [[0, 1, 2], [0, 2, 3]]", NULL,
              "must be an array, got %s",
              can_tell(r) ? json_describe(value->child, r->arena) : "a number");
        return NULL;
    }
    return value->child;
}

/* Vectors of `width` numbers as floats, in the arena. */
static float *
floats(struct reader *r, const struct json *value, uint32_t width,
       uint32_t least, const char *noun, const char *nouns)
{
    const struct json *n = entries(r, value, least, nouns);
    if (n == NULL)
        return NULL;
    float *out = arena_array(r->arena, value->count, width * sizeof(float));
    if (out == NULL)
        return NULL;
    float *at = out;
    for (; n != NULL; n = n->next, at += width) {
        double numbers[3] = {0};
        if (!read_numbers(r, n, width, 1e6, noun, numbers))
            continue;
        for (uint32_t i = 0; i < width; i++)
            at[i] = (float)numbers[i];
    }
    return out;
}

void
read_positions(struct reader *r, const struct json *value,
               const struct field *field, void *to)
{
    (void)field, (void)to;
    if (value == NULL)
        return;
    r->mesh.positions = floats(r, value, 3, 3, "a position", "positions");
    if (value->type == JSON_ARRAY)
        r->mesh.position_count = value->count;
}

void
read_mesh_uvs(struct reader *r, const struct json *value,
              const struct field *field, void *to)
{
    (void)field, (void)to;
    if (value != NULL)
        r->mesh.uvs = floats(r, value, 2, 0, "a pair u, v", "pairs");
}

void
read_mesh_normals(struct reader *r, const struct json *value,
                  const struct field *field, void *to)
{
    (void)field, (void)to;
    if (value == NULL)
        return;
    const struct json *n = entries(r, value, 0, "normals");
    if (n == NULL)
        return;
    float *at = arena_array(r->arena, value->count, 3 * sizeof(float));
    r->mesh.normals = at;
    for (; n != NULL && at != NULL; n = n->next, at += 3) {
        double normal[3] = {0};
        if (!read_numbers(r, n, 3, 1e6, "a normal", normal))
            continue;
        if (vector_length(normal) == 0) {
            fault(r, ERROR_VECTOR_ZERO, n, NULL, NULL,
                  "a normal must not be the zero vector");
            continue;
        }
        vector_unit(normal, normal);
        for (int i = 0; i < 3; i++)
            at[i] = (float)normal[i];
    }
}

void
read_indices(struct reader *r, const struct json *value,
             const struct field *field, void *to)
{
    static const struct field index = {.name = "index",
                                       .type = FIELD_INTEGER,
                                       .max = 4294967295.0,
                                       .offset = 0};
    (void)field, (void)to;
    if (value == NULL)
        return;
    const struct json *n = entries(r, value, 1, "triangles");
    if (n == NULL)
        return;
    uint64_t most = LIMIT_INLINE_TRIANGLES;
    if (r->limits.max_triangles < most)
        most = r->limits.max_triangles;
    r->inline_triangles += value->count;
    if (r->inline_triangles > most) {
        fault(r, ERROR_BUDGET_TRIANGLES, value,
              "larger meshes are uploaded as assets", NULL,
              "%llu triangles inline, at most %llu",
              (unsigned long long)r->inline_triangles,
              (unsigned long long)most);
        return;
    }
    uint32_t *at = arena_array(r->arena, value->count, 3 * sizeof(uint32_t));
    r->mesh.indices = at;
    r->mesh.triangle_count = value->count;
    for (; n != NULL && at != NULL; n = n->next, at += 3) {
        if (n->type != JSON_ARRAY) {
            fault_type(r, n, "an array of 3 indices");
        } else if (n->count != 3) {
            fault(r, ERROR_ARRAY_LENGTH, n, NULL, NULL,
                  "a triangle has 3 indices, got %u", n->count);
        } else {
            uint32_t *corner = at;
            for (const struct json *i = n->child; i != NULL; i = i->next)
                read_value(r, i, &index, corner++);
        }
    }
}

/* --- relations --------------------------------------------------------------------- */

/* Every index that is a whole number names a position. */
static void
check_indices(struct reader *r, const struct json *indices, uint32_t positions)
{
    if (indices == NULL || indices->type != JSON_ARRAY)
        return;
    for (const struct json *n = indices->child; n != NULL; n = n->next) {
        if (n->type != JSON_ARRAY || n->count != 3)
            continue;
        for (const struct json *i = n->child; i != NULL; i = i->next) {
            if (i->type == JSON_NUMBER && i->number >= positions &&
                i->number <= 4294967295.0 && is_whole(i->number))
                fault(r, ERROR_MESH_INDEX_RANGE, i, "indices count from 0",
                      NULL, "index %s, but there are %u positions",
                      number_said(r, i->number), positions);
        }
    }
}

static void
check_per_position(struct reader *r, const struct json *object,
                   const char *name, uint32_t positions)
{
    const struct json *value = json_member(object, name);
    if (value != NULL && value->type == JSON_ARRAY && value->count != positions)
        fault(r, ERROR_ARRAY_LENGTH, value, NULL, NULL,
              "one entry per position: %u, got %u", positions, value->count);
}

/* Inline or uploaded, one of the two, and whole. */
static bool
check_source(struct reader *r, const struct json *object)
{
    static const char *const whole[] = {"positions", "asset"};
    static const char *const parts[] = {"indices", "asset"};
    const struct json *positions = json_member(object, "positions");
    const struct json *indices = json_member(object, "indices");
    const struct json *asset = json_member(object, "asset");
    if (asset != NULL) {
        if (positions != NULL)
            check_one_of(r, object, whole, COUNT_OF(whole));
        else
            check_one_of(r, object, parts, COUNT_OF(parts));
        return false;
    }
    if (positions == NULL)
        fault(r, ERROR_PROPERTY_MISSING, object,
              "add `positions`, an array of [x, y, z], and `indices`", NULL,
              "a `mesh` needs `positions`");
    if (indices == NULL)
        fault(r, ERROR_PROPERTY_MISSING, object,
              "add `indices`, an array of three positions per triangle", NULL,
              "a `mesh` needs `indices`");
    return positions != NULL;
}

void
check_mesh(struct reader *r, const struct json *object, void *to)
{
    struct scene_object *made = to;
    const struct json *smooth = json_member(object, "smooth");
    const struct json *positions = json_member(object, "positions");

    if (check_source(r, object) && positions->type == JSON_ARRAY) {
        check_indices(r, json_member(object, "indices"), positions->count);
        check_per_position(r, object, "normals", positions->count);
        check_per_position(r, object, "uvs", positions->count);
    }
    if (smooth != NULL && smooth->type == JSON_TRUE &&
        json_member(object, "normals") == NULL &&
        json_member(object, "asset") == NULL)
        fault(r, ERROR_PROPERTY_MISSING, object,
              "add `normals`, one per position, or leave `smooth` out", NULL,
              "a `mesh` that is `smooth` needs `normals`");
    made->shape.mesh.mesh = r->mesh_items.count;
    r->scene->triangle_count += r->mesh.triangle_count;
    reader_push(r, &r->mesh_items, &r->mesh, sizeof r->mesh);
    r->mesh = (struct scene_mesh){0};
}
