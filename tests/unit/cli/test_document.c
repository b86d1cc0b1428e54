/* Scene or job, from file to what is wrong with it and to what a server gets. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "cli/document.h"
#include "cli/examples.h"

static char path[] = "/tmp/glint-test-document-XXXXXX";

static void
open_text(struct document *document, const char *text)
{
    struct error err = {0};
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
    *document = (struct document){0};
    assert_true(document_open(document, path, &err));
}

static void
every_example_is_valid(void **state)
{
    (void)state;
    assert_true(example_count >= 7);
    for (size_t i = 0; i < example_count; i++) {
        struct document d;
        open_text(&d, examples[i].text);
        assert_false(d.is_job);
        assert_true(document_check(&d));
        document_clear(&d);
    }
}

static void
a_job_may_name_an_example(void **state)
{
    (void)state;
    struct document d;
    open_text(&d, "{\"scene\": {\"$example\": \"smallest\"},\n"
                  " \"output\": {\"format\": \"exr\"}}");
    assert_true(d.is_job);
    assert_true(document_check(&d));
    assert_int_equal(d.output.format, OUTPUT_EXR);
    assert_int_equal(d.output_root->line, 2);
    document_clear(&d);

    open_text(&d, "{\"scene\": {\"$example\": \"smalest\"}}");
    assert_false(document_check(&d));
    assert_int_equal(d.errors.count, 1);
    assert_int_equal(d.errors.items[0].code, ERROR_REFERENCE_UNKNOWN);
    assert_string_equal(d.errors.items[0].hint, "did you mean `smallest`?");
    document_clear(&d);
}

static void
every_member_of_a_job_is_checked(void **state)
{
    (void)state;
    static const struct {
        const char *member;
        enum error_code code;
        const char *pointer;
    } rows[] = {
        {"\"priorityy\": \"low\"", ERROR_PROPERTY_UNKNOWN, "/priorityy"},
        {"\"sampler\": {}", ERROR_PROPERTY_UNKNOWN, "/sampler"},
        {"\"priority\": \"urgent\"", ERROR_ENUM_UNKNOWN, "/priority"},
        {"\"priority\": 1", ERROR_TYPE_MISMATCH, "/priority"},
        {"\"max_attempts\": 0", ERROR_NUMBER_TOO_SMALL, "/max_attempts"},
        {"\"max_attempts\": 11", ERROR_NUMBER_TOO_LARGE, "/max_attempts"},
        {"\"max_attempts\": 1.5", ERROR_NUMBER_NOT_INTEGER, "/max_attempts"},
        {"\"max_attempts\": \"1\"", ERROR_TYPE_MISMATCH, "/max_attempts"},
        {"\"tags\": \"a\"", ERROR_TYPE_MISMATCH, "/tags"},
        {"\"tags\": [\"a\", 1]", ERROR_TYPE_MISMATCH, "/tags/1"},
        {"\"time_limit\": 3", ERROR_PROPERTY_NOT_YET, "/time_limit"},
        {"\"output\": {\"format\": \"bmp\"}", ERROR_ENUM_UNKNOWN,
         "/output/format"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct document d;
        char text[256];
        snprintf(text, sizeof text,
                 "{\"scene\": {\"$example\": \"smallest\"}, %s}",
                 rows[i].member);
        open_text(&d, text);
        assert_false(document_check(&d));
        assert_int_equal(d.errors.count, 1);
        assert_string_equal(error_code_name(d.errors.items[0].code),
                            error_code_name(rows[i].code));
        assert_string_equal(d.errors.items[0].pointer, rows[i].pointer);
        document_clear(&d);
    }
}

static void
no_json_is_one_error(void **state)
{
    (void)state;
    struct document d;
    struct error err = {0};
    open_text(&d, "{\"version\": 1,");
    assert_true(document_set(&d, "/a=1", &err)); /* nothing to set in */
    assert_false(document_check(&d));
    assert_int_equal(d.errors.count, 1);
    assert_int_equal(d.errors.items[0].code, ERROR_JSON_SYNTAX);
    document_clear(&d);
    open_text(&d, "");
    assert_false(document_check(&d));
    assert_int_equal(d.errors.count, 1);
    document_clear(&d);
}

static void
errors_of_a_set_name_the_set(void **state)
{
    (void)state;
    struct document d;
    struct error err = {0};
    char *data = NULL;
    size_t len = 0;
    open_text(&d, "{\"scene\": {\"$example\": \"smallest\"}}");
    assert_true(document_set(&d, "/scene/film/width=0", &err));
    assert_false(document_check(&d));
    struct channel to = {.file = open_memstream(&data, &len)};
    document_print_all(&d, &to, true);
    fclose(to.file);
    assert_ptr_equal(strstr(data, "--set /scene/film/width=0: error: "
                                  "/scene/film/width must be"),
                     data);
    free(data);
    document_clear(&d);
}

/* What a server gets is a job; where its scene begins is known. */
static void
wraps(const char *text, const char *expected, unsigned lines)
{
    struct document d;
    struct bytes job = {0};
    unsigned before = 99;
    open_text(&d, text);
    document_write_job(&d, "{\"format\":\"exr\"}", &job, &before);
    assert_string_equal(job.data, expected);
    assert_int_equal(before, lines);
    bytes_clear(&job);
    document_clear(&d);
}

static void
a_server_gets_a_job(void **state)
{
    (void)state;
    wraps("{\n \"version\": 1}",
          "{\"output\": {\"format\":\"exr\"}, \"scene\":\n"
          "{\n \"version\": 1}\n}\n",
          1);
    wraps("\xef\xbb\xbf{}",
          "{\"output\": {\"format\":\"exr\"}, \"scene\":\n{}\n}\n", 1);
    wraps("{\"scene\": {}}",
          "{\"scene\": {}, \"output\": {\"format\":\"exr\"}}", 0);
    wraps("{\"output\": {\n\"format\": \"png\"}, \"scene\": {}}",
          "{\"output\": {\"format\":\"exr\"}\n, \"scene\": {}}", 0);
}

int
main(void)
{
    int fd = mkstemp(path);
    if (fd < 0)
        return 1;
    close(fd);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_example_is_valid),
        cmocka_unit_test(a_job_may_name_an_example),
        cmocka_unit_test(every_member_of_a_job_is_checked),
        cmocka_unit_test(no_json_is_one_error),
        cmocka_unit_test(errors_of_a_set_name_the_set),
        cmocka_unit_test(a_server_gets_a_job),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    unlink(path);
    return failed;
}
