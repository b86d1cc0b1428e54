/* Findings as they are printed, and that nothing printed can move a cursor. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "cli/output.h"

static char *
printed(const char *text, const struct finding *finding)
{
    char *data = NULL;
    size_t len = 0;
    struct channel to = {.file = open_memstream(&data, &len), .columns = 80};
    finding_print(&to, "mine.json", text, text ? strlen(text) : 0, finding);
    fclose(to.file);
    return data;
}

static void
prints(const char *text, const struct finding *finding, const char *expected)
{
    char *data = printed(text, finding);
    assert_string_equal(data, expected);
    free(data);
}

static void
looks_as_documented(void **state)
{
    (void)state;
    struct finding f = {.code = "number.too_small",
                        .pointer = "/objects/2/radius",
                        .detail = "must be greater than 0, got -1",
                        .hint = "a radius is a length",
                        .line = 2,
                        .column = 17};
    prints("{\n      \"radius\": -1,\n}", &f,
           "mine.json:2:17: error: /objects/2/radius must be greater than 0, "
           "got -1  [number.too_small]\n"
           "    2 |       \"radius\": -1,\n"
           "      |                 ^^\n"
           "   help: a radius is a length\n");
}

static void
a_near_miss_belongs_into_the_sentence(void **state)
{
    (void)state;
    struct finding f = {.code = "property.unknown",
                        .pointer = "/colour",
                        .detail = "unknown property 'colour'",
                        .hint = "Did you mean 'color'?",
                        .line = 1,
                        .column = 2};
    prints("{\"colour\": 1}", &f,
           "mine.json:1:2: error: unknown property 'colour', did you mean "
           "'color'?  [property.unknown]\n"
           "    1 | {\"colour\": 1}\n"
           "      |  ^^^^^^^^\n");
}

static void
warnings_and_places_that_are_missing(void **state)
{
    (void)state;
    struct finding f = {.warning = true,
                        .code = "mirror.no_bounces",
                        .detail = "max_bounces is 0"};
    prints("{}", &f,
           "mine.json: warning: max_bounces is 0  [mirror.no_bounces]\n");
    f = (struct finding){.code = "type.mismatch",
                         .pointer = "",
                         .detail = "must be an object, got an array",
                         .line = 1,
                         .column = 1};
    prints("[1]", &f,
           "mine.json:1:1: error: the document must be an object, got an array "
           " [type.mismatch]\n    1 | [1]\n      | ^\n");
}

static void
columns_count_characters_and_tabs_stay_tabs(void **state)
{
    (void)state;
    struct finding f = {.code = "c", .detail = "d", .line = 1, .column = 8};
    prints("\t\"\xc3\xa4\xc3\xb6\": 12", &f,
           "mine.json:1:8: error: d  [c]\n"
           "    1 | \t\"\xc3\xa4\xc3\xb6\": 12\n"
           "      | \t      ^^\n");
    /* A byte-order mark is no column; CR alone ends a line. */
    f.line = 2;
    f.column = 1;
    prints("\xef\xbb\xbf{\rtrue", &f,
           "mine.json:2:1: error: d  [c]\n    2 | true\n      | ^^^^\n");
    f.line = 1;
    prints("\xef\xbb\xbf{\r\n}", &f,
           "mine.json:1:1: error: d  [c]\n    1 | {\n      | ^\n");
}

static void
places_outside_the_text_print_no_excerpt(void **state)
{
    (void)state;
    struct finding f = {.code = "c", .detail = "d", .line = 3, .column = 1};
    prints("{\n}", &f, "mine.json:3:1: error: d  [c]\n");
    f.line = 2;
    f.column = 9;
    prints("{\n}", &f, "mine.json:2:9: error: d  [c]\n");
    f.column = 2; /* just behind the end: something is missing there */
    prints("{\n}", &f, "mine.json:2:2: error: d  [c]\n    2 | }\n      |  ^\n");
    prints(
        "",
        &(struct finding){.code = "c", .detail = "d", .line = 1, .column = 1},
        "mine.json:1:1: error: d  [c]\n    1 | \n      | ^\n");
}

static void
long_lines_are_cut_around_the_caret(void **state)
{
    (void)state;
    char text[5001];
    memset(text, 'x', 5000);
    text[5000] = '\0';
    text[3000] = '[';
    struct finding f = {.code = "c", .detail = "d", .line = 1, .column = 3001};
    char *data = printed(text, &f);
    char *first = strchr(data, '\n') + 1, *second = strchr(first, '\n') + 1;
    assert_true(second - first < 130);
    char *caret = strchr(second, '^'), *bracket = strchr(first, '[');
    assert_non_null(caret);
    assert_int_equal(caret - second, bracket - first);
    free(data);
}

static void
nothing_printed_moves_a_cursor(void **state)
{
    (void)state;
    struct finding f = {.code = "c\033[2J",
                        .pointer = "/\x9b",
                        .detail = "must not \033]0;x\007",
                        .hint = "\xe2\x80\xae\x7f\r",
                        .line = 1,
                        .column = 1};
    char *data = printed("\033[31m\xff\xc2\x9b", &f);
    assert_null(strchr(data, '\033'));
    assert_null(strchr(data, '\007'));
    assert_null(strchr(data, '\r'));
    assert_null(strchr(data, '\x7f'));
    assert_null(strchr(data, '\xff'));
    assert_null(strstr(data, "\xc2\x9b"));
    assert_null(strstr(data, "\xe2\x80\xae"));
    free(data);
}

static void
amounts_read_well(void **state)
{
    (void)state;
    static const struct {
        uint64_t bytes;
        const char *text;
    } sizes[] = {{0, "0 bytes"},
                 {1, "1 byte"},
                 {999, "999 bytes"},
                 {1000, "1.0 KB"},
                 {412345, "412 KB"},
                 {999499, "999 KB"},
                 {999500, "1.0 MB"},
                 {12345678, "12 MB"},
                 {UINT64_C(3000000000), "3.0 GB"}};
    static const struct {
        double seconds;
        const char *text;
    } times[] = {{0.034, "0.03 s"}, {0.31, "0.3 s"}, {28.4, "28.4 s"},
                 {59.96, "1:00"},   {187.4, "3:07"}, {3599.6, "1:00:00"}};
    char text[AMOUNT_SIZE];
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        amount_bytes(sizes[i].bytes, text);
        assert_string_equal(text, sizes[i].text);
    }
    for (size_t i = 0; i < sizeof times / sizeof *times; i++) {
        amount_seconds(times[i].seconds, text);
        assert_string_equal(text, times[i].text);
    }
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(looks_as_documented),
        cmocka_unit_test(a_near_miss_belongs_into_the_sentence),
        cmocka_unit_test(warnings_and_places_that_are_missing),
        cmocka_unit_test(columns_count_characters_and_tabs_stay_tabs),
        cmocka_unit_test(places_outside_the_text_print_no_excerpt),
        cmocka_unit_test(long_lines_are_cut_around_the_caret),
        cmocka_unit_test(nothing_printed_moves_a_cursor),
        cmocka_unit_test(amounts_read_well),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
