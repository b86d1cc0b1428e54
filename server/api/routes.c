#include "server/api/routes.h"

#include <string.h>

#include "core/base/json.h"

/* clang-format off */
const struct route routes[] = {
    /* method, path, query parameters, body, function */
    {"POST",   "/v1/render",               "format",        BODY_SCENE, render_post},
    {"POST",   "/v1/jobs",                 "",              BODY_SCENE, jobs_post},
    {"GET",    "/v1/jobs",                 "state tag since limit cursor", BODY_NONE, jobs_list},
    {"GET",    "/v1/jobs/{id}",            "wait",          BODY_NONE,  job_get},
    {"DELETE", "/v1/jobs/{id}",            "dry_run",       BODY_NONE,  job_delete},
    {"POST",   "/v1/jobs/{id}/cancel",     "",              BODY_NONE,  job_cancel},
    {"GET",    "/v1/jobs/{id}/result",     "layer format",  BODY_NONE,  job_result},
    {"POST",   "/v1/scenes/validate",      "lint",          BODY_SCENE, scenes_validate},
    {"GET",    "/v1/scenes/examples",      "",              BODY_NONE,  scenes_examples},
    {"GET",    "/v1/scenes/examples/{name}", "",            BODY_NONE,  scenes_example},
    {"GET",    "/livez",                   "verbose",       BODY_NONE,  meta_livez},
    {"GET",    "/readyz",                  "verbose",       BODY_NONE,  meta_readyz},
    {"GET",    "/version",                 "",              BODY_NONE,  meta_version},
    {"GET",    "/openapi.json",            "",              BODY_NONE,  meta_openapi},
    {"GET",    "/schemas/{name}",          "",              BODY_NONE,  meta_schema},
    {"GET",    "/problems/{slug}",         "format lang",   BODY_NONE,  page_problem},
    {"GET",    "/",                        "lang",          BODY_NONE,  page_form},
    {"POST",   "/",                        "lang",          BODY_FORM,  render_form},
    {"GET",    "/style.css",               "",              BODY_NONE,  page_style},
};
/* clang-format on */
const size_t route_count = sizeof routes / sizeof routes[0];

/* Does `path` have the form of `pattern`? *param points into path. */
static bool
path_fits(const char *pattern, const char *path, const char **param,
          size_t *param_len)
{
    *param = NULL;
    *param_len = 0;
    while (*pattern) {
        if (*pattern == '{') {
            *param = path;
            *param_len = strcspn(path, "/");
            if (*param_len == 0)
                return false;
            path += *param_len;
            pattern += strcspn(pattern, "}") + 1;
        } else if (*pattern++ != *path++) {
            return false;
        }
    }
    return *path == '\0';
}

const struct route *
route_find(const char *method, const char *path, struct arena *arena,
           const char **param, bool *path_known)
{
    const char *wanted = strcmp(method, "HEAD") == 0 ? "GET" : method;
    const char *part;
    size_t i, len;

    *path_known = false;
    *param = NULL;
    for (i = 0; i < route_count; i++) {
        if (!path_fits(routes[i].path, path, &part, &len))
            continue;
        *path_known = true;
        if (strcmp(routes[i].method, wanted) != 0)
            continue;
        if (part)
            *param = arena_strndup(arena, part, len);
        return &routes[i];
    }
    return NULL;
}

const char *
route_allow(const char *path, struct arena *arena)
{
    const char *allow = "", *part;
    size_t i, len;

    for (i = 0; i < route_count && allow; i++) {
        const char *method = routes[i].method;

        if (path_fits(routes[i].path, path, &part, &len))
            allow = arena_printf(arena, "%s%s%s%s", allow, *allow ? ", " : "",
                                 method,
                                 strcmp(method, "GET") == 0 ? ", HEAD" : "");
    }
    return allow ? allow : "";
}

const char *
route_near(const char *path)
{
    const char *names[sizeof routes / sizeof routes[0]];
    size_t i, n = 0;

    for (i = 0; i < route_count; i++)
        if (!strchr(routes[i].path, '{') && strlen(routes[i].path) > 3)
            names[n++] = routes[i].path;
    return json_did_you_mean(path, names, n);
}

bool
route_has_query(const struct route *route, const char *name)
{
    const char *at = route->query;
    size_t len = strlen(name);

    while (*at) {
        size_t word = strcspn(at, " ");

        if (word == len && strncmp(at, name, len) == 0)
            return true;
        at += word + (at[word] == ' ');
    }
    return false;
}
