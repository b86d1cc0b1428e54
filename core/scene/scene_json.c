#include "core/scene/scene_json.h"

#include <math.h>
#include <stdalign.h>
#include <string.h>

#include "core/base/must.h"
#include "core/scene/scene_reader.h"

/* --- rows ---------------------------------------------------------------------- */

const struct kind *
family_kind(const struct family *family, const char *name)
{
    for (size_t i = 0; i < family->kind_count; i++) {
        if (strcmp(family->kinds[i].name, name) == 0)
            return &family->kinds[i];
    }
    return NULL;
}

const struct field *
kind_field(const struct field *fields, size_t count, const char *name)
{
    for (size_t i = 0; i < count; i++) {
        if (strcmp(fields[i].name, name) == 0)
            return &fields[i];
    }
    return NULL;
}

const struct kind *
family_kind_of(const struct family *family, const struct json *object)
{
    const struct json *type = json_member(object, "type");
    if (type == NULL)
        return family->fallback;
    return type->type == JSON_STRING ? family_kind(family, type->string) : NULL;
}

uint32_t
texture_coordinates(const struct json *texture)
{
    const char *mapping = text_of(texture, "mapping");
    size_t len = mapping != NULL ? strlen(mapping) : 0;
    return len >= 3 && strcmp(mapping + len - 3, "xyz") == 0 ? 3 : 2;
}

/* --- getters ------------------------------------------------------------------- */

bool
is_whole(double number)
{
    /* From 2^53 on every double is whole. */
    return fabs(number) >= 9007199254740992.0 ||
           (double)(int64_t)number == number;
}

bool
number_of(const struct json *object, const char *key, double *number)
{
    const struct json *value = json_member(object, key);
    if (value == NULL || value->type != JSON_NUMBER)
        return false;
    *number = value->number;
    return true;
}

bool
numbers_of(const struct json *object, const char *key, uint32_t count,
           double *numbers)
{
    const struct json *value = json_member(object, key);
    if (value == NULL || value->type != JSON_ARRAY || value->count != count)
        return false;
    for (const struct json *n = value->child; n != NULL; n = n->next) {
        if (n->type != JSON_NUMBER)
            return false;
        *numbers++ = n->number;
    }
    return true;
}

const char *
text_of(const struct json *object, const char *key)
{
    const struct json *value = json_member(object, key);
    return value != NULL && value->type == JSON_STRING ? value->string : NULL;
}

bool
is_text(const struct json *value, const char *text)
{
    return value != NULL && value->type == JSON_STRING &&
           strcmp(value->string, text) == 0;
}

const struct json *
first_of(const struct json *a, const struct json *b)
{
    if (a == NULL || b == NULL)
        return a != NULL ? a : b;
    return a->begin < b->begin ? a : b;
}

const struct json *
later_of(const struct json *a, const struct json *b)
{
    if (a == NULL || b == NULL)
        return a != NULL ? a : b;
    return a->begin > b->begin ? a : b;
}

const struct json *
check_one_of(struct reader *r, const struct json *object,
             const char *const *names, size_t count)
{
    const struct json *first = NULL;
    if (object == NULL || object->type != JSON_OBJECT)
        return NULL;
    for (const struct json *m = object->child; m != NULL; m = m->next) {
        for (size_t i = 0; i < count; i++) {
            if (strcmp(m->key, names[i]) != 0)
                continue;
            if (first == NULL)
                first = m;
            else
                fault(r, ERROR_PROPERTY_CONFLICT, m, "keep one of the two",
                      fix_remove(r, m), "give `%s` or `%s`, not both",
                      first->key, m->key);
        }
    }
    return first;
}

bool
reader_push(struct reader *r, struct vector *vector, const void *item,
            size_t size)
{
    if (vector->count == vector->capacity) {
        uint32_t capacity = vector->capacity == 0 ? 16 : vector->capacity * 2;
        char *items = arena_array(r->arena, capacity, size);
        if (items == NULL)
            return false;
        if (vector->count > 0)
            memcpy(items, vector->items, vector->count * size);
        vector->items = items;
        vector->capacity = capacity;
    }
    memcpy((char *)vector->items + vector->count * size, item, size);
    vector->count++;
    return true;
}

/* --- the walk --------------------------------------------------------------------- */

enum { ROWS_MAX = 64 };

/* Fields of one object: the family's common ones, then the kind's. */
struct rows {
    const struct family *family;
    const struct kind *kind;
};

static size_t
row_count(const struct rows *rows)
{
    size_t count = rows->family != NULL ? rows->family->common_count : 0;
    return count + (rows->kind != NULL ? rows->kind->field_count : 0);
}

static const struct field *
row_at(const struct rows *rows, size_t i)
{
    size_t common = rows->family != NULL ? rows->family->common_count : 0;
    return i < common ? &rows->family->common[i]
                      : &rows->kind->fields[i - common];
}

static size_t
row_find(const struct rows *rows, const char *name)
{
    size_t count = row_count(rows);
    for (size_t i = 0; i < count; i++) {
        if (strcmp(row_at(rows, i)->name, name) == 0)
            return i;
    }
    return SIZE_MAX;
}

static void
read_field(struct reader *r, const struct json *value,
           const struct field *field, void *to)
{
    uint32_t before = r->faults;
    read_value(r, value, field, to);
    if ((field->flags & FIELD_NOT_YET) && r->faults == before)
        fault_not_yet(r, ERROR_PROPERTY_NOT_YET, value,
                      or_word(arena_printf(r->arena, "`%s`", field->name)),
                      "leave it out for now");
}

/* Which member stands for which row; members without a row are told. */
static void
find_given(struct reader *r, const struct json *object, const struct rows *rows,
           const struct json **given)
{
    const struct json *m = object != NULL ? object->child : NULL;
    for (; m != NULL; m = m->next) {
        if (rows->family != NULL && strcmp(m->key, "type") == 0)
            continue;
        size_t i = row_find(rows, m->key);
        if (i != SIZE_MAX)
            given[i] = m;
        else if (rows->kind != NULL)
            fault_unknown_key(r, m, rows->family, rows->kind);
    }
}

static void
read_absent(struct reader *r, const struct json *object,
            const struct rows *rows, const struct field *field, void *to)
{
    if ((field->flags & FIELD_REQUIRED) && object != NULL) {
        const char *noun =
            rows->kind != NULL ? rows->kind->name : rows->family->noun;
        fault(r, ERROR_PROPERTY_MISSING, object,
              can_tell(r) ? arena_printf(r->arena, "add `%s`", field->name)
                          : NULL,
              NULL, "a `%s` needs `%s`", noun, field->name);
    } else {
        read_default(r, object, field, to);
    }
}

/* Rows are read in the order of the table, whatever the document's order is:
 * so inline textures and materials get the same indices in canonical text. */
void
read_members(struct reader *r, const struct json *object,
             const struct family *family, const struct kind *kind, void *to)
{
    struct rows rows = {family, kind};
    const struct json *given[ROWS_MAX] = {NULL};
    size_t count = row_count(&rows);
    if (object != NULL && object->type != JSON_OBJECT) {
        fault_type(r, object, "an object");
        return;
    }
    MUST(count <= ROWS_MAX);
    find_given(r, object, &rows, given);
    for (size_t i = 0; i < count; i++) {
        const struct field *field = row_at(&rows, i);
        if (given[i] == NULL)
            read_absent(r, object, &rows, field, to);
        else if (!(field->flags & FIELD_LATE))
            read_field(r, given[i], field, to);
    }
    if (kind != NULL && kind->check != NULL)
        kind->check(r, object, to);
    for (size_t i = 0; i < count; i++) {
        if (given[i] != NULL && (row_at(&rows, i)->flags & FIELD_LATE))
            read_field(r, given[i], row_at(&rows, i), to);
    }
}

/* The kinds of a family, those ready first, as words for a hint. */
static size_t
kind_words(const struct family *family, bool ready_only, const char **words)
{
    size_t count = 0;
    for (size_t i = 0; i < family->kind_count; i++) {
        if (family->kinds[i].ready)
            words[count++] = family->kinds[i].name;
    }
    for (size_t i = 0; i < family->kind_count && !ready_only; i++) {
        if (!family->kinds[i].ready)
            words[count++] = family->kinds[i].name;
    }
    return count;
}

static const char *
ready_hint(struct reader *r, const struct family *family)
{
    const char *words[32];
    struct bytes out = {0};
    if (!can_tell(r))
        return NULL;
    size_t count = kind_words(family, true, words);
    bytes_text(&out, "rendered now: ");
    for (size_t i = 0; i < count; i++)
        bytes_printf(&out, "%s`%s`", i > 0 ? ", " : "", words[i]);
    const char *hint =
        out.failed ? NULL : arena_strndup(r->arena, out.data, out.len);
    bytes_clear(&out);
    return hint;
}

static const struct kind *
read_type(struct reader *r, const struct json *object,
          const struct family *family)
{
    const char *words[32];
    const struct json *type = json_member(object, "type");
    const struct kind *kind = family_kind_of(family, object);
    if (kind != NULL)
        return kind;
    if (type == NULL)
        fault(r, ERROR_PROPERTY_MISSING, object, ready_hint(r, family), NULL,
              "a %s needs `type`", family->noun);
    else if (type->type != JSON_STRING)
        fault_type(r, type, "a string");
    else
        fault_unknown_word(r, ERROR_ENUM_UNKNOWN, type, "type", words,
                           kind_words(family, false, words));
    return NULL;
}

const struct kind *
read_family(struct reader *r, const struct json *object,
            const struct family *family, void *to)
{
    uint32_t before = r->faults;
    if (object != NULL && object->type != JSON_OBJECT) {
        fault_type(r, object, "an object");
        return NULL;
    }
    const struct kind *kind =
        object == NULL ? family->fallback : read_type(r, object, family);
    read_members(r, object, family, kind, to);
    if (kind != NULL && family->finish != NULL)
        family->finish(r, object, kind, to);
    if (kind != NULL && !kind->ready && r->faults == before)
        fault_not_yet(r, ERROR_ENUM_NOT_YET, json_member(object, "type"),
                      or_word(arena_printf(r->arena, "the %s `%s`",
                                           family->noun, kind->name)),
                      ready_hint(r, family));
    return kind;
}

void
read_family_value(struct reader *r, const struct json *value,
                  const struct family *family)
{
    alignas(max_align_t) char scratch[1024] = {0};
    read_family(r, value, family, scratch);
}

/* --- a document ---------------------------------------------------------------------- */

static void
set_limits(struct reader *r, const struct scene_limits *limits)
{
    if (limits != NULL)
        r->limits = *limits;
    if (r->limits.max_pixels == 0)
        r->limits.max_pixels = (uint64_t)LIMIT_PIXELS;
    if (r->limits.max_triangles == 0)
        r->limits.max_triangles = (uint64_t)LIMIT_TRIANGLES;
    if (r->limits.max_rays == 0)
        r->limits.max_rays = (uint64_t)LIMIT_RAYS;
    if (r->limits.max_spp == 0)
        r->limits.max_spp = 65536;
    if (r->limits.max_bounces == 0)
        r->limits.max_bounces = 64;
}

static void
keep(struct reader *r)
{
    struct scene *scene = r->scene;
    scene->textures = r->texture_items.items;
    scene->texture_count = r->texture_items.count;
    scene->materials = r->material_items.items;
    scene->material_count = r->material_items.count;
    scene->lights = r->light_items.items;
    scene->light_count = r->light_items.count;
    scene->meshes = r->mesh_items.items;
    scene->mesh_count = r->mesh_items.count;
    scene->objects = r->object_items.items;
    scene->object_count = r->object_items.count;
}

bool
scene_read(const struct json *root, const struct scene_limits *limits,
           struct arena *arena, struct scene *scene, struct error_list *errors)
{
    struct reader r = {.arena = arena,
                       .errors = errors,
                       .scene = scene,
                       .root = root,
                       .slot = SCENE_NONE,
                       .default_material = SCENE_NONE};
    *scene = (struct scene){.arena = arena};
    set_limits(&r, limits);

    if (root->type != JSON_OBJECT) {
        fault_type(&r, root, "an object, the scene");
    } else {
        collect_names(&r);
        read_members(&r, root, NULL, &kind_scene, scene);
        keep(&r);
        check_document(&r);
    }
    if (!reader_tell_all(&r))
        return false;
    finish_camera(&r);
    return true;
}

bool
scene_read_text(const char *text, size_t len, const struct scene_limits *limits,
                struct arena *arena, struct scene *scene,
                struct error_list *errors)
{
    const struct json *root = json_read(text, len, NULL, arena, errors);
    if (root == NULL)
        return false;
    return scene_read(root, limits, arena, scene, errors);
}
