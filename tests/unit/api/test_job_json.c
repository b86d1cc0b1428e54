/* A job document: every error at once, in its place. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "server/api/job_json.h"

static struct arena arena;
static struct error_list errors;
static struct job_document document;

static bool
read(const char *text)
{
    const struct json *root;

    arena_clear(&arena);
    arena_init(&arena, 0);
    memset(&errors, 0, sizeof errors);
    errors.arena = &arena;
    root = json_read(text, strlen(text), NULL, &arena, &errors);
    assert_non_null(root);
    job_json_read(root, &document, &errors);
    error_list_sort(&errors);
    return errors.count == 0;
}

static void
expect(size_t i, enum error_code code, const char *pointer, uint32_t line,
       uint32_t column)
{
    assert_true(i < errors.count);
    assert_string_equal(error_code_name(errors.items[i].code),
                        error_code_name(code));
    assert_string_equal(errors.items[i].pointer, pointer);
    assert_int_equal(errors.items[i].line, line);
    assert_int_equal(errors.items[i].column, column);
}

static void
a_bare_scene_is_a_job_with_defaults(void **state)
{
    (void)state;
    assert_true(read("{\"objects\": []}"));
    assert_false(document.is_job);
    assert_false(document.has_output);
    assert_int_equal(document.priority, PRIORITY_NORMAL);
    assert_int_equal(document.max_attempts, 3);
    assert_string_equal(document.prefix, "");
    assert_string_equal(document.tags, "");
}

static void
every_member_is_read(void **state)
{
    (void)state;
    assert_true(read("{\"scene\": {\"objects\": []}, \"priority\": \"low\", "
                     "\"tags\": [\"a\", \"b.c\"], \"max_attempts\": 10, "
                     "\"output\": {\"format\": \"exr\"}}"));
    assert_true(document.is_job);
    assert_true(document.has_output);
    assert_int_equal(document.output.format, OUTPUT_EXR);
    assert_int_equal(document.priority, PRIORITY_LOW);
    assert_int_equal(document.max_attempts, 10);
    assert_string_equal(document.tags, "a,b.c");
    assert_string_equal(document.prefix, "/scene");
    assert_non_null(json_member(document.scene, "objects"));
}

static void
all_errors_come_at_once(void **state)
{
    (void)state;
    assert_false(read("{\"scene\": {},\n"
                      " \"priorita\": \"low\",\n"
                      " \"priority\": \"lo\",\n"
                      " \"tags\": [\"ok\", \"-x\", 3, \"ok\"],\n"
                      " \"max_attempts\": 11,\n"
                      " \"time_limit\": 3,\n"
                      " \"frames\": {},\n"
                      " \"webhook\": \"hook_1\"}"));
    assert_int_equal(errors.count, 9);
    expect(0, ERROR_PROPERTY_UNKNOWN, "/priorita", 2, 2);
    /* 'priority' is there already: no fix would help */
    assert_null(errors.items[0].fix);
    assert_non_null(strstr(errors.items[0].hint, "'priority'"));
    expect(1, ERROR_ENUM_UNKNOWN, "/priority", 3, 14);
    assert_string_equal(errors.items[1].fix,
                        "[{\"op\":\"replace\",\"path\":\"/priority\","
                        "\"value\":\"low\"}]");
    expect(2, ERROR_STRING_PATTERN, "/tags/1", 4, 17);
    expect(3, ERROR_TYPE_MISMATCH, "/tags/2", 4, 23);
    expect(4, ERROR_NAME_DUPLICATE, "/tags/3", 4, 26);
    expect(5, ERROR_NUMBER_TOO_LARGE, "/max_attempts", 5, 18);
    expect(6, ERROR_PROPERTY_NOT_YET, "/time_limit", 6, 2);
    expect(7, ERROR_PROPERTY_NOT_YET, "/frames", 7, 2);
    expect(8, ERROR_PROPERTY_NOT_YET, "/webhook", 8, 2);
}

static void
an_unknown_member_has_a_fix(void **state)
{
    (void)state;
    assert_false(read("{\"scene\": {}, \"priorita\": \"low\"}"));
    assert_string_equal(errors.items[0].fix,
                        "[{\"op\":\"move\",\"from\":\"/priorita\","
                        "\"path\":\"/priority\"}]");
    assert_false(read("{\"scene\": {}, \"colour\": 1}"));
    assert_null(errors.items[0].fix);
    assert_non_null(strstr(errors.items[0].hint, "max_attempts"));
}

static void
numbers_and_types(void **state)
{
    static const struct {
        const char *text;
        enum error_code code;
    } rows[] = {
        {"{\"scene\":{},\"max_attempts\":0}", ERROR_NUMBER_TOO_SMALL},
        {"{\"scene\":{},\"max_attempts\":2.5}", ERROR_NUMBER_NOT_INTEGER},
        {"{\"scene\":{},\"max_attempts\":1e300}", ERROR_NUMBER_TOO_LARGE},
        {"{\"scene\":{},\"max_attempts\":\"3\"}", ERROR_TYPE_MISMATCH},
        {"{\"scene\":{},\"priority\":null}", ERROR_TYPE_MISMATCH},
        {"{\"scene\":{},\"tags\":\"a\"}", ERROR_TYPE_MISMATCH},
        {"{\"scene\":{},\"tags\":[\"\"]}", ERROR_STRING_PATTERN},
        {"{\"scene\":{},\"tags\":[\"a,b\"]}", ERROR_STRING_PATTERN},
        {"{\"scene\":{},\"tags\":[1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17]}",
         ERROR_ARRAY_LENGTH},
        {"{\"scene\":{\"$example\":3}}", ERROR_TYPE_MISMATCH},
        {"{\"scene\":{\"$example\":\"nothing-like-it\"}}",
         ERROR_REFERENCE_UNKNOWN},
        {"{\"scene\":{\"$example\":\"smallest\",\"x\":1}}",
         ERROR_PROPERTY_UNKNOWN},
        {"{\"scene\":{\"$example\":\"../scene\"}}", ERROR_REFERENCE_UNKNOWN},
        {"{\"scene\":{\"$example\":\"bad/01-trailing-comma\"}}",
         ERROR_REFERENCE_UNKNOWN},
    };
    size_t i;

    (void)state;
    for (i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        assert_false(read(rows[i].text));
        assert_int_equal(errors.count, 1);
        assert_string_equal(error_code_name(errors.items[0].code),
                            error_code_name(rows[i].code));
    }
}

static void
an_example_stands_for_its_scene(void **state)
{
    (void)state;
    assert_true(read("{\"scene\": {\"$example\": \"smallest\"}}"));
    assert_string_equal(document.example, "smallest");
    assert_non_null(json_member(document.scene, "objects"));
    assert_false(read("{\"scene\": {\"$example\": \"smalest\"}}"));
    assert_string_equal(errors.items[0].pointer, "/scene/$example");
    assert_string_equal(errors.items[0].hint, "Did you mean 'smallest'?");
}

static void
sixteen_tags_of_64_letters_fit(void **state)
{
    struct bytes text = {0};
    char name[65];
    int i;

    (void)state;
    memset(name, 'a', 64);
    name[64] = '\0';
    bytes_text(&text, "{\"scene\":{},\"tags\":[");
    for (i = 0; i < 16; i++) {
        name[0] = (char)('a' + i);
        bytes_printf(&text, "%s\"%s\"", i ? "," : "", name);
    }
    bytes_text(&text, "]}");
    assert_true(read(text.data));
    assert_int_equal(strlen(document.tags), 16 * 64 + 15);
    bytes_clear(&text);
}

static void
a_job_object_says_everything(void **state)
{
    struct job job = {
        .id = "job_01JDC8Q4M5XV3ZK7T2N9WB6RHE",
        .state = JOB_RUNNING,
        .phase = JOB_TRACING,
        .revision = 17,
        .attempt = 1,
        .max_attempts = 3,
        .progress = 0.5,
        .rays_done = 1000,
        .created_ms = 1000,
        .started_ms = 2000,
        .tags = "a,b",
        .settings = "{\"sampler\":{\"spp\":16}}",
    };
    struct job_around around = {.isa = "amd-x86-64-v4",
                                .position = -1,
                                .now_ms = 4000,
                                .arena = &arena};
    struct bytes out = {0};
    struct json_writer w = {.out = &out};
    const struct json *root;

    (void)state;
    arena_clear(&arena);
    arena_init(&arena, 0);
    job_json_write(&w, NULL, &job, &around);
    memset(&errors, 0, sizeof errors);
    errors.arena = &arena;
    root = json_read(out.data, out.len, NULL, &arena, &errors);
    assert_non_null(root);
    assert_string_equal(json_member(root, "phase")->string, "tracing");
    assert_true(json_member(root, "samples_done")->number == 8);
    assert_true(json_member(root, "samples_total")->number == 16);
    assert_true(json_member(root, "rays_per_second")->number == 500);
    assert_true(json_member(root, "eta_seconds")->number == 2);
    assert_true(json_member(root, "queue_position")->number == 0);
    assert_int_equal(json_member(root, "tags")->count, 2);
    assert_int_equal(json_member(root, "finished_at")->type, JSON_NULL);
    assert_int_equal(json_member(root, "stats")->type, JSON_NULL);
    assert_int_equal(json_member(root, "error")->type, JSON_NULL);
    assert_int_equal(json_member(json_member(root, "links"), "result")->type,
                     JSON_NULL);
    bytes_clear(&out);
}

static int
free_arena(void **state)
{
    (void)state;
    arena_clear(&arena);
    return 0;
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_bare_scene_is_a_job_with_defaults),
        cmocka_unit_test(every_member_is_read),
        cmocka_unit_test(all_errors_come_at_once),
        cmocka_unit_test(an_unknown_member_has_a_fix),
        cmocka_unit_test(numbers_and_types),
        cmocka_unit_test(an_example_stands_for_its_scene),
        cmocka_unit_test(sixteen_tags_of_64_letters_fit),
        cmocka_unit_test(a_job_object_says_everything),
    };

    return cmocka_run_group_tests(tests, NULL, free_arena);
}
