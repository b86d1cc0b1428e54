/* Every refusal of the strict reader, with its place; and what it reads. */

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/clock.h"
#include "core/base/json.h"

struct reading {
    struct arena arena;
    struct error_list errors;
    const struct json *root;
};

static void
begin(struct reading *r, const char *text, size_t len,
      const struct json_limits *limits)
{
    memset(r, 0, sizeof *r);
    arena_init(&r->arena, 0);
    r->errors.arena = &r->arena;
    r->root = json_read(text, len, limits, &r->arena, &r->errors);
}

static void
end(struct reading *r)
{
    arena_clear(&r->arena);
}

struct refusal {
    const char *text;
    enum error_code code;
    const char *pointer;
    uint32_t line, column;
};

static void
refused_with_place(void **unused)
{
    static const struct refusal rows[] = {
        /* syntax */
        {"", ERROR_JSON_SYNTAX, NULL, 1, 1},
        {"  \n ", ERROR_JSON_SYNTAX, NULL, 2, 2},
        {"[1, 2", ERROR_JSON_SYNTAX, NULL, 1, 6},
        {"[1, 2,]", ERROR_JSON_SYNTAX, NULL, 1, 7},
        {"[,1]", ERROR_JSON_SYNTAX, NULL, 1, 2},
        {"[1 2]", ERROR_JSON_SYNTAX, NULL, 1, 4},
        {"{\"a\" 1}", ERROR_JSON_SYNTAX, NULL, 1, 6},
        {"{\"a\":}", ERROR_JSON_SYNTAX, NULL, 1, 6},
        {"{\"a\":1,}", ERROR_JSON_SYNTAX, NULL, 1, 8},
        {"{a:1}", ERROR_JSON_SYNTAX, NULL, 1, 2},
        {"{1:1}", ERROR_JSON_SYNTAX, NULL, 1, 2},
        {"[1}", ERROR_JSON_SYNTAX, NULL, 1, 3},
        {"]", ERROR_JSON_SYNTAX, NULL, 1, 1},
        {"'a'", ERROR_JSON_SYNTAX, NULL, 1, 1},
        {"tru", ERROR_JSON_SYNTAX, NULL, 1, 1},
        {"True", ERROR_JSON_SYNTAX, NULL, 1, 1},
        {"NaN", ERROR_JSON_SYNTAX, NULL, 1, 1},
        {"[-Infinity]", ERROR_JSON_SYNTAX, NULL, 1, 3},
        {"// c\n1", ERROR_JSON_SYNTAX, NULL, 1, 1},
        {"\"abc", ERROR_JSON_SYNTAX, NULL, 1, 5},
        {"\"a\\x\"", ERROR_JSON_SYNTAX, NULL, 1, 3},
        {"\"a\\", ERROR_JSON_SYNTAX, NULL, 1, 3},
        {"\"\\u12g4\"", ERROR_JSON_SYNTAX, NULL, 1, 2},
        {"\"\\u12", ERROR_JSON_SYNTAX, NULL, 1, 2},
        /* numbers */
        {"01", ERROR_JSON_SYNTAX, NULL, 1, 2},
        {"-01", ERROR_JSON_SYNTAX, NULL, 1, 3},
        {"1.", ERROR_JSON_SYNTAX, NULL, 1, 3},
        {"[1.]", ERROR_JSON_SYNTAX, NULL, 1, 4},
        {".5", ERROR_JSON_SYNTAX, NULL, 1, 1},
        {"+1", ERROR_JSON_SYNTAX, NULL, 1, 1},
        {"-", ERROR_JSON_SYNTAX, NULL, 1, 2},
        {"1e", ERROR_JSON_SYNTAX, NULL, 1, 3},
        {"1e+", ERROR_JSON_SYNTAX, NULL, 1, 4},
        {"0x10", ERROR_JSON_TRAILING_DATA, NULL, 1, 2},
        {"1e999", ERROR_JSON_NUMBER_RANGE, "", 1, 1},
        {"{\"a\":[0, -1e400]}", ERROR_JSON_NUMBER_RANGE, "/a/1", 1, 10},
        {"{\"a/b\":{\"~\":1e309}}", ERROR_JSON_NUMBER_RANGE, "/a~1b/~0", 1, 13},
        {"[0.1000000000000000000000000000000000000000000000000000000000000001]",
         ERROR_JSON_NUMBER_RANGE, "/0", 1, 2},
        /* trailing data */
        {"1 2", ERROR_JSON_TRAILING_DATA, NULL, 1, 3},
        {"{}\n\n{}", ERROR_JSON_TRAILING_DATA, NULL, 3, 1},
        /* duplicate names */
        {"{\"a\":1,\n \"a\":2}", ERROR_JSON_DUPLICATE_KEY, "/a", 2, 2},
        {"{\"a\":1,\"\\u0061\":2}", ERROR_JSON_DUPLICATE_KEY, "/a", 1, 8},
        {"{\"\":1,\"\":2}", ERROR_JSON_DUPLICATE_KEY, "/", 1, 7},
        {"{\"x\":[{\"k\":0},{\"k\":1,\"j\":2,\"k\":3}]}",
         ERROR_JSON_DUPLICATE_KEY, "/x/1/k", 1, 28},
        /* the first mistake wins, whatever it is */
        {"{\"a\":1,\"a\":1e999}", ERROR_JSON_DUPLICATE_KEY, "/a", 1, 8},
        {"{\"a\":1,\"a\":{\"b\":1,\"b\":2}}", ERROR_JSON_DUPLICATE_KEY, "/a", 1,
         8},
        {"{\"a\":1,\"a\":2 ]", ERROR_JSON_DUPLICATE_KEY, "/a", 1, 8},
        {"{\"b\":1e999,\"a\":1,\"a\":2}", ERROR_JSON_NUMBER_RANGE, "/b", 1, 6},
        /* characters */
        {"\"a\tb\"", ERROR_JSON_CONTROL_CHARACTER, NULL, 1, 3},
        {"\"a\nb\"", ERROR_JSON_CONTROL_CHARACTER, NULL, 1, 3},
        {"\"\\u0000\"", ERROR_JSON_CONTROL_CHARACTER, NULL, 1, 2},
        {"[\x01]", ERROR_JSON_CONTROL_CHARACTER, NULL, 1, 2},
        {"\"\xff\"", ERROR_JSON_UTF8, NULL, 1, 2},
        {"\"\xc0\x80\"", ERROR_JSON_UTF8, NULL, 1, 2},
        {"\"\xed\xa0\x80\"", ERROR_JSON_UTF8, NULL, 1, 2},
        {"\"\xf4\x90\x80\x80\"", ERROR_JSON_UTF8, NULL, 1, 2},
        {"\"\xc3\"", ERROR_JSON_UTF8, NULL, 1, 2},
        {"\"\\ud800\"", ERROR_JSON_UTF8, NULL, 1, 2},
        {"\"\\udc00\"", ERROR_JSON_UTF8, NULL, 1, 2},
        {"\"\\ud800\\u0041\"", ERROR_JSON_UTF8, NULL, 1, 2},
        {"\xff", ERROR_JSON_UTF8, NULL, 1, 1},
        /* columns count characters, lines end with LF, CR LF or CR */
        {"[\"\xc3\xa9\xe2\x82\xac\xf0\x9f\x98\x80\" 1]", ERROR_JSON_SYNTAX,
         NULL, 1, 8},
        {"[1,\r\n 2,\r 3,\n ]", ERROR_JSON_SYNTAX, NULL, 4, 2},
        {"\xef\xbb\xbf[1,]", ERROR_JSON_SYNTAX, NULL, 1, 4},
    };
    (void)unused;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        struct reading r;
        const struct refusal *row = &rows[i];
        begin(&r, row->text, strlen(row->text), NULL);
        if (r.root != NULL || r.errors.count != 1)
            fail_msg("row %zu %s: %zu errors", i, row->text, r.errors.count);
        const struct error_item *e = &r.errors.items[0];
        if (e->code != row->code || e->line != row->line ||
            e->column != row->column ||
            (e->pointer == NULL) != (row->pointer == NULL) ||
            (e->pointer != NULL && strcmp(e->pointer, row->pointer) != 0))
            fail_msg("row %zu %s: got %s %s %u:%u", i, row->text,
                     error_code_name(e->code), e->pointer ? e->pointer : "null",
                     e->line, e->column);
        assert_non_null(e->detail);
        end(&r);
    }
}

static void
a_nul_byte_is_refused(void **unused)
{
    static const char text[] = "[1,\0 2]";
    struct reading r;
    (void)unused;
    begin(&r, text, sizeof text - 1, NULL);
    assert_null(r.root);
    assert_int_equal(r.errors.items[0].code, ERROR_JSON_CONTROL_CHARACTER);
    assert_int_equal(r.errors.items[0].column, 4);
    end(&r);
}

static void
every_prefix_of_a_document_is_refused(void **unused)
{
    static const char text[] =
        "{\"a\": [1, -2.5e3, true, null], \"\\u00e9\": {\"b\": \"x\\n\"}}";
    struct reading r;
    (void)unused;
    begin(&r, text, strlen(text), NULL);
    assert_non_null(r.root);
    end(&r);
    for (size_t len = 0; len < strlen(text); len++) {
        begin(&r, text, len, NULL);
        assert_null(r.root);
        assert_int_equal(r.errors.count, 1);
        assert_int_equal(r.errors.items[0].code, ERROR_JSON_SYNTAX);
        end(&r);
    }
}

static void
a_tree_has_places_and_values(void **unused)
{
    static const char text[] = "{\"a\": [1, \"\\u20ac\\n\"],\n"
                               " \"b\": {\"c\": null}, \"d\": -2.5e3}";
    struct reading r;
    (void)unused;
    begin(&r, text, strlen(text), NULL);
    assert_non_null(r.root);
    assert_int_equal(r.root->count, 3);
    const struct json *a = json_member(r.root, "a");
    assert_int_equal(a->type, JSON_ARRAY);
    assert_int_equal(a->column, 7);
    assert_int_equal(a->key_column, 2);
    assert_int_equal(a->count, 2);
    assert_int_equal(a->end - a->begin, strlen("[1, \"\\u20ac\\n\"]"));
    assert_string_equal(a->child->next->string, "\xe2\x82\xac\n");
    assert_int_equal(a->child->next->string_len, 4);
    const struct json *c = json_member(json_member(r.root, "b"), "c");
    assert_int_equal(c->type, JSON_NULL);
    assert_int_equal(c->line, 2);
    assert_int_equal(c->column, 13);
    assert_string_equal(json_pointer(c, &r.arena), "/b/c");
    assert_string_equal(json_pointer(a->child->next, &r.arena), "/a/1");
    assert_string_equal(json_pointer(r.root, &r.arena), "");
    assert_true(json_member(r.root, "d")->number == -2500.0);
    assert_null(json_member(r.root, "e"));
    assert_null(json_member(a, "0"));
    assert_null(json_member(NULL, "a"));
    end(&r);
}

static void
values_are_described(void **unused)
{
    static const char text[] =
        "[{}, [], 3, \"2\", true, null, "
        "\"0123456789012345678901234567890123456789more\"]";
    static const char *const said[] = {
        "an object",
        "an array",
        "the number 3",
        "the string \"2\"",
        "true",
        "null",
        "the string \"0123456789012345678901234567890123456789…\""};
    struct reading r;
    (void)unused;
    begin(&r, text, strlen(text), NULL);
    size_t i = 0;
    for (const struct json *n = r.root->child; n != NULL; n = n->next)
        assert_string_equal(json_describe(n, &r.arena), said[i++]);
    end(&r);
}

static void
limits_are_limits(void **unused)
{
    struct reading r;
    char deep[128];
    (void)unused;
    memset(deep, '[', 32);
    memset(deep + 32, ']', 32);
    begin(&r, deep, 64, NULL);
    assert_non_null(r.root);
    end(&r);

    memset(deep, '[', 33);
    memset(deep + 33, ']', 33);
    begin(&r, deep, 66, NULL);
    assert_null(r.root);
    assert_int_equal(r.errors.items[0].code, ERROR_JSON_DEPTH);
    assert_null(r.errors.items[0].pointer);
    assert_int_equal(r.errors.items[0].column, 33);
    end(&r);

    const struct json_limits few = {.max_bytes = 10, .max_values = 3};
    begin(&r, "[1,2,3]", 7, &few);
    assert_null(r.root);
    assert_int_equal(r.errors.items[0].code, ERROR_BUDGET_LIST);
    end(&r);
    begin(&r, "[1,2      ]", 11, &few);
    assert_null(r.root);
    assert_int_equal(r.errors.items[0].code, ERROR_BUDGET_BYTES);
    assert_int_equal(r.errors.items[0].line, 0);
    end(&r);
}

/* What must be cheap, within a generous second each. */
static void
hostile_texts_fail_fast(void **unused)
{
    size_t len = 8 * 1024 * 1024;
    char *text = malloc(len);
    struct reading r;
    (void)unused;
    assert_non_null(text);
    int64_t start = clock_monotonic_us();

    memset(text, '[', 100000);
    begin(&r, text, 100000, NULL);
    assert_int_equal(r.errors.items[0].code, ERROR_JSON_DEPTH);
    end(&r);

    for (size_t i = 0; i + 3 <= len; i += 3)
        memcpy(text + i, "[1,", 3);
    begin(&r, text, len, NULL);
    assert_int_equal(r.errors.items[0].code, ERROR_BUDGET_BYTES);
    assert_true(r.arena.used < 64 * 1024);
    end(&r);
    const struct json_limits wide = {.max_bytes = 16 * 1024 * 1024};
    begin(&r, text, len, &wide);
    assert_int_equal(r.errors.items[0].code, ERROR_JSON_DEPTH);
    assert_true(r.arena.used < 64 * 1024);
    end(&r);

    /* A megabyte of the smallest values, refused before a tree is made. */
    text[0] = '[';
    for (size_t i = 1; i < 1024 * 1024; i += 2)
        memcpy(text + i, i + 2 < 1024 * 1024 ? "1," : "1]", 2);
    begin(&r, text, 1024 * 1024, NULL);
    assert_int_equal(r.errors.items[0].code, ERROR_BUDGET_LIST);
    assert_true(r.arena.used < 64 * 1024);
    end(&r);

    /* Tens of thousands of names with one hash-friendly shape, the last one
     * repeated. */
    size_t at = (size_t)sprintf(text, "{");
    for (int i = 0; i < 60000; i++)
        at += (size_t)sprintf(text + at, "\"k%05d\":0,", i);
    at += (size_t)sprintf(text + at, "\"k%05d\":1}", 59999);
    begin(&r, text, at, NULL);
    assert_int_equal(r.errors.items[0].code, ERROR_JSON_DUPLICATE_KEY);
    assert_string_equal(r.errors.items[0].pointer, "/k59999");
    end(&r);

    assert_true(clock_monotonic_us() - start < 5000000);
    free(text);
}

static void
names_are_guessed(void **unused)
{
    static const char *const names[] = {"sphere", "plane", "box", "max"};
    (void)unused;
    assert_string_equal(json_did_you_mean("sphear", names, 4), "sphere");
    assert_string_equal(json_did_you_mean("Plane", names, 4), "plane");
    assert_string_equal(json_did_you_mean("maxx", names, 4), "max");
    assert_null(json_did_you_mean("cylinder", names, 4));
    assert_null(json_did_you_mean("", names, 4));
    assert_null(json_did_you_mean("q", names, 4));
}

/* The n-th allocation fails, wherever in a block it falls. */
static void
memory_may_end_anywhere(void **unused)
{
    static const char text[] =
        "{\"a\": [1, \"two\", {\"three\": [true, null]}], \"b\": \"\\u0034\"}";
    (void)unused;
    for (size_t filler = 0; filler < 16384; filler += 16) {
        struct arena arena;
        arena_init(&arena, 17000);
        arena_alloc(&arena, filler < 4096 ? filler : 4096);
        for (size_t rest = filler; rest > 4096; rest -= 2048)
            arena_alloc(&arena, 2048);
        struct error_list errors = {.arena = &arena};
        const struct json *root =
            json_read(text, strlen(text), NULL, &arena, &errors);
        assert_true((root != NULL) == (errors.count == 0));
        if (root == NULL)
            assert_int_equal(errors.items[0].code, ERROR_MEMORY);
        arena_clear(&arena);
    }
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(refused_with_place),
        cmocka_unit_test(a_nul_byte_is_refused),
        cmocka_unit_test(every_prefix_of_a_document_is_refused),
        cmocka_unit_test(a_tree_has_places_and_values),
        cmocka_unit_test(values_are_described),
        cmocka_unit_test(limits_are_limits),
        cmocka_unit_test(hostile_texts_fail_fast),
        cmocka_unit_test(names_are_guessed),
        cmocka_unit_test(memory_may_end_anywhere),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
