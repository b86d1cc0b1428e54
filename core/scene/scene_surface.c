/* Textures, materials and lights: relations, references, and their structs. */
#include "core/scene/scene_reader.h"

#include <string.h>

#include "core/scene/transform.h"

/* --- textures ---------------------------------------------------------------------- */

/* Named ones stand at their array index, inline ones behind them. */
static void
put(struct reader *r, struct vector *vector, const void *item, size_t size)
{
    if (r->slot != SCENE_NONE && (uint32_t)r->slot < vector->count)
        memcpy((char *)vector->items + (size_t)r->slot * size, item, size);
    else
        reader_push(r, vector, item, size);
}

void
finish_texture(struct reader *r, const struct json *object,
               const struct kind *kind, void *to)
{
    struct scene_texture texture = *(const struct scene_texture *)to;
    (void)object;
    texture.kind = (enum texture_kind)kind->value;
    put(r, &r->texture_items, &texture, sizeof texture);
}

/* --- materials --------------------------------------------------------------------- */

void
finish_material(struct reader *r, const struct json *object,
                const struct kind *kind, void *to)
{
    struct scene_material material = *(const struct scene_material *)to;
    struct paint *const paints[] = {&material.diffuse, &material.ambient,
                                    &material.specular, &material.mirror,
                                    &material.emission};
    /* A field that the kind lacks is zero, and zero is no texture. */
    static const char *const names[] = {"diffuse", "ambient", "specular",
                                        "mirror", "emission"};
    for (size_t i = 0; i < COUNT_OF(names); i++) {
        const char *name =
            kind->value == MATERIAL_MIRROR && i == 3 ? "reflectance" : names[i];
        if (kind_field(kind->fields, kind->field_count, name) == NULL)
            paints[i]->texture = SCENE_NONE;
    }
    material.kind = (enum material_kind)kind->value;
    reader_push(r, &r->material_nodes, &object, sizeof(const struct json *));
    put(r, &r->material_items, &material, sizeof material);
}

static bool
same_paint(const struct paint *a, const struct paint *b)
{
    return a->texture == b->texture && a->color[0] == b->color[0] &&
           a->color[1] == b->color[1] && a->color[2] == b->color[2];
}

/* Is it what an object without a material gets? Then all share one. */
static bool
is_default(const struct scene_material *m)
{
    static const struct paint grey = {{0.8, 0.8, 0.8}, SCENE_NONE};
    static const struct paint none = {{0, 0, 0}, SCENE_NONE};
    return m->kind == MATERIAL_LAMBERT && m->name == NULL &&
           same_paint(&m->diffuse, &grey) && same_paint(&m->ambient, &grey) &&
           same_paint(&m->emission, &none);
}

/* An inline material, or (NULL) the default one; its index. */
static int32_t
inline_material(struct reader *r, const struct json *value)
{
    static const struct scene_material plain = {
        .kind = MATERIAL_LAMBERT,
        .diffuse = {{0.8, 0.8, 0.8}, SCENE_NONE},
        .ambient = {{0.8, 0.8, 0.8}, SCENE_NONE},
        .specular = {{0, 0, 0}, SCENE_NONE},
        .mirror = {{0, 0, 0}, SCENE_NONE},
        .emission = {{0, 0, 0}, SCENE_NONE},
    };
    uint32_t index = r->material_items.count;
    if (value == NULL) {
        if (r->default_material == SCENE_NONE &&
            reader_push(r, &r->material_items, &plain, sizeof plain))
            r->default_material = (int32_t)index;
        return r->default_material;
    }
    int32_t slot = r->slot;
    r->slot = SCENE_NONE;
    read_family_value(r, value, &family_material);
    r->slot = slot;
    if (r->material_items.count <= index)
        return SCENE_NONE;
    /* A mix pushes the materials it mixes first: itself is the last. */
    index = r->material_items.count - 1;
    const struct scene_material *made =
        (const struct scene_material *)r->material_items.items + index;
    if (is_default(made)) {
        if (r->default_material == SCENE_NONE) {
            r->default_material = (int32_t)index;
        } else {
            r->material_items.count--;
            return r->default_material;
        }
    }
    return (int32_t)index;
}

void
read_material(struct reader *r, const struct json *value,
              const struct field *field, void *to)
{
    int32_t index = SCENE_NONE;
    if (value == NULL) {
        /* The caller decides: a group's material, or the default. */
    } else if (value->type == JSON_OBJECT) {
        index = inline_material(r, value);
    } else if (value->type == JSON_STRING) {
        const struct name_entry *entry =
            names_find(&r->materials, value->string);
        if (entry != NULL)
            index = (int32_t)entry->index;
        else
            fault_reference(r, value, "material", &r->materials);
    } else {
        fault_type(r, value, "a material's name or a material");
    }
    if (field->offset != FIELD_SKIP)
        *(int32_t *)(void *)((char *)to + field->offset) = index;
}

int32_t
default_material(struct reader *r)
{
    return inline_material(r, NULL);
}

/* mix: a number, a texture's name or a texture. */
void
read_weight(struct reader *r, const struct json *value,
            const struct field *field, void *to)
{
    static const struct field share = {
        .name = "weight", .type = FIELD_NUMBER, .max = 1, .offset = FIELD_SKIP};
    struct paint paint;
    (void)to;
    if (value == NULL)
        return;
    if (value->type == JSON_NUMBER)
        read_value(r, value, &share, NULL);
    else if (value->type == JSON_OBJECT ||
             (value->type == JSON_STRING && value->string[0] != '#'))
        read_paint(r, value, field, &paint);
    else
        fault_type(r, value, "a number, a texture's name or a texture");
}

/* --- assets ------------------------------------------------------------------------ */

void
read_asset_name(struct reader *r, const struct json *value,
                const struct field *field, void *to)
{
    const char *name;
    (void)field, (void)to;
    if (value != NULL && read_name(r, value, &name) &&
        names_find(&r->assets, name) == NULL)
        fault_reference(r, value, "asset", &r->assets);
}

static void
read_hash(struct reader *r, const struct json *value, const struct field *field,
          void *to)
{
    (void)field, (void)to;
    if (value == NULL)
        return;
    if (value->type != JSON_STRING)
        fault_type(r, value, "a string, 64 hexadecimal digits");
    else if (value->string_len != 64 ||
             strspn(value->string, "0123456789abcdef") != 64)
        fault(r, ERROR_STRING_PATTERN, value, NULL, NULL,
              "must be 64 digits of 0-9 a-f, got %s",
              can_tell(r) ? json_describe(value, r->arena) : "");
}

static const struct field asset_fields[] = {
    {"sha256", FIELD_CUSTOM, FIELD_REQUIRED, .offset = FIELD_SKIP,
     .read = read_hash},
    {"media_type", FIELD_TEXT, FIELD_OPTIONAL, .count = 128,
     .offset = FIELD_SKIP},
};
static const struct kind kind_asset = {"asset", 0, true,
                                       FIELDS_OF(asset_fields), NULL};

void
read_assets(struct reader *r, const struct json *value,
            const struct field *field, void *to)
{
    uint32_t before = r->faults;
    if (value == NULL || value->count == 0) {
        if (value != NULL && value->type != JSON_OBJECT)
            fault_type(r, value, "an object");
        return;
    }
    if (value->type != JSON_OBJECT) {
        fault_type(r, value, "an object");
        return;
    }
    if (value->count > LIMIT_ASSETS)
        fault(r, ERROR_BUDGET_LIST, value, NULL, NULL, "%u assets, at most %d",
              value->count, LIMIT_ASSETS);
    for (const struct json *m = value->child; m != NULL; m = m->next) {
        struct json name = {.type = JSON_STRING,
                            .key = m->key,
                            .line = m->key_line,
                            .column = m->key_column,
                            .parent = m->parent,
                            .string = m->key,
                            .string_len = strlen(m->key)};
        const char *text;
        read_name(r, &name, &text);
        read_members(r, m, NULL, &kind_asset, to);
    }
    if (r->faults == before)
        fault_not_yet(r, ERROR_PROPERTY_NOT_YET, value,
                      or_word(arena_printf(r->arena, "`%s`", field->name)),
                      "give a mesh inline, with `positions` and `indices`");
}

/* --- lights ------------------------------------------------------------------------- */

void
check_directional(struct reader *r, const struct json *object, void *to)
{
    static const char *const names[] = {"direction", "to_light"};
    (void)to;
    if (check_one_of(r, object, names, COUNT_OF(names)) == NULL)
        fault(r, ERROR_PROPERTY_MISSING, object,
              "add `direction`, the way light travels, or `to_light`, the way "
              "to the light",
              NULL, "a `directional` light needs `direction` or `to_light`");
}

void
check_spot(struct reader *r, const struct json *object, void *to)
{
    double inner, outer, position[3], target[3];
    (void)to;
    if (number_of(object, "inner", &inner) &&
        number_of(object, "outer", &outer) && inner >= outer)
        fault(r, ERROR_GEOMETRY_DEGENERATE,
              first_of(json_member(object, "inner"),
                       json_member(object, "outer")),
              NULL, NULL, "inner %s is not less than outer %s",
              number_said(r, inner), number_said(r, outer));
    if (numbers_of(object, "position", 3, position) &&
        numbers_of(object, "target", 3, target) && position[0] == target[0] &&
        position[1] == target[1] && position[2] == target[2])
        fault(r, ERROR_GEOMETRY_DEGENERATE,
              first_of(json_member(object, "position"),
                       json_member(object, "target")),
              NULL, NULL, "`position` and `target` are the same point");
}

void
finish_light(struct reader *r, const struct json *object,
             const struct kind *kind, void *to)
{
    const struct light_fields *f = to;
    struct scene_light light = f->light;
    if (!kind->ready)
        return;
    light.kind = (enum light_kind)kind->value;
    light.inverse_square = f->falloff == 1;
    light.loop_float32 = f->loop == 1;
    for (int i = 0; i < 3; i++) {
        light.intensity[i] = f->color[i] * f->intensity;
        light.to_light[i] = json_member(object, "direction") != NULL
                                ? -f->direction[i]
                                : f->to_light[i];
    }
    if (light.kind == LIGHT_DIRECTIONAL && vector_length(light.to_light) > 0)
        vector_unit(light.to_light, light.to_light);
    reader_push(r, &r->light_items, &light, sizeof light);
}

void
read_lights(struct reader *r, const struct json *value,
            const struct field *field, void *to)
{
    static const struct field list = {.name = "lights",
                                      .type = FIELD_LIST,
                                      .family = &family_light,
                                      .count = LIMIT_LIGHTS,
                                      .offset = FIELD_SKIP};
    (void)field;
    if (value != NULL) {
        read_value(r, value, &list, to);
        return;
    }
    struct scene_light light = {.kind = LIGHT_DIRECTIONAL,
                                .intensity = {0.8, 0.8, 0.8},
                                .to_light = {1, 2, 3}};
    vector_unit(light.to_light, light.to_light);
    r->scene->default_light =
        reader_push(r, &r->light_items, &light, sizeof light);
}
