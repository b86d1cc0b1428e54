/* Text into pages: nothing a client wrote becomes a tag. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "server/api/html.h"

static void
check_marks(const char *text, const char *suffix, const char *want)
{
    struct bytes out = {0};

    html_marks(&out, text, strlen(text), suffix);
    assert_string_equal(out.data ? out.data : "", want);
    bytes_clear(&out);
}

static void
marks_become_elements(void **state)
{
    (void)state;
    check_marks("", "", "");
    check_marks("# A b\n", "", "<h1>A b</h1>\n");
    check_marks("### `number.too_small`\n", "",
                "<h3 id=\"number.too_small\"><code>number.too_small</code>"
                "</h3>\n");
    check_marks("### `x`\n", "-de", "<h3 id=\"x-de\"><code>x</code></h3>\n");
    check_marks("one\ntwo\n\nthree", "", "<p>one\ntwo</p>\n<p>three</p>\n");
    check_marks("- a\n- b\nc\n", "",
                "<ul>\n<li>a</li>\n<li>b</li>\n</ul>\n<p>c</p>\n");
    check_marks("```\n<a>\n\n# x\n```\nb\n", "",
                "<pre>&lt;a&gt;\n\n# x\n</pre>\n<p>b</p>\n");
    check_marks("a `b<c` **d** [e](/f) g", "",
                "<p>a <code>b&lt;c</code> <strong>d</strong> "
                "<a href=\"/f\">e</a> g</p>\n");
}

static void
broken_marks_stay_text(void **state)
{
    (void)state;
    check_marks("a ` b", "", "<p>a ` b</p>\n");
    check_marks("[x] (y", "", "<p>[x] (y</p>\n");
    check_marks("**", "", "<p>**</p>\n");
    check_marks("[](", "", "<p>[](</p>\n");
    check_marks("#no", "", "<p>#no</p>\n");
    check_marks("```\nopen", "", "<pre>open\n</pre>\n");
    check_marks("`", "", "<p>`</p>\n");
}

static void
text_is_escaped(void **state)
{
    struct bytes out = {0};

    (void)state;
    html_text(&out, "<a href=\"'&", 12);
    assert_string_equal(out.data, "&lt;a href=&quot;&#39;&amp;");
    bytes_clear(&out);
}

static void
forms_are_decoded(void **state)
{
    static const struct {
        const char *text, *want;
    } rows[] = {
        {"", ""},
        {"a+b", "a b"},
        {"%7B%22a%22%3a1%7d", "{\"a\":1}"},
        {"%2", "%2"},
        {"%", "%"},
        {"%zz", "%zz"},
        {"100%25", "100%"},
        {"%c3%A4", "\xc3\xa4"},
    };
    char out[64];
    size_t i;

    (void)state;
    for (i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        size_t len = form_decode(rows[i].text, strlen(rows[i].text), out);

        assert_string_equal(out, rows[i].want);
        assert_int_equal(len, strlen(rows[i].want));
    }
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(marks_become_elements),
        cmocka_unit_test(broken_marks_stay_text),
        cmocka_unit_test(text_is_escaped),
        cmocka_unit_test(forms_are_decoded),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
