/* The published documents: good ones are accepted, bad ones give exactly the
 * errors that examples/bad/expected.json lists. */

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/unit/scene/documents.h"

static void
every_example_is_accepted(void **unused)
{
    char *names[64];
    size_t count = document_list("schemas/examples", names, 64);
    (void)unused;
    assert_true(count >= 7);
    for (size_t i = 0; i < count; i++) {
        struct document d;
        struct bytes said = {0};
        char path[512];
        snprintf(path, sizeof path, "schemas/examples/%s", names[i]);
        document_load(&d, path);
        document_errors(&d, &said);
        if (!d.good)
            fail_msg("%s: %s", path, said.data);
        bytes_clear(&said);
        document_clear(&d);
        free(names[i]);
    }
}

/* Compare with one entry of expected.json; `prefix` and `lines` say where the
 * scene stands in the document. */
static void
check_errors(const struct document *d, const struct json *expected,
             const char *file, const char *prefix, uint32_t lines)
{
    struct bytes said = {0};
    document_errors(d, &said);
    const struct json *errors = json_member(expected, "errors");
    if (d->errors.count != errors->count)
        fail_msg("%s:\n%s", file, said.data);
    size_t i = 0;
    for (const struct json *e = errors->child; e != NULL; e = e->next, i++) {
        const struct error_item *got = &d->errors.items[i];
        const struct json *pointer = json_member(e, "pointer");
        char want[512] = "null";
        if (pointer->type == JSON_STRING)
            snprintf(want, sizeof want, "%s%s", prefix, pointer->string);
        const struct json *line = json_member(e, "line");
        const struct json *column = json_member(e, "column");
        if (strcmp(error_code_name(got->code),
                   json_member(e, "code")->string) != 0 ||
            strcmp(got->pointer ? got->pointer : "null", want) != 0 ||
            got->line != (uint32_t)line->number + lines ||
            got->column != (uint32_t)column->number)
            fail_msg("%s, error %zu:\n%s", file, i, said.data);
        const struct json *words = json_member(e, "hint_mentions");
        const struct json *w = words != NULL ? words->child : NULL;
        for (; w != NULL; w = w->next) {
            assert_non_null(got->hint);
            assert_non_null(strstr(got->hint, w->string));
        }
    }
    bytes_clear(&said);
}

static void
check_embedded(const struct document *bare, const struct json *expected,
               const char *file)
{
    struct bytes text = {0};
    struct document d;
    bytes_text(&text, "{\"priority\": \"low\", \"scene\":\n");
    bytes_append(&text, bare->text.data, bare->text.len);
    bytes_text(&text, "}");
    memset(&d, 0, sizeof d);
    arena_init(&d.arena, 0);
    d.errors.arena = &d.arena;
    d.root = json_read(text.data, text.len, NULL, &d.arena, &d.errors);
    if (d.root != NULL)
        d.good = scene_read(json_member(d.root, "scene"), NULL, &d.arena,
                            &d.scene, &d.errors);
    assert_false(d.good);
    check_errors(&d, expected, file, "/scene", 1);
    bytes_clear(&text);
    arena_clear(&d.arena);
}

static void
every_bad_example_gives_its_errors(void **unused)
{
    struct document expected;
    (void)unused;
    document_load(&expected, "schemas/examples/bad/expected.json");
    assert_non_null(expected.root);
    const struct json *list = json_member(expected.root, "documents");
    assert_true(list->count >= 12);
    for (const struct json *e = list->child; e != NULL; e = e->next) {
        struct document d;
        char path[512];
        const char *file = json_member(e, "file")->string;
        snprintf(path, sizeof path, "schemas/examples/bad/%s", file);
        document_load(&d, path);
        assert_false(d.good);
        check_errors(&d, e, file, "", 0);
        check_embedded(&d, e, file);
        document_clear(&d);
    }
    document_clear(&expected);
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_example_is_accepted),
        cmocka_unit_test(every_bad_example_gives_its_errors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
