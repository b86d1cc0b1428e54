/* What is written is JSON that reads back. */

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <string.h>

#include "core/base/json.h"
#include "core/base/json_write.h"
#include "core/base/utf8.h"

static void
members_stand_in_the_order_written(void **unused)
{
    struct bytes out = {0};
    struct json_writer w = {.out = &out};
    (void)unused;
    json_begin_object(&w, NULL);
    json_put_string(&w, "text", "a\"\\\n\x01\x7f");
    json_put_number(&w, "half", 0.5);
    json_put_integer(&w, "count", -7);
    json_begin_array(&w, "list");
    json_put_bool(&w, NULL, true);
    json_put_bool(&w, NULL, false);
    json_put_null(&w, NULL);
    json_begin_object(&w, NULL);
    json_end_object(&w);
    json_end_array(&w);
    json_put_raw(&w, "raw", "{\"x\":1}", 7);
    json_put_string_or_null(&w, "none", NULL);
    json_put_string_or_null(&w, "some", "s");
    json_end_object(&w);
    assert_string_equal(out.data,
                        "{\"text\":\"a\\\"\\\\\\n\\u0001\x7f\",\"half\":0.5,"
                        "\"count\":-7,\"list\":[true,false,null,{}],"
                        "\"raw\":{\"x\":1},\"none\":null,\"some\":\"s\"}");
    bytes_clear(&out);
}

static void
bad_bytes_become_replacement_characters(void **unused)
{
    struct bytes out = {0};
    struct json_writer w = {.out = &out};
    (void)unused;
    json_put_string(&w, NULL, "a\xff\xc3\xa9\xe2\x82z\xed\xa0\x80");
    assert_string_equal(out.data,
                        "\"a\xef\xbf\xbd\xc3\xa9\xef\xbf\xbd\xef\xbf\xbdz"
                        "\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd\"");
    bytes_clear(&out);
}

/* Every character, written, read and compared. */
static void
every_character_comes_back(void **unused)
{
    (void)unused;
    for (uint32_t c = 1; c <= 0x10ffff; c += c < 0x3000 ? 1 : 61) {
        if (c >= 0xd800 && c <= 0xdfff)
            continue;
        char text[8] = {0};
        struct arena arena;
        struct bytes out = {0};
        struct json_writer w = {.out = &out};
        size_t len = utf8_put(c, text);
        assert_int_equal(utf8_length(text, len), len);
        assert_int_equal(utf8_length(text, len - 1), 0);
        assert_int_equal(utf8_count(text, len), 1);
        arena_init(&arena, 0);
        struct error_list errors = {.arena = &arena};
        json_put_string(&w, NULL, text);
        const struct json *read =
            json_read(out.data, out.len, NULL, &arena, &errors);
        assert_non_null(read);
        assert_string_equal(read->string, text);
        bytes_clear(&out);
        arena_clear(&arena);
    }
}

static void
escapes_are_characters(void **unused)
{
    static const char text[] =
        "\"\\\"\\\\\\/\\b\\f\\n\\r\\t\\u00e9\\u20AC\\ud83d\\ude00\"";
    struct arena arena;
    (void)unused;
    arena_init(&arena, 0);
    struct error_list errors = {.arena = &arena};
    const struct json *read =
        json_read(text, strlen(text), NULL, &arena, &errors);
    assert_non_null(read);
    assert_string_equal(read->string,
                        "\"\\/\b\f\n\r\t\xc3\xa9\xe2\x82\xac\xf0\x9f\x98\x80");
    arena_clear(&arena);
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(members_stand_in_the_order_written),
        cmocka_unit_test(bad_bytes_become_replacement_characters),
        cmocka_unit_test(every_character_comes_back),
        cmocka_unit_test(escapes_are_characters),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
