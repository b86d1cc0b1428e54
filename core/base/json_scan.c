#include "core/base/json_scan.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/utf8.h"

enum {
    NUMBER_CHARACTERS = 63 /* cJSON copies a number into 64 bytes */
};

/* A member name, decoded when it holds escapes. */
struct key {
    const char *text;
    char *decoded; /* heap, or NULL */
    uint32_t len;
    uint32_t offset; /* of its opening quote */
    uint32_t line, column;
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
    struct key *keys; /* of all open objects, outermost first */
    size_t key_count, key_capacity;
    bool failed;
};

void json_places_clear(struct json_places *places)
{
    free(places->items);
    *places = (struct json_places){0};
}

static uint32_t column_of(const struct scan *s)
{
    return (uint32_t)(s->at - s->line_start - s->continuation + 1);
}

/* Room for one more in a growing heap array. */
static bool grow(void **items, size_t count, size_t *capacity, size_t size)
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

static bool no_memory(struct scan *s)
{
    s->failed = true;
    error_list_add(s->errors, ERROR_MEMORY, NULL, 0, 0, NULL, NULL,
                   "no memory to read a document of %zu bytes", s->len);
    return false;
}

/* --- duplicate names ----------------------------------------------------- */

static int key_compare(const void *left, const void *right)
{
    const struct key *a = *(const struct key *const *)left;
    const struct key *b = *(const struct key *const *)right;
    size_t len = a->len < b->len ? a->len : b->len;
    int order = memcmp(a->text, b->text, len);
    if (order != 0)
        return order;
    if (a->len != b->len)
        return a->len < b->len ? -1 : 1;
    return a->offset < b->offset ? -1 : 1; /* equal names: document order */
}

static bool same_name(const struct key *a, const struct key *b)
{
    return a->len == b->len && memcmp(a->text, b->text, a->len) == 0;
}

/* The earliest key of keys[first...count) that repeats another one, with that
 * one in *original, or NULL. Sorted, so n log n whatever the names are; merge
 * sort in glibc, so no input makes it slow. */
static const struct key *find_duplicate(struct scan *s, size_t first,
                                        const struct key **original)
{
    size_t count = s->key_count - first;
    const struct key *found = NULL;
    if (count < 2)
        return NULL;
    const struct key **sorted = malloc(count * sizeof(const struct key *));
    if (sorted == NULL) {
        no_memory(s);
        return NULL;
    }
    for (size_t i = 0; i < count; i++)
        sorted[i] = &s->keys[first + i];
    if (count <= 8) {
        for (size_t i = 1; i < count; i++) {
            for (size_t j = i;
                 j > 0 && key_compare(&sorted[j - 1], &sorted[j]) > 0; j--) {
                const struct key *swap = sorted[j];
                sorted[j] = sorted[j - 1];
                sorted[j - 1] = swap;
            }
        }
    } else {
        qsort(sorted, count, sizeof(const struct key *), key_compare);
    }
    for (size_t i = 0, run = 0; i < count; i++) {
        if (!same_name(sorted[run], sorted[i]))
            run = i;
        if (i > run && (found == NULL || sorted[i]->offset < found->offset)) {
            found = sorted[i];
            *original = sorted[run];
        }
    }
    free(sorted);
    return found;
}

static void drop_keys(struct scan *s, size_t first)
{
    while (s->key_count > first)
        free(s->keys[--s->key_count].decoded);
}

/* --- errors ---------------------------------------------------------------- */

static void pointer_token(struct bytes *out, const struct key *key)
{
    for (uint32_t i = 0; i < key->len; i++) {
        if (key->text[i] == '~')
            bytes_text(out, "~0");
        else if (key->text[i] == '/')
            bytes_text(out, "~1");
        else
            bytes_append(out, &key->text[i], 1);
    }
}

/* The pointer of the value under way at `depth` open levels; `last` replaces
 * the innermost name. */
static void pointer_here(const struct scan *s, uint32_t depth,
                         const struct key *last, struct bytes *out)
{
    for (uint32_t d = 0; d < depth; d++) {
        const struct level *level = &s->levels[d];
        bytes_text(out, "/");
        if (!level->is_object) {
            bytes_printf(out, "%u", level->index);
            continue;
        }
        size_t keys =
            d + 1 < s->depth ? s->levels[d + 1].first_key : s->key_count;
        const struct key *key = &s->keys[keys - 1];
        pointer_token(out, last != NULL && d + 1 == depth ? last : key);
    }
}

static bool report_duplicate(struct scan *s, uint32_t depth,
                             const struct key *key, const struct key *original)
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
static bool reported_duplicate(struct scan *s)
{
    size_t all = s->key_count;
    for (uint32_t d = 0; d < s->depth && !s->failed; d++) {
        if (!s->levels[d].is_object)
            continue;
        s->key_count = d + 1 < s->depth ? s->levels[d + 1].first_key : all;
        const struct key *original = NULL;
        const struct key *key =
            find_duplicate(s, s->levels[d].first_key, &original);
        s->key_count = all;
        if (key != NULL) {
            report_duplicate(s, d + 1, key, original);
            return true;
        }
    }
    return s->failed;
}

/* Everything but a duplicate: a duplicate that stands before it wins. */
static bool fail_hint(struct scan *s, enum error_code code, const char *pointer,
                      const char *hint, const char *detail)
{
    if (s->failed || reported_duplicate(s))
        return false;
    s->failed = true;
    return error_list_add(s->errors, code, pointer, s->line, column_of(s), hint,
                          NULL, "%s", detail);
}

static bool fail(struct scan *s, enum error_code code, const char *detail)
{
    return fail_hint(s, code, NULL, NULL, detail);
}

static const char *or_text(const char *text, const char *other)
{
    return text != NULL ? text : other;
}

/* "expected a value, found `]` after a comma" */
static bool unexpected(struct scan *s, const char *expected, const char *after)
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

static void skip_space(struct scan *s)
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

static bool at(const struct scan *s, char c)
{
    return s->at < s->len && s->text[s->at] == c;
}

static bool at_digit(const struct scan *s)
{
    return s->at < s->len && s->text[s->at] >= '0' && s->text[s->at] <= '9';
}

static int hex_value(char c)
{
    if (c >= '0' && c <= '9')
        return c - '0';
    if (c >= 'a' && c <= 'f')
        return c - 'a' + 10;
    if (c >= 'A' && c <= 'F')
        return c - 'A' + 10;
    return -1;
}

/* Four hex digits at text[at], or -1. */
static int32_t hex4(const char *text, size_t len, size_t at_byte)
{
    int32_t value = 0;
    if (len < at_byte + 4)
        return -1;
    for (size_t i = at_byte; i < at_byte + 4; i++) {
        int digit = hex_value(text[i]);
        if (digit < 0)
            return -1;
        value = value * 16 + digit;
    }
    return value;
}

/* A \u escape: one code point, from one or two escapes; moves past it. */
static bool scan_unicode(struct scan *s)
{
    int32_t unit = hex4(s->text, s->len, s->at + 2);
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
            low = hex4(s->text, s->len, s->at + 8);
        if (low < 0xdc00 || low > 0xdfff)
            return fail(s, ERROR_JSON_UTF8,
                        "half of a surrogate pair stands alone");
        size = 12;
    }
    s->at += size;
    return true;
}

/* From the opening quote to behind the closing one. */
static bool scan_string(struct scan *s, bool *escaped)
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

static bool scan_digits(struct scan *s)
{
    if (!at_digit(s))
        return unexpected(s, "a digit", "");
    while (at_digit(s))
        s->at++;
    return true;
}

static bool number_in_range(struct scan *s, size_t begin, bool has_exponent)
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

static bool scan_number(struct scan *s)
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

static bool scan_word(struct scan *s, const char *word, const char *after)
{
    size_t len = strlen(word);
    if (s->len - s->at < len || memcmp(s->text + s->at, word, len) != 0)
        return unexpected(s, "a value", after);
    s->at += len;
    return true;
}

/* --- structure ------------------------------------------------------------- */

/* The name in text[begin...end), without its quotes, escapes resolved. The scan
 * has checked it. */
static char *decode_name(const char *text, size_t begin, size_t end,
                         uint32_t *len)
{
    static const char from[] = "bfnrt", to[] = "\b\f\n\r\t";
    char *out = malloc(end - begin + 1);
    size_t n = 0;
    if (out == NULL)
        return NULL;
    for (size_t i = begin; i < end;) {
        if (text[i] != '\\') {
            out[n++] = text[i++];
        } else if (text[i + 1] != 'u') {
            const char *e = strchr(from, text[i + 1]);
            out[n++] = e != NULL ? to[e - from] : text[i + 1];
            i += 2;
        } else {
            uint32_t c = (uint32_t)hex4(text, end, i + 2);
            i += 6;
            if (c >= 0xd800 && c <= 0xdfff) {
                c = 0x10000 + ((c - 0xd800) << 10) +
                    ((uint32_t)hex4(text, end, i + 2) - 0xdc00);
                i += 6;
            }
            n += utf8_put(c, out + n);
        }
    }
    *len = (uint32_t)n;
    return out;
}

/* `"name" :`; leaves the key on top of the keys. */
static bool scan_key(struct scan *s, const char *after)
{
    skip_space(s);
    struct key key = {
        .offset = (uint32_t)s->at, .line = s->line, .column = column_of(s)};
    bool escaped;
    if (!at(s, '"'))
        return unexpected(s, "a member name in double quotes", after);
    if (!scan_string(s, &escaped))
        return false;
    key.text = s->text + key.offset + 1;
    key.len = (uint32_t)(s->at - key.offset - 2);
    if (escaped) {
        key.decoded = decode_name(s->text, key.offset + 1, s->at - 1, &key.len);
        if (key.decoded == NULL)
            return no_memory(s);
        key.text = key.decoded;
    }
    if (!grow((void **)&s->keys, s->key_count, &s->key_capacity, sizeof key)) {
        free(key.decoded);
        return no_memory(s);
    }
    s->keys[s->key_count++] = key;
    skip_space(s);
    if (!at(s, ':'))
        return unexpected(s, "`:` after a member name", "");
    s->at++;
    return true;
}

static bool open_level(struct scan *s, bool is_object)
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
        .first_key = (uint32_t)s->key_count,
    };
    s->at++;
    return true;
}

static bool close_level(struct scan *s)
{
    struct level *level = &s->levels[s->depth - 1];
    if (level->is_object) {
        const struct key *original = NULL;
        if (find_duplicate(s, level->first_key, &original) != NULL) {
            reported_duplicate(s);
            return false;
        }
        if (s->failed)
            return false;
        drop_keys(s, level->first_key);
    }
    s->at++;
    s->places->items[level->place].end = (uint32_t)s->at;
    s->depth--;
    return true;
}

static bool new_place(struct scan *s)
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
        const struct key *key = &s->keys[s->key_count - 1];
        place->key_line = key->line;
        place->key_column = key->column;
    }
    return true;
}

/* A value up to its end, or, for an array or object that holds something, up
 * to the first thing in it; then *inside is true. */
static bool scan_value(struct scan *s, const char *after, bool *inside)
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
static bool scan_after(struct scan *s, bool *more)
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

static bool scan_document(struct scan *s)
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

bool json_scan(const char *text, size_t len, const struct json_limits *limits,
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
    drop_keys(&s, 0);
    free(s.keys);
    free(s.levels);
    return ok;
}
