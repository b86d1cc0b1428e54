#include "core/scene/scene_write.h"

#include <math.h>
#include <string.h>

#include "core/scene/kinds.h"
#include "core/scene/scene_reader.h"
#include "core/scene/srgb.h"

enum { ROWS_MAX = 64 };

/* --- simple values ------------------------------------------------------------------ */

static void
put_numbers(struct writer *w, const char *key, const double *numbers,
            uint32_t count)
{
    json_begin_array(&w->json, key);
    for (uint32_t i = 0; i < count; i++)
        json_put_number(&w->json, NULL, numbers[i]);
    json_end_array(&w->json);
}

void
write_numbers(struct writer *w, const char *key, const struct json *object,
              const struct json *value)
{
    if (value == NULL)
        return;
    if (value->type == JSON_NUMBER) {
        json_put_number(&w->json, key, value->number);
        return;
    }
    json_begin_array(&w->json, key);
    for (const struct json *n = value->child; n != NULL; n = n->next)
        write_numbers(w, NULL, object, n);
    json_end_array(&w->json);
}

static void
write_color(struct writer *w, const char *key, const struct json *value)
{
    double color[3];
    if (value->type == JSON_STRING && srgb_hex(value->string, color))
        put_numbers(w, key, color, 3);
    else
        write_numbers(w, key, NULL, value);
}

static void
write_scale(struct writer *w, const char *key, const struct field *field,
            const struct json *object, const struct json *value,
            const double def[4])
{
    uint32_t count =
        field->count != 0 ? field->count : texture_coordinates(object);
    double numbers[3];
    if (value != NULL && value->type == JSON_ARRAY) {
        write_numbers(w, key, object, value);
        return;
    }
    for (uint32_t i = 0; i < count; i++)
        numbers[i] = value != NULL ? value->number : def[i];
    put_numbers(w, key, numbers, count);
}

static const char *
choice_name(const struct field *field, int value)
{
    for (size_t i = 0; i < field->choice_count; i++) {
        if (field->choices[i].value == value)
            return field->choices[i].name;
    }
    return "";
}

/* --- by the rows ----------------------------------------------------------------------- */

static void
write_members(struct writer *w, const char *key, const struct family *family,
              const struct kind *kind, const struct json *object);

static void
write_family(struct writer *w, const char *key, const struct family *family,
             const struct json *object)
{
    const struct kind *kind =
        object != NULL ? family_kind_of(family, object) : family->fallback;
    write_members(w, key, family, kind, object);
}

static void
write_given(struct writer *w, const struct field *field,
            const struct json *object, const struct json *value)
{
    const char *key = field->name;
    if (value->type == JSON_NULL) {
        json_put_null(&w->json, key);
        return;
    }
    switch (field->type) {
    case FIELD_NUMBER:
    case FIELD_INTEGER: json_put_number(&w->json, key, value->number); break;
    case FIELD_BOOL:
        json_put_bool(&w->json, key, value->type == JSON_TRUE);
        break;
    case FIELD_ENUM:
    case FIELD_TEXT:
    case FIELD_NAME: json_put_string(&w->json, key, value->string); break;
    case FIELD_VECTOR:
    case FIELD_DIRECTION: write_numbers(w, key, object, value); break;
    case FIELD_SCALE: write_scale(w, key, field, object, value, NULL); break;
    case FIELD_COLOR: write_color(w, key, value); break;
    case FIELD_PAINT:
        if (value->type == JSON_OBJECT)
            write_family(w, key, &family_texture, value);
        else if (value->type == JSON_STRING && value->string[0] != '#')
            json_put_string(&w->json, key, value->string);
        else
            write_color(w, key, value);
        break;
    case FIELD_PART: write_members(w, key, NULL, field->part, value); break;
    case FIELD_FAMILY: write_family(w, key, field->family, value); break;
    case FIELD_LIST:
        json_begin_array(&w->json, key);
        for (const struct json *n = value->child; n != NULL; n = n->next)
            write_family(w, NULL, field->family, n);
        json_end_array(&w->json);
        break;
    case FIELD_CUSTOM: field->write(w, key, object, value); break;
    }
}

static void
write_default(struct writer *w, const struct field *field,
              const struct json *object)
{
    const char *key = field->name;
    double def[4];
    memcpy(def, field->def, sizeof def);
    if (field->fill != NULL && !field->fill(w->root, object, def))
        return;
    if ((field->flags & FIELD_NULL) || isnan(def[0])) {
        json_put_null(&w->json, key);
        return;
    }
    switch (field->type) {
    case FIELD_NUMBER:
    case FIELD_INTEGER: json_put_number(&w->json, key, def[0]); break;
    case FIELD_BOOL: json_put_bool(&w->json, key, def[0] != 0); break;
    case FIELD_ENUM:
        json_put_string(&w->json, key, choice_name(field, (int)def[0]));
        break;
    case FIELD_VECTOR: put_numbers(w, key, def, field->count); break;
    case FIELD_SCALE: write_scale(w, key, field, object, NULL, def); break;
    case FIELD_DIRECTION:
    case FIELD_COLOR:
    case FIELD_PAINT: put_numbers(w, key, def, 3); break;
    case FIELD_PART: write_members(w, key, NULL, field->part, NULL); break;
    case FIELD_FAMILY: write_family(w, key, field->family, NULL); break;
    case FIELD_LIST:
        json_begin_array(&w->json, key);
        json_end_array(&w->json);
        break;
    case FIELD_CUSTOM: field->write(w, key, object, NULL); break;
    case FIELD_TEXT:
    case FIELD_NAME: break;
    }
}

static void
write_field(struct writer *w, const struct field *field,
            const struct json *object)
{
    const struct json *value = json_member(object, field->name);
    if (field->flags & (FIELD_NOT_YET | FIELD_DROPPED))
        return;
    if (value == NULL && field->same_as != NULL)
        value = json_member(object, field->same_as);
    if (value != NULL)
        write_given(w, field, object, value);
    else if (!(field->flags & (FIELD_OPTIONAL | FIELD_REQUIRED)))
        write_default(w, field, object);
}

/* All members of a kind, sorted by name; `type` is one of them. */
static void
write_members(struct writer *w, const char *key, const struct family *family,
              const struct kind *kind, const struct json *object)
{
    static const struct field type = {.name = "type"};
    const struct field *rows[ROWS_MAX];
    size_t count = 0;
    if (family != NULL) {
        rows[count++] = &type;
        for (size_t i = 0; i < family->common_count; i++)
            rows[count++] = &family->common[i];
    }
    for (size_t i = 0; i < kind->field_count; i++)
        rows[count++] = &kind->fields[i];
    for (size_t i = 1; i < count; i++) {
        const struct field *row = rows[i];
        size_t j = i;
        for (; j > 0 && strcmp(rows[j - 1]->name, row->name) > 0; j--)
            rows[j] = rows[j - 1];
        rows[j] = row;
    }
    json_begin_object(&w->json, key);
    for (size_t i = 0; i < count; i++) {
        if (rows[i] == &type)
            json_put_string(&w->json, "type", kind->name);
        else
            write_field(w, rows[i], object);
    }
    json_end_object(&w->json);
}

/* --- fields with a writer of their own ---------------------------------------------------- */

void
write_assets(struct writer *w, const char *key, const struct json *object,
             const struct json *value)
{
    (void)object, (void)value;
    json_begin_object(&w->json, key); /* none can be used yet */
    json_end_object(&w->json);
}

void
write_lights(struct writer *w, const char *key, const struct json *object,
             const struct json *value)
{
    static const double color[3] = {0.8, 0.8, 0.8}, to_light[3] = {1, 2, 3};
    (void)object;
    json_begin_array(&w->json, key);
    if (value == NULL) {
        json_begin_object(&w->json, NULL);
        put_numbers(w, "color", color, 3);
        json_put_number(&w->json, "intensity", 1);
        put_numbers(w, "to_light", to_light, 3);
        json_put_string(&w->json, "type", "directional");
        json_end_object(&w->json);
    } else {
        for (const struct json *n = value->child; n != NULL; n = n->next)
            write_family(w, NULL, &family_light, n);
    }
    json_end_array(&w->json);
}

void
write_objects(struct writer *w, const char *key, const struct json *object,
              const struct json *value)
{
    bool outer = w->inherits;
    if (value == NULL)
        return;
    w->inherits =
        outer || (object != w->root && json_member(object, "material") != NULL);
    json_begin_array(&w->json, key);
    for (const struct json *n = value->child; n != NULL; n = n->next)
        write_family(w, NULL, &family_shape, n);
    json_end_array(&w->json);
    w->inherits = outer;
}

void
write_material(struct writer *w, const char *key, const struct json *object,
               const struct json *value)
{
    bool group = is_text(json_member(object, "type"), "group");
    if (value == NULL && !group && !w->inherits)
        write_members(w, key, &family_material,
                      family_kind(&family_material, "lambert"), NULL);
    else if (value != NULL && value->type == JSON_STRING)
        json_put_string(&w->json, key, value->string);
    else if (value != NULL)
        write_family(w, key, &family_material, value);
}

void
write_transform(struct writer *w, const char *key, const struct json *object,
                const struct json *value)
{
    (void)object;
    json_begin_array(&w->json, key);
    const struct json *n = value != NULL ? value->child : NULL;
    for (; n != NULL; n = n->next)
        write_members(w, NULL, NULL, &kind_step, n);
    json_end_array(&w->json);
}

void
scene_write_canonical(const struct json *root, struct bytes *out)
{
    struct writer w = {.json = {.out = out}, .root = root};
    write_members(&w, NULL, NULL, &kind_scene, root);
}
