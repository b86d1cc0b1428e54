/* problem+json, and the excerpt of a syntax error. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "core/base/json.h"
#include "server/api/excerpt.h"
#include "server/api/problem.h"

static const struct json *
read_back(const struct bytes *text, struct arena *arena)
{
    struct error_list errors = {.arena = arena};
    const struct json *root =
        json_read(text->data, text->len, NULL, arena, &errors);

    assert_non_null(root);
    return root;
}

static const char *
string_of(const struct json *node, const char *key)
{
    const struct json *member = json_member(node, key);

    assert_non_null(member);
    assert_int_equal(member->type, JSON_STRING);
    return member->string;
}

static void
every_slug_is_found_again(void **state)
{
    unsigned kind;

    (void)state;
    for (kind = 0; kind < PROBLEM_COUNT; kind++) {
        enum problem_kind k = (enum problem_kind)kind;

        assert_int_equal(problem_find(problem_slug(k)), k);
        assert_in_range(problem_status(k), 400, 503);
    }
    assert_int_equal(problem_find("nothing"), PROBLEM_COUNT);
}

static void
a_problem_has_its_members(void **state)
{
    struct arena arena;
    struct error_list errors = {.arena = &arena};
    struct bytes out = {0};
    const struct json *root, *first, *second;

    (void)state;
    arena_init(&arena, 0);
    error_list_add(&errors, ERROR_NUMBER_TOO_SMALL, "/objects/2/radius", 14, 17,
                   "a radius is a length", NULL,
                   "must be greater than 0, got %d", -1);
    error_list_add(&errors, ERROR_PROPERTY_UNKNOWN, "/a\"b", 19, 7, NULL,
                   "[{\"op\":\"remove\",\"path\":\"/a\"}]", "unknown property");
    errors.truncated = true;
    problem_write(&(struct problem){.kind = PROBLEM_SCENE_INVALID,
                                    .detail = "2 \"errors\"",
                                    .errors = &errors},
                  "req_1", &out);
    root = read_back(&out, &arena);
    assert_string_equal(string_of(root, "type"), "/problems/scene-invalid");
    assert_string_equal(string_of(root, "detail"), "2 \"errors\"");
    assert_string_equal(string_of(root, "instance"), "/v1/requests/req_1");
    assert_string_equal(string_of(root, "request_id"), "req_1");
    assert_true(json_member(root, "status")->number == 422);
    assert_int_equal(json_member(root, "errors_truncated")->type, JSON_TRUE);
    first = json_member(root, "errors")->child;
    assert_string_equal(string_of(first, "pointer"), "/objects/2/radius");
    assert_true(json_member(first, "line")->number == 14);
    assert_true(json_member(first, "column")->number == 17);
    assert_string_equal(string_of(first, "code"), "number.too_small");
    assert_string_equal(string_of(first, "help"),
                        "/problems/scene-invalid#number.too_small");
    assert_null(json_member(first, "fix"));
    second = first->next;
    assert_int_equal(json_member(second, "fix")->type, JSON_ARRAY);
    assert_null(json_member(second, "hint"));
    bytes_clear(&out);
    arena_clear(&arena);
}

static void
an_error_without_a_place_has_null(void **state)
{
    struct arena arena;
    struct error_list errors = {.arena = &arena};
    struct bytes out = {0};
    const struct json *first;

    (void)state;
    arena_init(&arena, 0);
    error_list_add(&errors, ERROR_JSON_SYNTAX, NULL, 5, 3, NULL, NULL, "x");
    error_list_add(&errors, ERROR_BUDGET_BYTES, NULL, 0, 0, NULL, NULL, "y");
    problem_write(
        &(struct problem){.kind = PROBLEM_JSON_SYNTAX, .errors = &errors},
        "req_1", &out);
    first = json_member(read_back(&out, &arena), "errors")->child;
    assert_int_equal(json_member(first, "pointer")->type, JSON_NULL);
    assert_true(json_member(first, "line")->number == 5);
    assert_string_equal(string_of(first, "help"),
                        "/problems/json-syntax#json.syntax");
    assert_null(json_member(first->next, "line"));
    bytes_clear(&out);
    arena_clear(&arena);
}

static void
check_excerpt(const char *text, uint32_t line, uint32_t column, size_t offset,
              const char *want)
{
    struct bytes out = {0};

    assert_int_equal(excerpt_offset(text, strlen(text), line, column), offset);
    excerpt_write(text, strlen(text), line, column, &out);
    assert_string_equal(out.data, want);
    bytes_clear(&out);
}

static void
excerpts_point_at_the_place(void **state)
{
    (void)state;
    check_excerpt("{\n  ]\n}", 2, 3, 4, "  ]\n  ^");
    check_excerpt("{\r\n  ]\r\n}", 2, 3, 5, "  ]\n  ^");
    check_excerpt("{\r]", 2, 1, 2, "]\n^");
    check_excerpt("\xef\xbb\xbf]", 1, 1, 3, "]\n^");
    check_excerpt("\"\xc3\xa4\xc3\xb6\" x", 1, 6, 7,
                  "\"\xc3\xa4\xc3\xb6\" x\n     ^");
    check_excerpt("a\tb\x01", 1, 4, 3, "a b?\n   ^");
    check_excerpt("\xff\xfe", 1, 2, 1, "?\?\n ^");
    check_excerpt("ab", 1, 9, 2, "ab\n        ^");
    check_excerpt("", 3, 2, 0, "\n ^");
}

static void
a_long_line_is_cut_around_the_place(void **state)
{
    char text[401];
    struct bytes out = {0};

    (void)state;
    memset(text, 'a', sizeof text);
    text[299] = 'X';
    text[400] = '\0';
    excerpt_write(text, 400, 1, 300, &out);
    assert_int_equal(out.data[strcspn(out.data, "X")], 'X');
    assert_int_equal(strcspn(out.data, "\n"), 72);
    assert_int_equal(out.len - 72 - 2, strcspn(out.data, "X"));
    bytes_clear(&out);
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_slug_is_found_again),
        cmocka_unit_test(a_problem_has_its_members),
        cmocka_unit_test(an_error_without_a_place_has_null),
        cmocka_unit_test(excerpts_point_at_the_place),
        cmocka_unit_test(a_long_line_is_cut_around_the_place),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
