/* How the service is, what it is, and its descriptions. */
#include <string.h>

#include "server/api/files.h"
#include "server/api/order.h"
#include "server/api/routes.h"

static enum http_verdict
answer_text(struct call *call, struct bytes *text)
{
    reply_header(call->request, call->reply, "Cache-Control", "no-store");
    return call_body(call, 200, "text/plain; charset=utf-8", text);
}

enum http_verdict
meta_livez(struct call *call)
{
    struct bytes text = {0};

    if (request_query(call->request, "verbose"))
        bytes_text(&text, "[+] process alive\n");
    bytes_text(&text, "ok\n");
    return answer_text(call, &text);
}

/* --- GET /readyz --- */

enum { CHECK_COUNT = 4 };

struct check {
    const char *name;
    enum problem_kind kind; /* if it fails */
    bool ok;
    const char *detail;
};

/* The first that fails names the problem. */
static void
run_checks(struct call *call, struct check checks[CHECK_COUNT])
{
    struct arena *arena = call->request->arena;
    struct api *api = call->api;
    struct pool_status pool;
    struct store_counts counts;
    struct error err = {0};
    uint64_t free_bytes, need;
    bool draining = atomic_load(&api->draining);
    bool store = store_count(api->store, &counts, &err);
    bool full = order_storage_full(api, &free_bytes, &need);

    events_pool_status(api->events, &pool);
    checks[0] = (struct check){"draining", PROBLEM_DRAINING, !draining,
                               draining ? "the service is shutting down"
                                        : "taking jobs"};
    checks[1] = (struct check){
        "store", PROBLEM_NOT_READY, store,
        store ? arena_printf(arena, "%s, %llu jobs waiting",
                             store_describe(api->store),
                             (unsigned long long)counts.jobs[JOB_QUEUED])
              : arena_strdup(arena, err.text)};
    checks[2] = (struct check){
        "disk", PROBLEM_STORAGE_FULL, !full,
        arena_printf(arena, "%llu bytes free, %llu needed",
                     (unsigned long long)free_bytes, (unsigned long long)need)};
    checks[3] = (struct check){
        "workers", PROBLEM_NOT_READY, pool.ready > 0,
        arena_printf(arena, "%u of %u answer, %u of them at work", pool.ready,
                     pool.workers, pool.busy)};
}

static void
write_checks(struct json_writer *w, const void *user)
{
    const struct check *checks = user;
    size_t i;

    json_begin_array(w, "checks");
    for (i = 0; i < CHECK_COUNT; i++) {
        json_begin_object(w, NULL);
        json_put_string(w, "name", checks[i].name);
        json_put_bool(w, "ok", checks[i].ok);
        json_put_string_or_null(w, "detail", checks[i].detail);
        json_end_object(w);
    }
    json_end_array(w);
}

enum http_verdict
meta_readyz(struct call *call)
{
    struct check checks[CHECK_COUNT];
    struct bytes text = {0};
    size_t i;

    run_checks(call, checks);
    for (i = 0; i < CHECK_COUNT; i++) {
        struct problem problem = {
            .kind = checks[i].kind, .more = write_checks, .user = checks};

        if (checks[i].ok)
            continue;
        problem.detail = arena_printf(call->request->arena, "%s: %s",
                                      checks[i].name, checks[i].detail);
        return call_show_problem(call, &problem);
    }
    if (request_query(call->request, "verbose"))
        for (i = 0; i < CHECK_COUNT; i++)
            bytes_printf(&text, "[+] %s: %s\n", checks[i].name,
                         checks[i].detail);
    bytes_text(&text, "ok\n");
    return answer_text(call, &text);
}

/* --- descriptions --- */

enum http_verdict
meta_version(struct call *call)
{
    struct bytes body = {0};
    struct json_writer w = {.out = &body};

    json_begin_object(&w, NULL);
    json_put_string(&w, "version", glint_version);
    json_put_string(&w, "core_version", glint_version);
    json_put_string(&w, "build", glint_build);
    json_put_string(&w, "isa", call->api->isa);
    json_put_string(&w, "store", store_describe(call->api->store));
    json_end_object(&w);
    bytes_text(&body, "\n");
    reply_header(call->request, call->reply, "Cache-Control", "no-cache");
    return call_body(call, 200, "application/json", &body);
}

enum http_verdict
meta_openapi(struct call *call)
{
    const struct file *file = file_find("schemas/openapi.json");

    if (!file)
        return call_problem(call, PROBLEM_INTERNAL,
                            "this program was built without its description");
    return call_file(call, file, "application/json");
}

enum http_verdict
meta_schema(struct call *call)
{
    const char *name =
        arena_printf(call->request->arena, "schemas/%s", call->param);
    const struct file *file = name ? file_find(name) : NULL;

    if (!file || strcmp(call->param, "openapi.json") == 0)
        return call_problem(call, PROBLEM_NOT_FOUND,
                            "there is no schema '%.64s'; there are scene.json, "
                            "job.json and problem.json",
                            call->param);
    return call_file(call, file, "application/schema+json");
}
