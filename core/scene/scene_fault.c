#include "core/scene/scene_reader.h"

#include <math.h>
#include <string.h>

#include "core/base/number.h"

enum {
    WORDS_MAX = 96 /* names one place allows */
};

const char *
or_word(const char *text)
{
    return text != NULL ? text : "it";
}

bool
can_tell(const struct reader *r)
{
    return !r->silent && r->items.count < LIMIT_FAULTS;
}

static void
tell(struct reader *r, enum error_code code, const struct json *node,
     bool at_key, const char *hint, const char *fix, const char *format,
     va_list args)
{
    if (!can_tell(r)) {
        r->dropped = r->dropped || !r->silent;
        return;
    }
    struct error_item item = {
        .code = code,
        .pointer = json_pointer(node, r->arena),
        .line = at_key ? node->key_line : node->line,
        .column = at_key ? node->key_column : node->column,
        .detail = or_word(arena_vprintf(r->arena, format, args)),
        .hint = hint,
        .fix = fix,
    };
    reader_push(r, &r->items, &item, sizeof item);
}

bool
reader_tell_all(struct reader *r)
{
    struct error_item *items = r->items.items;
    uint32_t count = r->items.count;
    /* Insertion sort: few items, mostly in order already, and it is stable. */
    for (uint32_t i = 1; i < count; i++) {
        struct error_item item = items[i];
        uint32_t j = i;
        for (; j > 0 && (items[j - 1].line > item.line ||
                         (items[j - 1].line == item.line &&
                          items[j - 1].column > item.column));
             j--)
            items[j] = items[j - 1];
        items[j] = item;
    }
    for (uint32_t i = 0; i < count; i++)
        error_list_add(r->errors, items[i].code, items[i].pointer,
                       items[i].line, items[i].column, items[i].hint,
                       items[i].fix, "%s", items[i].detail);
    r->errors->truncated = r->errors->truncated || r->dropped;
    if (r->arena->failed)
        error_list_add(r->errors, ERROR_MEMORY, NULL, 0, 0, NULL, NULL,
                       "the document needs more memory than it may have");
    error_list_sort(r->errors);
    return count == 0 && r->faults == 0 && !r->arena->failed;
}

bool
fault(struct reader *r, enum error_code code, const struct json *value,
      const char *hint, const char *fix, const char *format, ...)
{
    va_list args;
    r->faults++;
    va_start(args, format);
    tell(r, code, value, false, hint, fix, format, args);
    va_end(args);
    return false;
}

bool
fault_key(struct reader *r, enum error_code code, const struct json *member,
          const char *hint, const char *fix, const char *format, ...)
{
    va_list args;
    r->faults++;
    va_start(args, format);
    tell(r, code, member, true, hint, fix, format, args);
    va_end(args);
    return false;
}

static void
tell_text(struct reader *r, enum error_code code, const struct json *value,
          const char *hint, const char *format, ...)
    __attribute__((format(printf, 5, 6)));

static void
tell_text(struct reader *r, enum error_code code, const struct json *value,
          const char *hint, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    tell(r, code, value, false, hint, NULL, format, args);
    va_end(args);
}

bool
fault_not_yet(struct reader *r, enum error_code code, const struct json *value,
              const char *noun, const char *hint)
{
    tell_text(r, code, value, hint,
              "%s is part of the format, but this version does not render it "
              "yet",
              noun);
    return false;
}

bool
fault_type(struct reader *r, const struct json *value, const char *wanted)
{
    if (!can_tell(r))
        return fault(r, ERROR_TYPE_MISMATCH, value, NULL, NULL, "%s", wanted);
    return fault(r, ERROR_TYPE_MISMATCH, value, NULL, NULL,
                 "must be %s, got %s", wanted, json_describe(value, r->arena));
}

const char *
number_said(struct reader *r, double number)
{
    char text[NUMBER_SIZE];
    number_text(number, text);
    const char *copy = arena_strdup(r->arena, text);
    return copy != NULL ? copy : "a number";
}

bool
fault_range(struct reader *r, const struct json *value,
            const struct field *field)
{
    double x = value->number;
    bool small =
        (field->flags & FIELD_ABOVE) ? x <= field->min : x < field->min;
    bool large =
        (field->flags & FIELD_BELOW) ? x >= field->max : x > field->max;
    if (!small && !large)
        return true;
    if (!can_tell(r))
        return fault(r, ERROR_NUMBER_TOO_SMALL, value, NULL, NULL, "range");
    const char *got = number_said(r, x);
    if (small && x <= 0 && field->min >= 0 &&
        (field->min > 0 || (field->flags & FIELD_ABOVE)))
        return fault(r, ERROR_NUMBER_TOO_SMALL, value,
                     field->type == FIELD_NUMBER && field->max == 1e6 &&
                             field->min > 0
                         ? "this is a length in scene units"
                         : NULL,
                     NULL, "must be greater than 0, got %s", got);
    if (small)
        return fault(r, ERROR_NUMBER_TOO_SMALL, value, NULL, NULL,
                     "must be %s %s, got %s",
                     (field->flags & FIELD_ABOVE) ? "greater than" : "at least",
                     number_said(r, field->min), got);
    return fault(r, ERROR_NUMBER_TOO_LARGE, value, NULL, NULL,
                 "must be %s %s, got %s",
                 (field->flags & FIELD_BELOW) ? "less than" : "at most",
                 number_said(r, field->max), got);
}

/* --- JSON Patch --------------------------------------------------------------- */

enum patch { PATCH_REMOVE, PATCH_MOVE, PATCH_TEXT, PATCH_NUMBER };

/* One operation on `node`; `text` is the new name or string. */
static const char *
patch(struct reader *r, enum patch operation, const struct json *node,
      const char *text, double number)
{
    static const char *const names[] = {
        [PATCH_REMOVE] = "remove",
        [PATCH_MOVE] = "move",
        [PATCH_TEXT] = "replace",
        [PATCH_NUMBER] = "replace",
    };
    if (!can_tell(r))
        return NULL;
    struct bytes out = {0};
    struct json_writer w = {.out = &out};
    const char *pointer = json_pointer(node, r->arena);
    json_begin_array(&w, NULL);
    json_begin_object(&w, NULL);
    json_put_string(&w, "op", names[operation]);
    if (operation == PATCH_MOVE) {
        const char *object = json_pointer(node->parent, r->arena);
        const char *path = arena_printf(r->arena, "%s/%s", object, text);
        json_put_string(&w, "from", pointer);
        pointer = path != NULL ? path : "";
    }
    json_put_string(&w, "path", pointer);
    if (operation == PATCH_TEXT)
        json_put_string(&w, "value", text);
    if (operation == PATCH_NUMBER)
        json_put_number(&w, "value", number);
    json_end_object(&w);
    json_end_array(&w);
    const char *copy = NULL;
    if (!out.failed)
        copy = arena_strndup(r->arena, out.data, out.len);
    bytes_clear(&out);
    return copy;
}

const char *
fix_remove(struct reader *r, const struct json *member)
{
    return patch(r, PATCH_REMOVE, member, NULL, 0);
}

const char *
fix_text(struct reader *r, const struct json *value, const char *text)
{
    return patch(r, PATCH_TEXT, value, text, 0);
}

const char *
fix_number(struct reader *r, const struct json *value, double number)
{
    return patch(r, PATCH_NUMBER, value, NULL, number);
}

/* --- did you mean --------------------------------------------------------------- */

/* "known: a, b, c" */
static const char *
list_words(struct reader *r, const char *lead, const char *const *words,
           size_t count)
{
    struct bytes out = {0};
    bytes_text(&out, lead);
    for (size_t i = 0; i < count && out.len < 600; i++)
        bytes_printf(&out, "%s`%s`", i > 0 ? ", " : "", words[i]);
    const char *text =
        out.failed ? NULL : arena_strndup(r->arena, out.data, out.len);
    bytes_clear(&out);
    return text;
}

bool
fault_unknown_word(struct reader *r, enum error_code code,
                   const struct json *value, const char *noun,
                   const char *const *words, size_t count)
{
    if (!can_tell(r))
        return fault(r, code, value, NULL, NULL, "%s", noun);
    const char *nearest = json_did_you_mean(value->string, words, count);
    const char *said =
        arena_strndup(r->arena, value->string,
                      value->string_len < 64 ? value->string_len : 64);
    if (nearest != NULL)
        return fault(r, code, value,
                     arena_printf(r->arena, "did you mean `%s`?", nearest),
                     fix_text(r, value, nearest), "unknown %s `%s`", noun,
                     said ? said : "");
    return fault(r, code, value, list_words(r, "known: ", words, count), NULL,
                 "unknown %s `%s`", noun, said ? said : "");
}

bool
fault_reference(struct reader *r, const struct json *value, const char *noun,
                const struct names *names)
{
    if (!can_tell(r))
        return fault(r, ERROR_REFERENCE_UNKNOWN, value, NULL, NULL, "%s", noun);
    const char *nearest = names_nearest(names, value->string, r->arena);
    const char *said =
        arena_strndup(r->arena, value->string,
                      value->string_len < 64 ? value->string_len : 64);
    if (nearest != NULL)
        return fault(r, ERROR_REFERENCE_UNKNOWN, value,
                     arena_printf(r->arena, "did you mean `%s`?", nearest),
                     fix_text(r, value, nearest), "no %s `%s`", noun,
                     said ? said : "");
    const char *words[12];
    size_t count = 0;
    while (count < COUNT_OF(words) && count < names->count) {
        words[count] = names->items[count].name;
        count++;
    }
    const char *hint =
        count > 0 ? list_words(r, "named: ", words, count)
                  : arena_printf(r->arena, "the document names no %s", noun);
    return fault(r, ERROR_REFERENCE_UNKNOWN, value, hint, NULL, "no %s `%s`",
                 noun, said ? said : "");
}

/* --- unknown properties ----------------------------------------------------------- */

/* Which kind of the family has that field? */
static const struct kind *
owner_of(const struct family *family, const struct kind *not_this,
         const char *name)
{
    for (size_t i = 0; family != NULL && i < family->kind_count; i++) {
        const struct kind *kind = &family->kinds[i];
        if (kind != not_this &&
            kind_field(kind->fields, kind->field_count, name) != NULL)
            return kind;
    }
    return NULL;
}

/* Names that other programs and the job document use. */
static const char *
foreign_name(const struct json *member, const struct kind *kind)
{
    static const char *const job[] = {"output",  "priority",     "tags",
                                      "frames",  "max_attempts", "time_limit",
                                      "webhook", "scene"};
    const char *key = member->key;
    if (strcmp(key, "maxDepth") == 0 || strcmp(key, "max_depth") == 0 ||
        strcmp(key, "depth") == 0)
        return "the lecture's maxDepth 4 is max_bounces 3";
    for (size_t i = 0; kind == &kind_scene && i < COUNT_OF(job); i++) {
        if (strcmp(key, job[i]) == 0)
            return "this belongs to the job document, beside the scene: "
                   "{\"scene\": ..., \"output\": ...}";
    }
    return NULL;
}

bool
fault_unknown_key(struct reader *r, const struct json *member,
                  const struct family *family, const struct kind *kind)
{
    const char *words[WORDS_MAX];
    size_t count = 0;
    if (!can_tell(r))
        return fault_key(r, ERROR_PROPERTY_UNKNOWN, member, NULL, NULL, "key");
    if (family != NULL)
        words[count++] = "type";
    for (size_t i = 0; family != NULL && i < family->common_count; i++)
        words[count++] = family->common[i].name;
    for (size_t i = 0; i < kind->field_count && count < WORDS_MAX; i++)
        words[count++] = kind->fields[i].name;

    size_t len = strlen(member->key);
    const char *said =
        arena_strndup(r->arena, member->key, len < 64 ? len : 64);
    const char *hint = foreign_name(member, kind);
    const char *fix = NULL;
    const struct kind *owner = owner_of(family, kind, member->key);
    if (hint == NULL && family != NULL && owner != NULL) {
        hint =
            arena_printf(r->arena, "`%s` belongs to the %s `%s`, not to `%s`",
                         member->key, family->noun, owner->name, kind->name);
    } else if (hint == NULL) {
        const char *nearest = json_did_you_mean(member->key, words, count);
        if (nearest != NULL && json_member(member->parent, nearest) == NULL)
            fix = patch(r, PATCH_MOVE, member, nearest, 0);
        hint = nearest != NULL
                   ? arena_printf(r->arena, "did you mean `%s`?", nearest)
                   : list_words(r, "known here: ", words, count);
    }
    return fault_key(r, ERROR_PROPERTY_UNKNOWN, member, hint, fix,
                     "unknown property `%s`", said ? said : "");
}
