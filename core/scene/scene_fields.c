#include "core/scene/scene_reader.h"

#include <math.h>
#include <string.h>

#include "core/base/utf8.h"
#include "core/scene/srgb.h"

static void *
place(void *to, const struct field *field)
{
    return field->offset == FIELD_SKIP ? NULL : (char *)to + field->offset;
}

/* --- numbers ------------------------------------------------------------------ */

static bool
read_number(struct reader *r, const struct json *value,
            const struct field *field, double *number)
{
    if (value->type == JSON_NULL && (field->flags & FIELD_NULLABLE)) {
        *number = 0;
        return true;
    }
    if (value->type != JSON_NUMBER) {
        const char *wanted =
            (field->flags & FIELD_NULLABLE) ? "a number or null" : "a number";
        return fault_type(r, value, wanted);
    }
    if (field->type == FIELD_INTEGER && !is_whole(value->number))
        return fault(r, ERROR_NUMBER_NOT_INTEGER, value, NULL, NULL,
                     "must be a whole number, got %s",
                     number_said(r, value->number));
    if (!fault_range(r, value, field))
        return false;
    *number = value->number;
    return true;
}

bool
read_numbers(struct reader *r, const struct json *value, uint32_t count,
             double limit, const char *noun, double *numbers)
{
    const struct field field = {
        .type = FIELD_VECTOR, .min = -limit, .max = limit};
    bool ok = true;
    if (value->type != JSON_ARRAY)
        return fault_type(r, value,
                          or_word(arena_printf(r->arena,
                                               "%s, an array of %u "
                                               "numbers",
                                               noun, count)));
    if (value->count != count)
        return fault(r, ERROR_ARRAY_LENGTH, value, NULL, NULL,
                     "%s has %u numbers, got %u", noun, count, value->count);
    for (const struct json *n = value->child; n != NULL; n = n->next)
        ok = read_number(r, n, &field, numbers++) && ok;
    return ok;
}

static const char *
vector_noun(uint32_t count)
{
    return count == 2    ? "a pair"
           : count == 3  ? "a point or vector"
           : count == 16 ? "a matrix"
                         : "this array";
}

static bool
read_vector(struct reader *r, const struct json *value,
            const struct field *field, double *numbers)
{
    const struct field one = {.type = FIELD_NUMBER,
                              .flags =
                                  field->flags & (FIELD_ABOVE | FIELD_BELOW),
                              .min = field->min,
                              .max = field->max};
    bool ok = true;
    if (value->type != JSON_ARRAY)
        return fault_type(
            r, value,
            or_word(arena_printf(r->arena, "an array of %u numbers",
                                 field->count)));
    if (value->count != field->count)
        return fault(r, ERROR_ARRAY_LENGTH, value, NULL, NULL,
                     "%s has %u numbers, got %u", vector_noun(field->count),
                     field->count, value->count);
    for (const struct json *n = value->child; n != NULL; n = n->next)
        ok = read_number(r, n, &one, numbers++) && ok;
    return ok;
}

static bool
read_direction(struct reader *r, const struct json *value, double *numbers)
{
    if (!read_numbers(r, value, 3, 1e6, "a direction", numbers))
        return false;
    if (numbers[0] == 0 && numbers[1] == 0 && numbers[2] == 0)
        return fault(r, ERROR_VECTOR_ZERO, value, NULL, NULL,
                     "a direction must not be the zero vector");
    return true;
}

/* One number for all coordinates, or one for each. */
static bool
read_scale(struct reader *r, const struct json *value,
           const struct field *field, double numbers[3])
{
    uint32_t count =
        field->count != 0 ? field->count : texture_coordinates(value->parent);
    struct field many = *field;
    many.type = FIELD_VECTOR;
    many.count = count;
    if (value->type == JSON_NUMBER) {
        many.type = FIELD_NUMBER;
        if (!read_number(r, value, &many, &numbers[0]))
            return false;
        numbers[1] = numbers[2] = numbers[0];
        return true;
    }
    if (value->type != JSON_ARRAY)
        return fault_type(r, value, "a number or an array of numbers");
    if (value->count != count)
        return fault(r, ERROR_ARRAY_LENGTH, value,
                     field->count == 0
                         ? "the mapping says how many coordinates there are"
                         : NULL,
                     NULL, "needs one number, or %u numbers, got %u", count,
                     value->count);
    numbers[2] = 0;
    return read_vector(r, value, &many, numbers);
}

/* --- words --------------------------------------------------------------------- */

static bool
read_text(struct reader *r, const struct json *value, uint32_t most,
          const char **text)
{
    if (value->type != JSON_STRING)
        return fault_type(r, value, "a string");
    size_t count = utf8_count(value->string, value->string_len);
    if (count > most)
        return fault(r, ERROR_STRING_LENGTH, value, NULL, NULL,
                     "at most %u characters, got %zu", most, count);
    *text = value->string;
    return true;
}

static bool
name_character(char c, bool first)
{
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') ||
           (c >= '0' && c <= '9') ||
           (!first && (c == '_' || c == '.' || c == '-'));
}

bool
read_name(struct reader *r, const struct json *value, const char **name)
{
    if (value->type != JSON_STRING)
        return fault_type(r, value, "a string, a name");
    bool good = value->string_len >= 1 && value->string_len <= 64;
    for (size_t i = 0; good && i < value->string_len; i++)
        good = name_character(value->string[i], i == 0);
    if (!good)
        return fault(r, ERROR_STRING_PATTERN, value,
                     "a name has 1 to 64 of A-Z a-z 0-9 _ . - and begins with "
                     "a letter or digit",
                     NULL, "%s is not a name",
                     can_tell(r) ? json_describe(value, r->arena) : "it");
    *name = value->string;
    return true;
}

static bool
read_enum(struct reader *r, const struct json *value, const struct field *field,
          int *choice)
{
    const char *words[32];
    size_t count = 0;
    if (value->type != JSON_STRING)
        return fault_type(r, value, "a string");
    for (size_t i = 0; i < field->choice_count; i++) {
        const struct choice *c = &field->choices[i];
        if (strcmp(value->string, c->name) == 0) {
            *choice = c->value;
            return c->ready ||
                   fault_not_yet(
                       r, ERROR_ENUM_NOT_YET, value,
                       or_word(arena_printf(r->arena, "`%s`", c->name)), NULL);
        }
        words[count++] = c->name;
    }
    return fault_unknown_word(r, ERROR_ENUM_UNKNOWN, value, field->name, words,
                              count);
}

/* --- colours --------------------------------------------------------------------- */

static bool
read_color(struct reader *r, const struct json *value, double most,
           double color[3])
{
    const struct field range = {.type = FIELD_COLOR, .min = 0, .max = most};
    bool ok = true;
    if (value->type == JSON_STRING) {
        if (!srgb_hex(value->string, color))
            return fault(r, ERROR_COLOR_INVALID, value,
                         "six hexadecimal digits, or three linear numbers "
                         "[r, g, b]",
                         NULL, "write `#rrggbb`, got %s",
                         can_tell(r) ? json_describe(value, r->arena) : "");
        return true;
    }
    if (value->type != JSON_ARRAY)
        return fault_type(r, value,
                          "a color, [r, g, b] or a string \"#rrggbb\"");
    if (value->count != 3)
        return fault(r, ERROR_ARRAY_LENGTH, value,
                     "a color is [r, g, b]; there is no alpha", NULL,
                     "a color has 3 numbers, got %u", value->count);
    for (const struct json *n = value->child; n != NULL; n = n->next)
        ok = read_number(r, n, &range, color++) && ok;
    return ok;
}

void
read_paint(struct reader *r, const struct json *value,
           const struct field *field, struct paint *paint)
{
    *paint = (struct paint){.texture = SCENE_NONE};
    if (value->type == JSON_OBJECT) {
        int32_t slot = r->slot;
        r->slot = SCENE_NONE;
        paint->texture = (int32_t)r->texture_items.count;
        read_family_value(r, value, &family_texture);
        r->slot = slot;
        if (field->max <= 1)
            check_reflectance(r, value);
        return;
    }
    if (value->type == JSON_STRING && value->string[0] != '#') {
        const struct name_entry *entry =
            names_find(&r->textures, value->string);
        if (entry == NULL) {
            fault_reference(r, value, "texture", &r->textures);
            return;
        }
        paint->texture = (int32_t)entry->index;
        if (field->max <= 1 && r->texture_reflects != NULL)
            r->texture_reflects[entry->index] = true;
        return;
    }
    if (value->type != JSON_STRING && value->type != JSON_ARRAY) {
        fault_type(r, value, "a color, a texture's name or a texture");
        return;
    }
    read_color(r, value, field->max, paint->color);
}

/* --- any field ----------------------------------------------------------------------- */

static void
read_list(struct reader *r, const struct json *value, const struct field *field)
{
    if (value->type != JSON_ARRAY) {
        fault_type(r, value, "an array");
        return;
    }
    if (value->count > field->count) {
        fault(r, ERROR_BUDGET_LIST, value, NULL, NULL, "%u %s, at most %u",
              value->count, field->name, field->count);
        return;
    }
    int32_t slot = r->slot;
    r->slot = 0;
    for (const struct json *n = value->child; n != NULL; n = n->next) {
        if ((field->flags & FIELD_NAMED) && n->type == JSON_OBJECT &&
            json_member(n, "name") == NULL)
            fault(r, ERROR_PROPERTY_MISSING, n,
                  "add `name`: it is used by its name", NULL,
                  "a %s of this list needs `name`", field->family->noun);
        read_family_value(r, n, field->family);
        r->slot++;
    }
    r->slot = slot;
}

static void
store_number(const struct field *field, double number, void *at)
{
    if (at == NULL)
        return;
    if (field->type == FIELD_INTEGER)
        *(uint32_t *)at = (uint32_t)number;
    else
        *(double *)at = number;
}

static void
store_bool(const struct field *field, bool yes, void *at)
{
    if (at == NULL)
        return;
    if (field->count == 0)
        *(bool *)at = yes;
    else if (yes)
        *(unsigned *)at |= field->count;
}

static void
store_numbers(const double *numbers, uint32_t count, void *at)
{
    if (at != NULL)
        memcpy(at, numbers, count * sizeof(double));
}

void
read_value(struct reader *r, const struct json *value,
           const struct field *field, void *to)
{
    void *at = place(to, field);
    double numbers[16] = {0};
    const char *text = NULL;
    struct paint paint;
    int choice = 0;

    switch (field->type) {
    case FIELD_NUMBER:
    case FIELD_INTEGER:
        if (read_number(r, value, field, numbers))
            store_number(field, numbers[0], at);
        break;
    case FIELD_BOOL:
        if (value->type != JSON_TRUE && value->type != JSON_FALSE)
            fault_type(r, value, "true or false");
        else
            store_bool(field, value->type == JSON_TRUE, at);
        break;
    case FIELD_ENUM:
        if (read_enum(r, value, field, &choice) && at != NULL)
            *(int *)at = choice;
        break;
    case FIELD_TEXT:
        if (read_text(r, value, field->count, &text) && at != NULL)
            *(const char **)at = text;
        break;
    case FIELD_NAME:
        if (read_name(r, value, &text) && at != NULL)
            *(const char **)at = text;
        break;
    case FIELD_VECTOR:
        if (read_vector(r, value, field, numbers))
            store_numbers(numbers, field->count, at);
        break;
    case FIELD_DIRECTION:
        if (read_direction(r, value, numbers))
            store_numbers(numbers, 3, at);
        break;
    case FIELD_SCALE:
        if (read_scale(r, value, field, numbers))
            store_numbers(numbers, 3, at);
        break;
    case FIELD_COLOR:
        if (read_color(r, value, field->max, numbers))
            store_numbers(numbers, 3, at);
        break;
    case FIELD_PAINT:
        read_paint(r, value, field, &paint);
        if (at != NULL)
            *(struct paint *)at = paint;
        break;
    case FIELD_PART:
        if (value->type == JSON_NULL && (field->flags & FIELD_NULLABLE))
            break;
        read_members(r, value, NULL, field->part, at != NULL ? at : to);
        break;
    case FIELD_FAMILY: read_family_value(r, value, field->family); break;
    case FIELD_LIST: read_list(r, value, field); break;
    case FIELD_CUSTOM: field->read(r, value, field, to); break;
    }
}

void
read_default(struct reader *r, const struct json *object,
             const struct field *field, void *to)
{
    void *at = place(to, field);
    double def[4];
    memcpy(def, field->def, sizeof def);
    if (field->type == FIELD_CUSTOM) {
        field->read(r, NULL, field, to);
        return;
    }
    if (field->type == FIELD_FAMILY && !(field->flags & FIELD_OPTIONAL)) {
        read_family_value(r, NULL, field->family);
        return;
    }
    if (field->type == FIELD_PART && !(field->flags & FIELD_OPTIONAL)) {
        read_members(r, NULL, NULL, field->part, at != NULL ? at : to);
        return;
    }
    const struct json *same =
        field->same_as != NULL ? json_member(object, field->same_as) : NULL;
    if (same != NULL) {
        bool silent = r->silent;
        uint32_t faults = r->faults;
        r->silent = true;
        read_value(r, same, field, to);
        r->silent = silent;
        r->faults = faults;
        return;
    }
    if ((field->flags & FIELD_OPTIONAL) || at == NULL)
        return;
    if (field->fill != NULL && !field->fill(r->root, object, def))
        return;
    if (isnan(def[0]))
        def[0] = 0;
    switch (field->type) {
    case FIELD_NUMBER:
    case FIELD_INTEGER: store_number(field, def[0], at); break;
    case FIELD_BOOL: store_bool(field, def[0] != 0, at); break;
    case FIELD_ENUM: *(int *)at = (int)def[0]; break;
    case FIELD_VECTOR: store_numbers(def, field->count, at); break;
    case FIELD_DIRECTION:
    case FIELD_SCALE:
    case FIELD_COLOR: store_numbers(def, 3, at); break;
    case FIELD_PAINT:
        *(struct paint *)at = (struct paint){.color = {def[0], def[1], def[2]},
                                             .texture = SCENE_NONE};
        break;
    default: break;
    }
}
