#include "server/api/api.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/log.h"
#include "server/api/origin.h"
#include "server/api/routes.h"

enum { BODY_NONE_MAX = 1024 };

struct api *
api_new(const struct api_options *options, struct error *err)
{
    struct api *api = calloc(1, sizeof *api);

    if (!api) {
        error_set(err, ERROR_MEMORY, "no memory for the api");
        return NULL;
    }
    api->options = *options;
    snprintf(api->host, sizeof api->host, "%s",
             options->host ? options->host : "");
    api->options.host = api->host;
    isa_class(api->isa);
    atomic_init(&api->draining, false);
    api->events = events_new(err);
    if (!api->events) {
        free(api);
        return NULL;
    }
    return api;
}

void
api_free(struct api *api)
{
    if (!api)
        return;
    events_free(api->events);
    free(api);
}

void
api_connect(struct api *api, struct store *store, struct blobs *blobs,
            struct pool *pool)
{
    api->store = store;
    api->blobs = blobs;
    events_connect_pool(api->events, pool);
}

void
api_connect_http(struct api *api, struct http *http)
{
    events_connect_http(api->events, http);
}

void
api_on_change(void *user, const struct job *job, bool deleted)
{
    struct api *api = user;

    events_changed(api->events, job->id);
    if (!deleted && (job->state == JOB_QUEUED ||
                     (job->state == JOB_RUNNING && job->cancel_requested)))
        events_kick_pool(api->events);
}

void
api_drain(struct api *api)
{
    atomic_store(&api->draining, true);
}

/* --- gates: before a handler is called; false: answered --- */

static bool
gate_origin(struct call *call)
{
    const struct api *api = call->api;
    const char *host = request_header(call->request, "Host");
    const char *origin = request_header(call->request, "Origin");

    if (!api->options.open && !host_is_ours(host, api->host)) {
        call_problem(call, PROBLEM_ORIGIN_REJECTED,
                     "Host is %.100s; this service answers to localhost, "
                     "127.0.0.1 and [::1] only",
                     host ? host : "missing");
        return false;
    }
    if (!origin_is_ours(origin, host)) {
        call_problem(call, PROBLEM_ORIGIN_REJECTED,
                     "Origin is %.100s; pages of other origins may not use "
                     "this service",
                     origin);
        return false;
    }
    return true;
}

static bool
gate_route(struct call *call)
{
    struct request *request = call->request;
    bool path_known;

    call->route = route_find(request->method, request->path, request->arena,
                             &call->param, &path_known);
    if (call->route)
        return true;
    if (path_known) {
        const char *allow = route_allow(request->path, request->arena);

        reply_header(request, call->reply, "Allow", "%s", allow);
        call_problem(call, PROBLEM_METHOD_NOT_ALLOWED,
                     "%.20s is not for this path; allowed: %s", request->method,
                     allow);
    } else {
        const char *near = route_near(request->path);

        call_problem(call, PROBLEM_NOT_FOUND,
                     "there is nothing at %.200s%s%s%s", request->path,
                     near ? "; did you mean " : "", near ? near : "",
                     near ? "?" : "");
    }
    return false;
}

/* A query parameter that the route does not know, or one given twice. */
struct stranger {
    const struct route *route;
    const char *unknown, *twice;
    const char *seen[16];
    size_t seen_count;
};

static bool
look_at_query(void *user, const char *name, const char *value)
{
    struct stranger *stranger = user;
    size_t i;

    (void)value;
    if (!route_has_query(stranger->route, name)) {
        stranger->unknown = name;
        return false;
    }
    for (i = 0; i < stranger->seen_count; i++) {
        if (strcmp(stranger->seen[i], name) == 0) {
            stranger->twice = name;
            return false;
        }
    }
    if (stranger->seen_count < 16)
        stranger->seen[stranger->seen_count++] = name;
    return true;
}

static bool
gate_query(struct call *call)
{
    struct stranger stranger = {.route = call->route};

    request_each_query(call->request, look_at_query, &stranger);
    if (stranger.unknown)
        call_problem(call, PROBLEM_REQUEST_MALFORMED,
                     "unknown query parameter '%.64s'; %s%s", stranger.unknown,
                     call->route->query[0] ? "this path knows: "
                                           : "this path knows none",
                     call->route->query);
    else if (stranger.twice)
        call_problem(call, PROBLEM_REQUEST_MALFORMED,
                     "the query parameter '%.64s' is there twice",
                     stranger.twice);
    return !stranger.unknown && !stranger.twice;
}

static bool
pass_gates(struct call *call)
{
    reply_header(call->request, call->reply, "X-Content-Type-Options",
                 "nosniff");
    return gate_origin(call) && gate_route(call) && gate_query(call);
}

static uint64_t
body_limit(const struct api *api, const struct route *route)
{
    if (!route || route->body == BODY_NONE)
        return BODY_NONE_MAX;
    if (route->body == BODY_FORM)
        return api->options.max_scene_bytes * 3 + BODY_NONE_MAX;
    return api->options.max_scene_bytes;
}

/* --- the handler that http calls --- */

static uint64_t
api_admit(void *app, struct request *request, struct reply *reply)
{
    struct call call = {.api = app, .request = request, .reply = reply};
    struct reply untouched = *reply;

    if (!pass_gates(&call))
        return BODY_NONE_MAX;
    *reply = untouched; /* api_handle sets the headers */
    return body_limit(app, call.route);
}

static enum http_verdict
api_handle(void *app, struct request *request, struct reply *reply,
           int64_t *park_ms)
{
    struct call call = {.api = app,
                        .request = request,
                        .reply = reply,
                        .visit = request->state,
                        .park_ms = park_ms};

    if (!pass_gates(&call))
        return HTTP_REPLY;
    if (!call.visit) {
        call.visit = request->state = calloc(1, sizeof *call.visit);
        if (!call.visit)
            return call_problem(&call, PROBLEM_INTERNAL, "no memory");
    }
    if (call.route->handle(&call) == HTTP_PARK)
        return HTTP_PARK;
    call.visit->cancel_when_gone = false; /* answered */
    return HTTP_REPLY;
}

static void
nobody_waits(void *user, const struct job *job, const struct error *err)
{
    (void)user;
    (void)job;
    (void)err;
}

static void
api_finish(void *app, struct request *request, bool gone)
{
    struct api *api = app;
    struct visit *visit = request->state;

    if (!visit)
        return;
    /* When the service ends, connections end too: that is no wish. */
    if (gone && visit->cancel_when_gone && !atomic_load(&api->draining) &&
        events_watchers(api->events, visit->job) == 1) {
        log_write(LOG_INFO, "api", "%s: the client left, canceling %s",
                  request->id, visit->job);
        store_cancel(api->store, visit->job, nobody_waits, NULL, NULL);
    }
    if (visit->job[0])
        events_unwatch(api->events, visit->job, visit->ticket);
    commit_drop(visit->commit);
    free(visit);
    request->state = NULL;
}

static void
write_limit(struct json_writer *w, const void *limit)
{
    json_put_integer(w, "limit", (int64_t) * (const uint64_t *)limit);
}

static void
api_refuse(void *app, struct request *request, struct reply *reply,
           enum http_refusal why, const char *detail)
{
    static const enum problem_kind kinds[] = {
        [HTTP_REFUSE_MALFORMED] = PROBLEM_REQUEST_MALFORMED,
        [HTTP_REFUSE_TOO_LARGE] = PROBLEM_TOO_LARGE,
        [HTTP_REFUSE_CODING] = PROBLEM_NOT_IMPLEMENTED,
        [HTTP_REFUSE_COMPRESSED] = PROBLEM_UNSUPPORTED_MEDIA_TYPE,
        [HTTP_REFUSE_BUSY] = PROBLEM_QUEUE_FULL,
    };
    struct problem problem = {.kind = kinds[why], .detail = detail};
    const char *param;
    uint64_t limit;
    bool path_known;

    if (why == HTTP_REFUSE_TOO_LARGE) {
        limit = body_limit(app,
                           request->method && request->path
                               ? route_find(request->method, request->path,
                                            request->arena, &param, &path_known)
                               : NULL);
        problem.detail =
            arena_printf(request->arena,
                         "the body is larger than %llu bytes, the most that "
                         "is read here",
                         (unsigned long long)limit);
        problem.more = write_limit;
        problem.user = &limit;
    }
    problem_reply(request, reply, &problem);
}

struct http_handler
api_handler(struct api *api)
{
    return (struct http_handler){
        .app = api,
        .admit = api_admit,
        .handle = api_handle,
        .finish = api_finish,
        .refuse = api_refuse,
    };
}
