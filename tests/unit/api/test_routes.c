/* The table of routes: what is found, what is 404, what is 405. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "server/api/routes.h"

static struct arena arena;

static const struct route *
find(const char *method, const char *path, const char **param, bool *known)
{
    return route_find(method, path, &arena, param, known);
}

static void
paths_find_their_row(void **state)
{
    const char *param;
    bool known;
    const struct route *route;

    (void)state;
    route = find("GET", "/v1/jobs/job_1", &param, &known);
    assert_ptr_equal(route->handle, job_get);
    assert_string_equal(param, "job_1");
    route = find("HEAD", "/v1/jobs/job_1/result", &param, &known);
    assert_ptr_equal(route->handle, job_result);
    assert_string_equal(param, "job_1");
    route = find("POST", "/v1/render", &param, &known);
    assert_ptr_equal(route->handle, render_post);
    assert_null(param);
    route = find("GET", "/", &param, &known);
    assert_ptr_equal(route->handle, page_form);
}

static void
other_paths_are_unknown(void **state)
{
    static const char *const rows[] = {
        "",           "//",           "/v1",          "/v1/render/",
        "/v1/jobs/",  "/v1/jobs/a/b", "/v1/jobs//x",  "/v1/jobs/a/result/",
        "/V1/render", "/livez/x",     "/schemas/a/b",
    };
    const char *param;
    bool known;
    size_t i;

    (void)state;
    for (i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        assert_null(find("GET", rows[i], &param, &known));
        assert_false(known);
    }
}

static void
a_wrong_method_is_told_the_right_ones(void **state)
{
    const char *param;
    bool known;

    (void)state;
    assert_null(find("PUT", "/v1/jobs/job_1", &param, &known));
    assert_true(known);
    assert_string_equal(route_allow("/v1/jobs/job_1", &arena),
                        "GET, HEAD, DELETE");
    assert_string_equal(route_allow("/v1/render", &arena), "POST");
    assert_null(find("get", "/livez", &param, &known));
}

static void
near_paths_and_queries(void **state)
{
    const char *param;
    bool known;
    const struct route *route = find("GET", "/v1/jobs", &param, &known);

    (void)state;
    assert_string_equal(route_near("/v1/rendr"), "/v1/render");
    assert_null(route_near("/something/else"));
    assert_true(route_has_query(route, "state"));
    assert_true(route_has_query(route, "cursor"));
    assert_false(route_has_query(route, "stat"));
    assert_false(route_has_query(route, "states"));
    assert_false(route_has_query(route, ""));
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
        cmocka_unit_test(paths_find_their_row),
        cmocka_unit_test(other_paths_are_unknown),
        cmocka_unit_test(a_wrong_method_is_told_the_right_ones),
        cmocka_unit_test(near_paths_and_queries),
    };

    return cmocka_run_group_tests(tests, NULL, free_arena);
}
