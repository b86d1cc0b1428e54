#include "core/base/json_scan.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_keys.h"
#include "core/base/utf8.h"

enum {
    NUMBER_CHARACTERS = 63 /* cJSON copies a number into 64 bytes */
};

/* An open array or object. */
struct level {
    bool is_object;
    uint32_t place;     /* its own */
    uint32_t index;     /* array: of the element under way */
    uint32_t first_key; /* object: its keys start here in scan.keys */
};

struct scan {
    const char *text;
    size_t len, at;
    size_t line_start;   /* byte where the line begins */
    size_t continuation; /* bytes of this line that begin no character */
    uint32_t line;
    const struct json_limits *limits;
    struct json_places *places;
    struct error_list *errors;
    struct level *levels; /* [max_depth] */
    uint32_t depth;
    struct json_keys keys; /* of all open objects, outermost first */
    bool failed;
};

void
json_places_clear(struct json_places *places)
{
    free(places->items);
    *places = (struct json_places){0};
}

static uint32_t
column_of(const struct scan *s)
{
    return (uint32_t)(s->at - s->line_start - s->continuation + 1);
}

/* Room for one more in a growing heap array. */
static bool
grow(void **items, size_t count, size_t *capacity, size_t size)
{
    if (count < *capacity)
        return true;
    size_t more = *capacity == 0 ? 64 : *capacity * 2;
    void *moved = realloc(*items, more * size);
    if (moved == NULL)
        return false;
    *items = moved;
    *capacity = more;
    return true;
}

static bool
no_memory(struct scan *s)
{
    s->failed = true;
    error_list_add(s->errors, ERROR_MEMORY, NULL, 0, 0, NULL, NULL,
                   "no memory to read a document of %zu bytes", s->len);
    return false;
}

/* --- errors ---------------------------------------------------------------- */

/* The pointer of the value under way at `depth` open levels; `last` replaces
 * the innermost name. */
static void
pointer_here(const struct scan *s, uint32_t depth, const struct json_key *last,
             struct bytes *out)
{
    for (uint32_t d = 0; d < depth; d++) {
        const struct level *level = &s->levels[d];
        bytes_text(out, "/");
        if (!level->is_object) {
            bytes_printf(out, "%u", level->index);
            continue;
        }
        size_t keys =
            d + 1 < s->depth ? s->levels[d + 1].first_key : s->keys.count;
        const struct json_key *key = &s->keys.items[keys - 1];
        json_key_token(last != NULL && d + 1 == depth ? last : key, out);
    }
}

static bool
report_duplicate(struct scan *s, uint32_t depth, const struct json_key *key,
                 const struct json_key *original)
{
    struct bytes pointer = {0};
    pointer_here(s, depth, key, &pointer);
    error_list_add(s->errors, ERROR_JSON_DUPLICATE_KEY,
                   pointer.failed ? NULL : pointer.data, key->line, key->column,
                   "keep one of the two", NULL,
                   "`%.*s` appears twice; the first is on line %u",
                   key->len > 64 ? 64 : (int)key->len, key->text,
                   original->line);
    bytes_clear(&pointer);
    s->failed = true;
    return false;
}

/* The earliest duplicate of all open objects, outermost first (an outer one
 * is never later than what it holds). True if it was reported. */
static bool
reported_duplicate(struct scan *s)
{
    for (uint32_t d = 0; d < s->depth; d++) {
        const struct json_key *key, *original;
        size_t first = s->levels[d].first_key;
        size_t end =
            d + 1 < s->depth ? s->levels[d + 1].first_key : s->keys.count;
        if (!json_keys_duplicate(&s->keys, first, end, &key, &original)) {
            no_memory(s);
            return true;
        }
        if (key != NULL) {
            report_duplicate(s, d + 1, key, original);
            return true;
        }
    }
    return false;
}

/* Everything but a duplicate: a duplicate that stands before it wins. */
static bool
fail_hint(struct scan *s, enum error_code code, const char *pointer,
          const char *hint, const char *detail)
{
    if (s->failed || reported_duplicate(s))
        return false;
    s->failed = true;
    return error_list_add(s->errors, code, pointer, s->line, column_of(s), hint,
                          NULL, "%s", detail);
}

static bool
fail(struct scan *s, enum error_code code, const char *detail)
{
    return fail_hint(s, code, NULL, NULL, detail);
}

static const char *
or_text(const char *text, const char *other)
{
    return text != NULL ? text : other;
}

/* "expected a value, found `]` after a comma" */
static bool
unexpected(struct scan *s, const char *expected, const char *after)
{
    const char *hint = NULL;
    char found[24];
    if (s->at >= s->len)
        return fail_hint(s, ERROR_JSON_SYNTAX, NULL,
                         "the text is cut short: close every bracket and quote",
                         or_text(arena_printf(s->errors->arena,
                                              "expected %s, found the end of "
                                              "the text",
                                              expected),
                                 "the text is cut short"));
    unsigned char c = (unsigned char)s->text[s->at];
    size_t n = utf8_length(s->text + s->at, s->len - s->at);
    if (n == 0)
        return fail(s, ERROR_JSON_UTF8, "this byte is not UTF-8");
    if (c < 0x20 || c == 0x7f)
        return fail_hint(s, ERROR_JSON_CONTROL_CHARACTER, NULL, NULL,
                         "a control character outside of a string");
    memcpy(found, s->text + s->at, n);
    found[n] = '\0';
    if (c == '\'')
        hint = "JSON strings stand in double quotes";
    else if (c == '/' || c == '#')
        hint = "JSON has no comments; `description` and `extras` take text";
    else if ((c == ']' || c == '}') && after[0] != '\0')
        hint = "remove the comma before it";
    else if (c == 'N' || c == 'I')
        hint = "JSON knows neither NaN nor Infinity";
    else if (c == '+' || c == '.')
        hint = "a number begins with a digit or with -";
    else if (c == 'T' || c == 'F')
        hint = "write true and false in small letters";
    const char *detail = arena_printf(
        s->errors->arena, "expected %s, found `%s`%s", expected, found, after);
    return fail_hint(s, ERROR_JSON_SYNTAX, NULL, hint,
                     or_text(detail, "the text is not JSON"));
}

/* --- tokens ---------------------------------------------------------------- */

static void
skip_space(struct scan *s)
{
    while (s->at < s->len) {
        char c = s->text[s->at];
        if (c != ' ' && c != '\t' && c != '\n' && c != '\r')
            return;
        s->at++;
        if (c == '\n' ||
            (c == '\r' && (s->at == s->len || s->text[s->at] != '\n'))) {
            s->line++;
            s->line_start = s->at;
            s->continuation = 0;
        }
    }
}

static bool
at(const struct scan *s, char c)
{
    return s->at < s->len && s->text[s->at] == c;
}

static bool
at_digit(const struct scan *s)
{
    return s->at < s->len && s->text[s->at] >= '0' && s->text[s->at] <= '9';
}

/* A \u escape: one code point, from one or two escapes; moves past it. */
static bool
scan_unicode(struct scan *s)
{
    int32_t unit = json_hex4(s->text, s->len, s->at + 2);
    if (unit < 0)
        return fail(s, ERROR_JSON_SYNTAX, "\\u needs four hex digits");
    if (unit == 0)
        return fail(s, ERROR_JSON_CONTROL_CHARACTER,
                    "\\u0000 is not allowed in a string");
    size_t size = 6;
    if (unit >= 0xd800 && unit <= 0xdfff) {
        int32_t low = -1;
        if (unit <= 0xdbff && s->len > s->at + 7 &&
            s->text[s->at + 6] == '\\' && s->text[s->at + 7] == 'u')
            low = json_hex4(s->text, s->len, s->at + 8);
        if (low < 0xdc00 || low > 0xdfff)
            return fail(s, ERROR_JSON_UTF8,
                        "half of a surrogate pair stands alone");
        size = 12;
    }
    s->at += size;
    return true;
}

/* From the opening quote to behind the closing one. */
static bool
scan_string(struct scan *s, bool *escaped)
{
    *escaped = false;
    s->at++;
    for (;;) {
        if (s->at >= s->len)
            return unexpected(s, "the closing quote of a string", "");
        unsigned char c = (unsigned char)s->text[s->at];
        if (c == '"') {
            s->at++;
            return true;
        }
        if (c < 0x20)
            return fail_hint(s, ERROR_JSON_CONTROL_CHARACTER, NULL,
                             "write \\n for a line break, \\t for a tab; or a "
                             "closing quote is missing",
                             "a raw control character inside a string");
        if (c == '\\') {
            *escaped = true;
            char e = s->at + 1 < s->len ? s->text[s->at + 1] : '\0';
            if (e == 'u') {
                if (!scan_unicode(s))
                    return false;
                continue;
            }
            if (e == '\0' || strchr("\"\\/bfnrt", e) == NULL)
                return fail_hint(s, ERROR_JSON_SYNTAX, NULL,
                                 "a backslash itself is written \\\\",
                                 "unknown escape in a string");
            s->at += 2;
            continue;
        }
        size_t n = utf8_length(s->text + s->at, s->len - s->at);
        if (n == 0)
            return fail(s, ERROR_JSON_UTF8, "this byte is not UTF-8");
        s->at += n;
        s->continuation += n - 1;
    }
}

static bool
scan_digits(struct scan *s)
{
    if (!at_digit(s))
        return unexpected(s, "a digit", "");
    while (at_digit(s))
        s->at++;
    return true;
}

static bool
number_in_range(struct scan *s, size_t begin, bool has_exponent)
{
    char copy[NUMBER_CHARACTERS + 1];
    const char *wrong = NULL;
    size_t len = s->at - begin;
    if (len > NUMBER_CHARACTERS) {
        wrong = "a number of more than 63 characters";
    } else if (has_exponent) {
        memcpy(copy, s->text + begin, len);
        copy[len] = '\0';
        double number = strtod(copy, NULL);
        if (isinf(number))
            wrong = or_text(arena_printf(s->errors->arena,
                                         "%s is beyond double precision", copy),
                            "the number is beyond double precision");
    }
    if (wrong == NULL)
        return true;
    struct bytes pointer = {0};
    pointer_here(s, s->depth, NULL, &pointer);
    bytes_append(&pointer, "", 0);
    s->at = begin;
    fail_hint(s, ERROR_JSON_NUMBER_RANGE, pointer.failed ? NULL : pointer.data,
              NULL, wrong);
    bytes_clear(&pointer);
    return false;
}

static bool
scan_number(struct scan *s)
{
    size_t begin = s->at;
    bool has_exponent = false;
    if (at(s, '-'))
        s->at++;
    if (at(s, '0')) {
        s->at++;
        if (at_digit(s))
            return fail(s, ERROR_JSON_SYNTAX,
                        "a number must not begin with a zero");
    } else if (!scan_digits(s)) {
        return false;
    }
    if (at(s, '.')) {
        s->at++;
        if (!scan_digits(s))
            return false;
    }
    if (at(s, 'e') || at(s, 'E')) {
        has_exponent = true;
        s->at++;
        if (at(s, '+') || at(s, '-'))
            s->at++;
        if (!scan_digits(s))
            return false;
    }
    return number_in_range(s, begin, has_exponent);
}

static bool
scan_word(struct scan *s, const char *word, const char *after)
{
    size_t len = strlen(word);
    if (s->len - s->at < len || memcmp(s->text + s->at, word, len) != 0)
        return unexpected(s, "a value", after);
    s->at += len;
    return true;
}

/* --- structure ------------------------------------------------------------- */

/* `"name" :`; leaves the key on top of the keys. */
static bool
scan_key(struct scan *s, const char *after)
{
    skip_space(s);
    struct json_key key = {
        .offset = (uint32_t)s->at, .line = s->line, .column = column_of(s)};
    bool escaped;
    if (!at(s, '"'))
        return unexpected(s, "a member name in double quotes", after);
    if (!scan_string(s, &escaped))
        return false;
    key.text = s->text + key.offset + 1;
    key.len = (uint32_t)(s->at - key.offset - 2);
    if (escaped) {
        key.decoded =
            json_key_decode(s->text, key.offset + 1, s->at - 1, &key.len);
        if (key.decoded == NULL)
            return no_memory(s);
        key.text = key.decoded;
    }
    if (!json_keys_add(&s->keys, &key))
        return no_memory(s);
    skip_space(s);
    if (!at(s, ':'))
        return unexpected(s, "`:` after a member name", "");
    s->at++;
    return true;
}

static bool
open_level(struct scan *s, bool is_object)
{
    if (s->depth == s->limits->max_depth)
        return fail(s, ERROR_JSON_DEPTH,
                    or_text(arena_printf(s->errors->arena,
                                         "more than %u brackets are open",
                                         s->limits->max_depth),
                            "too many brackets are open"));
    s->levels[s->depth++] = (struct level){
        .is_object = is_object,
        .place = (uint32_t)(s->places->count - 1),
        .first_key = (uint32_t)s->keys.count,
    };
    s->at++;
    return true;
}

static bool
close_level(struct scan *s)
{
    struct level *level = &s->levels[s->depth - 1];
    if (level->is_object) {
        const struct json_key *key, *original;
        if (!json_keys_duplicate(&s->keys, level->first_key, s->keys.count,
                                 &key, &original))
            return no_memory(s);
        if (key != NULL) {
            reported_duplicate(s);
            return false;
        }
        json_keys_drop(&s->keys, level->first_key);
    }
    s->at++;
    s->places->items[level->place].end = (uint32_t)s->at;
    s->depth--;
    return true;
}

static bool
new_place(struct scan *s)
{
    struct json_places *places = s->places;
    if (places->count == s->limits->max_values)
        return fail(
            s, ERROR_BUDGET_LIST,
            or_text(arena_printf(s->errors->arena, "more than %zu values",
                                 s->limits->max_values),
                    "too many values"));
    if (!grow((void **)&places->items, places->count, &places->capacity,
              sizeof(struct json_place)))
        return no_memory(s);
    struct json_place *place = &places->items[places->count++];
    *place = (struct json_place){
        .begin = (uint32_t)s->at, .line = s->line, .column = column_of(s)};
    if (s->depth > 0 && s->levels[s->depth - 1].is_object) {
        const struct json_key *key = &s->keys.items[s->keys.count - 1];
        place->key_line = key->line;
        place->key_column = key->column;
    }
    return true;
}

/* A value up to its end, or, for an array or object that holds something, up
 * to the first thing in it; then *inside is true. */
static bool
scan_value(struct scan *s, const char *after, bool *inside)
{
    bool escaped, ok;
    *inside = false;
    skip_space(s);
    if (s->at >= s->len)
        return unexpected(s, "a value", "");
    if (!new_place(s))
        return false;
    size_t place = s->places->count - 1;
    char c = s->text[s->at];
    if (c == '{' || c == '[') {
        if (!open_level(s, c == '{'))
            return false;
        skip_space(s);
        *inside = !at(s, c == '{' ? '}' : ']');
        return *inside ? true : close_level(s);
    }
    if (c == '"')
        ok = scan_string(s, &escaped);
    else if (c == '-' || at_digit(s))
        ok = scan_number(s);
    else if (c == 't')
        ok = scan_word(s, "true", after);
    else if (c == 'f')
        ok = scan_word(s, "false", after);
    else if (c == 'n')
        ok = scan_word(s, "null", after);
    else
        ok = unexpected(s, "a value", after);
    s->places->items[place].end = (uint32_t)s->at;
    return ok;
}

/* What follows a value: commas lead on, brackets close. True with *more set to
 * whether another value follows. */
static bool
scan_after(struct scan *s, bool *more)
{
    while (s->depth > 0) {
        struct level *level = &s->levels[s->depth - 1];
        skip_space(s);
        if (at(s, ',')) {
            s->at++;
            level->index++;
            *more = true;
            return level->is_object ? scan_key(s, " after a comma") : true;
        }
        if (!at(s, level->is_object ? '}' : ']'))
            return unexpected(s, level->is_object ? "`,` or `}`" : "`,` or `]`",
                              "");
        if (!close_level(s))
            return false;
    }
    *more = false;
    return true;
}

static bool
scan_document(struct scan *s)
{
    const char *after = "";
    bool more = true;
    while (more) {
        bool inside;
        if (!scan_value(s, after, &inside))
            return false;
        after = "";
        if (inside) {
            if (s->levels[s->depth - 1].is_object && !scan_key(s, ""))
                return false;
            continue;
        }
        if (!scan_after(s, &more))
            return false;
        after = s->depth > 0 && !s->levels[s->depth - 1].is_object
                    ? " after a comma"
                    : "";
    }
    skip_space(s);
    if (s->at < s->len)
        return fail_hint(s, ERROR_JSON_TRAILING_DATA, NULL,
                         "a document is one value; remove what follows it",
                         "text after the end of the document");
    return true;
}

bool
json_scan(const char *text, size_t len, const struct json_limits *limits,
          struct json_places *places, struct error_list *errors)
{
    struct scan s = {.text = text,
                     .len = len,
                     .line = 1,
                     .limits = limits,
                     .places = places,
                     .errors = errors};
    s.levels = calloc(limits->max_depth, sizeof(struct level));
    bool ok = s.levels != NULL || no_memory(&s);
    if (len >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0)
        s.at = s.line_start = 3;
    ok = ok && scan_document(&s);
    json_keys_drop(&s.keys, 0);
    free(s.keys.items);
    free(s.levels);
    return ok;
}
