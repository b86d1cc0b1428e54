/* How clients choose: Prefer, Accept, If-None-Match, Accept-Language. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "server/api/prefer.h"

static void
prefer_has_wait_and_respond_async(void **state)
{
    static const struct {
        const char *header;
        struct prefer want;
    } rows[] = {
        {NULL, {false, false, 0}},
        {"", {false, false, 0}},
        {"wait=10", {false, true, 10}},
        {"respond-async", {true, false, 0}},
        {"respond-async, wait=5", {true, true, 5}},
        {"Wait = 7 ; x=1 , RESPOND-ASYNC", {true, true, 7}},
        {"wait=\"3\"", {false, true, 3}},
        {"wait=1, wait=9", {false, true, 1}},
        {"wait=-1", {false, false, 0}},
        {"wait=1e3", {false, false, 0}},
        {"wait=99999999999999999999", {false, false, 0}},
        {"wait", {false, false, 0}},
        {"wait=", {false, false, 0}},
        {"handling=lenient; a=\"x, wait=5\"", {false, false, 0}},
        {",,,;;=,", {false, false, 0}},
        {"wait=\"5", {false, false, 0}},
    };
    size_t i;

    (void)state;
    for (i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        struct prefer got = prefer_read(rows[i].header);

        assert_int_equal(got.respond_async, rows[i].want.respond_async);
        assert_int_equal(got.has_wait, rows[i].want.has_wait);
        if (rows[i].want.has_wait)
            assert_true(got.wait == rows[i].want.wait);
    }
}

static void
accept_takes_what_is_liked_best(void **state)
{
    static const char *const types[] = {"image/png", "image/x-exr",
                                        "application/json"};
    static const struct {
        const char *header;
        int want;
    } rows[] = {
        {NULL, 0},
        {"", 0},
        {"*/*", 0},
        {"image/x-exr", 1},
        {"IMAGE/PNG", 0},
        {"application/json", 2},
        {"image/*", 0},
        {"image/*;q=0.5, application/json", 2},
        {"image/png;q=0, image/*", 1},
        {"text/html,application/xhtml+xml,image/avif,*/*;q=0.8", 0},
        {"application/json;q=0.9, image/x-exr;q=0.91", 1},
        {"text/html", -1},
        {"image/png;q=0", -1},
        {"image/png;q=2", -1},
        {"image/png;q=", -1},
        {"imagex/png", -1},
        {"image/pngx", -1},
        {";;;", -1},
        {"*", 0},
    };
    size_t i;

    (void)state;
    for (i = 0; i < sizeof rows / sizeof rows[0]; i++)
        assert_int_equal(accept_choose(rows[i].header, types, 3), rows[i].want);
}

static void
etags_compare_weakly(void **state)
{
    (void)state;
    assert_true(etag_listed("\"abc\"", "\"abc\""));
    assert_true(etag_listed("W/\"r17\"", "W/\"r17\""));
    assert_true(etag_listed("\"r17\"", "W/\"r17\""));
    assert_true(etag_listed("\"x\", W/\"abc\" , \"y\"", "\"abc\""));
    assert_true(etag_listed("\"a,b\"", "\"a,b\""));
    assert_true(etag_listed("*", "\"abc\""));
    assert_false(etag_listed("\"abcd\"", "\"abc\""));
    assert_false(etag_listed("abc", "\"abc\""));
    assert_false(etag_listed("", "\"abc\""));
    assert_false(etag_listed(NULL, "\"abc\""));
    assert_false(etag_listed("W/", "\"abc\""));
}

static void
languages_by_their_first_part(void **state)
{
    static const char *const codes[] = {"en", "de"};

    (void)state;
    assert_int_equal(language_choose(NULL, codes, 2), 0);
    assert_int_equal(language_choose("de-AT,de;q=0.9,en;q=0.8", codes, 2), 1);
    assert_int_equal(language_choose("en-GB,de;q=0.9", codes, 2), 0);
    assert_int_equal(language_choose("fr, de;q=0.1", codes, 2), 1);
    assert_int_equal(language_choose("fr", codes, 2), 0);
    assert_int_equal(language_choose("den", codes, 2), 0);
}

static void
words_and_seconds(void **state)
{
    double seconds = -1;

    (void)state;
    assert_true(header_has_word("max-age=0, No-Cache", "no-cache"));
    assert_false(header_has_word("no-cacheable", "no-cache"));
    assert_false(header_has_word(NULL, "no-cache"));
    assert_true(seconds_read("0", &seconds) && seconds == 0);
    assert_true(seconds_read("60", &seconds) && seconds == 60);
    assert_false(seconds_read("", &seconds));
    assert_false(seconds_read("-1", &seconds));
    assert_false(seconds_read("1.5", &seconds));
    assert_false(seconds_read("1 ", &seconds));
    assert_false(seconds_read("1000000000000", &seconds));
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(prefer_has_wait_and_respond_async),
        cmocka_unit_test(accept_takes_what_is_liked_best),
        cmocka_unit_test(etags_compare_weakly),
        cmocka_unit_test(languages_by_their_first_part),
        cmocka_unit_test(words_and_seconds),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
