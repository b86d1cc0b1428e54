/* --set on texts: what becomes of them, and which line everything stays on. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "cli/patch.h"
#include "core/base/json.h"

static void
becomes(const char *before, const char *assignment, const char *after,
        const char *at)
{
    struct bytes text = {0};
    struct arena arena;
    struct error err = {0};
    const char *place = NULL;
    arena_init(&arena, 0);
    bytes_text(&text, before);
    bool ok = patch_set(&text, assignment, &arena, &place, &err);
    assert_string_equal(err.text, "");
    assert_true(ok);
    assert_string_equal(text.data, after);
    assert_string_equal(place, at);
    struct error_list errors = {.arena = &arena};
    assert_non_null(json_read(text.data, text.len, NULL, &arena, &errors));
    bytes_clear(&text);
    arena_clear(&arena);
}

static void
refused(const char *before, const char *assignment, enum error_code code,
        const char *sentence)
{
    struct bytes text = {0};
    struct arena arena;
    struct error err = {0};
    const char *place = NULL;
    arena_init(&arena, 0);
    bytes_text(&text, before);
    assert_false(patch_set(&text, assignment, &arena, &place, &err));
    assert_int_equal(err.code, code);
    assert_string_equal(err.text, sentence);
    assert_string_equal(text.data, before);
    bytes_clear(&text);
    arena_clear(&arena);
}

static void
values_are_replaced(void **state)
{
    (void)state;
    becomes("{\"a\": 1, \"b\": 2}", "/a=3", "{\"a\": 3, \"b\": 2}", "/a");
    becomes("{\"a\": [1, {\"x\": 2}]}", "/a/1/x=[4, 5]",
            "{\"a\": [1, {\"x\": [4, 5]}]}", "/a/1/x");
    becomes("{\"a\": 1}", "/a=sphere", "{\"a\": \"sphere\"}", "/a");
    becomes("{\"a\": 1}", "/a=\"sphere\"", "{\"a\": \"sphere\"}", "/a");
    becomes("{\"a\": 1}", "/a=#ff0000", "{\"a\": \"#ff0000\"}", "/a");
    becomes("{\"a\": 1}", "/a=01", "{\"a\": \"01\"}", "/a");
    becomes("{\"a\": 1}", "/a=1e999", "{\"a\": \"1e999\"}", "/a");
    becomes("{\"a\": 1}", "/a=", "{\"a\": \"\"}", "/a");
    becomes("{\"a\": 1}", "/a=x=y", "{\"a\": \"x=y\"}", "/a");
    becomes("{\"a/b\": 1, \"m~n\": 2}", "/a~1b=3", "{\"a/b\": 3, \"m~n\": 2}",
            "/a~1b");
    becomes("{\"a/b\": 1, \"m~n\": 2}", "/m~0n=3", "{\"a/b\": 1, \"m~n\": 3}",
            "/m~0n");
    becomes("{\"\": 1}", "/=2", "{\"\": 2}", "/");
}

static void
missing_members_are_made(void **state)
{
    (void)state;
    becomes("{}", "/a=1", "{\"a\": 1}", "/a");
    becomes("{\"a\": {\"b\": 1} }", "/a/c=2", "{\"a\": {\"b\": 1, \"c\": 2} }",
            "/a/c");
    becomes("{\"z\": 0}", "/a/b/c=1", "{\"z\": 0, \"a\": {\"b\": {\"c\": 1}}}",
            "/a");
    becomes("{\"z\": 0}", "/q\"uote=1", "{\"z\": 0, \"q\\\"uote\": 1}",
            "/q\"uote");
    becomes("{\"a\": [1]}", "/a/-=2", "{\"a\": [1, 2]}", "/a/-");
    becomes("{\"a\": []}", "/a/-={\"b\": 1}", "{\"a\": [{\"b\": 1}]}", "/a/-");
}

static void
lines_stay_where_they_are(void **state)
{
    (void)state;
    becomes("{\n \"a\": [1,\n  2,\n  3],\n \"b\": 4\n}", "/a=5",
            "{\n \"a\": 5\n\n,\n \"b\": 4\n}", "/a");
    becomes("{\r\n \"a\": [1,\r\n  2],\r\n \"b\": 4\r\n}", "/a=5",
            "{\r\n \"a\": 5\n,\r\n \"b\": 4\r\n}", "/a");
    becomes("{\n \"a\": 1\n}", "/a=[1,\n2]", "{\n \"a\": [1, 2]\n}", "/a");
}

static void
what_does_not_exist_is_named(void **state)
{
    (void)state;
    refused("{\"a\": [1, 2]}", "/a/2=0", ERROR_NOT_FOUND,
            "/a/2 does not exist: the array has 2 elements");
    refused("{\"a\": [1]}", "/a/99999999999999/b=0", ERROR_NOT_FOUND,
            "/a/99999999999999 does not exist: the array has 1 element");
    refused("{\"a\": [1]}", "/a/x=0", ERROR_NOT_FOUND,
            "/a/x does not exist: its parent is an array, which is asked by "
            "number");
    refused("{\"a\": [1, 2]}", "/a/01=0", ERROR_NOT_FOUND,
            "/a/01 does not exist: its parent is an array, which is asked by "
            "number");
    refused("{\"a\": 1}", "/a/b=0", ERROR_NOT_FOUND,
            "/a/b does not exist: its parent is the number 1, which has no "
            "members");
    refused("{}", "/objects/0/radius=0", ERROR_NOT_FOUND,
            "/objects/0 does not exist: there is no array to hold it");
    refused("{}", "/a", ERROR_USAGE,
            "'/a' lacks a value: write /pointer=value");
    refused("{}", "a=1", ERROR_USAGE,
            "'a' is no JSON pointer: it begins with /, like /film/width");
    refused("{}", "/a~2=1", ERROR_USAGE,
            "'/a~2' is no JSON pointer: after ~ comes 0 or 1");
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_are_replaced),
        cmocka_unit_test(missing_members_are_made),
        cmocka_unit_test(lines_stay_where_they_are),
        cmocka_unit_test(what_does_not_exist_is_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
