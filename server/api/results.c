#include "server/api/results.h"

#include <string.h>
#include <unistd.h>

#include "core/base/json.h"
#include "core/scene/output.h"
#include "server/api/job_json.h"
#include "server/api/routes.h"

const char *
result_etag(const char *render_key, struct arena *arena)
{
    return arena_printf(arena, "\"%.40s\"", render_key);
}

int
result_open(struct call *call, const struct job *job, uint64_t *len, bool quiet)
{
    struct error err = {0};
    int fd = blobs_get(call->api->blobs, job->result, len, &err);

    if (fd < 0 && !quiet && err.code == ERROR_NOT_FOUND)
        call_problem(call, PROBLEM_RESULT_EXPIRED,
                     "the result of %s is no longer kept; submit the scene "
                     "again",
                     job->id);
    else if (fd < 0 && !quiet)
        call_store_problem(call, &err);
    return fd;
}

enum http_verdict
result_send(struct call *call, const struct job *job, int fd, uint64_t len,
            const char *cache)
{
    struct request *request = call->request;
    struct reply *reply = call->reply;
    const struct job_stats *stats = &job->stats;
    const char *etag = result_etag(job->render_key, request->arena);
    bool hit = cache && strcmp(cache, "hit") == 0;

    if (etag)
        reply_header(request, reply, "ETag", "%s", etag);
    reply_header(request, reply, "Cache-Control", "private, max-age=86400");
    if (cache)
        reply_header(request, reply, "Glint-Cache", "%s", cache);
    /* A hit spent no time on any of it. */
    reply_header(request, reply, "Server-Timing",
                 "queue;dur=%.1f, build;dur=%.1f, trace;dur=%.1f, "
                 "encode;dur=%.1f",
                 hit ? 0 : stats->queue_ms, hit ? 0 : stats->build_ms,
                 hit ? 0 : stats->trace_ms, hit ? 0 : stats->encode_ms);
    if (etag && etag_listed(request_header(request, "If-None-Match"), etag)) {
        close(fd);
        reply->status = 304;
        return HTTP_REPLY;
    }
    reply->status = 200;
    reply_header(request, reply, "Content-Type", "%s", job->media_type);
    reply->fd = fd;
    reply->fd_len = len;
    return HTTP_REPLY;
}

static void
write_job_error(struct json_writer *w, const void *user)
{
    const struct job *job = user;

    json_put_string(w, "job", job->id);
    json_put_string(w, "state", job_state_name(job->state));
    job_json_write_error(w, "error", job);
}

enum http_verdict
result_refuse(struct call *call, const struct job *job, enum problem_kind kind)
{
    struct problem problem = {
        .kind = kind, .more = write_job_error, .user = job};

    if (job->state == JOB_FAILED)
        problem.detail =
            arena_printf(call->request->arena, "the job failed: %s (%s)",
                         job->error_text, error_code_name(job->error_code));
    else
        problem.detail = arena_printf(
            call->request->arena, "the job is %s%s", job_state_name(job->state),
            job_is_over(job->state) ? " and has no result"
                                    : "; its result is not there yet");
    return call_show_problem(call, &problem);
}

/* --- GET /v1/jobs/{id}/result --- */

/* The layers that the stored result has, as its output settings say. */
static bool
stored_output(struct call *call, const struct job *job, struct output *output)
{
    struct error_list errors = {.arena = call->request->arena};
    const struct json *node = json_read(job->output, strlen(job->output), NULL,
                                        call->request->arena, &errors);

    if (node && output_read(node, output, &errors))
        return true;
    call_problem(call, PROBLEM_INTERNAL, "the job's output cannot be read");
    return false;
}

static void
write_layers(struct json_writer *w, const void *user)
{
    const struct output *output = user;
    uint32_t i;

    json_begin_array(w, "layers");
    for (i = 0; i < output->layer_count; i++)
        json_put_string(w, NULL, layer_name(output->layers[i]));
    json_end_array(w);
}

/* Is the stored result what ?layer= asks for? False: answered. */
static bool
layer_fits(struct call *call, const struct output *output)
{
    const char *name = request_query(call->request, "layer");
    struct problem problem = {
        .kind = PROBLEM_LAYER_MISSING, .more = write_layers, .user = output};
    enum layer layer = name ? layer_find(name) : LAYER_COUNT;
    uint32_t i;

    if (!name)
        return true;
    for (i = 0; i < output->layer_count; i++) {
        if (output->layers[i] != layer)
            continue;
        if (output->layer_count == 1)
            return true;
        call_not_acceptable(call, (const char *[]){output_media_type(output)},
                            1,
                            "this version delivers the layers of a result "
                            "together, not one of them");
        return false;
    }
    problem.detail = arena_printf(call->request->arena,
                                  "the result has no layer '%.64s'", name);
    call_show_problem(call, &problem);
    return false;
}

/* Is the stored result in the format asked for? False: answered. */
static bool
format_fits(struct call *call, const struct output *output)
{
    const char *format = request_query(call->request, "format");
    const char *accept = request_header(call->request, "Accept");
    const char *stored = output_media_type(output);
    const char *detail = NULL;

    if (format) {
        if (strcmp(format, output_extension(output)) != 0)
            detail = arena_printf(call->request->arena,
                                  "the result is stored as %s, not '%.32s'; "
                                  "ask for another format in `output`",
                                  output_extension(output), format);
    } else if (accept_choose(accept, &stored, 1) < 0) {
        detail =
            arena_printf(call->request->arena,
                         "the result is %s, which Accept leaves out", stored);
    }
    if (!detail)
        return true;
    call_not_acceptable(call, &stored, 1, detail);
    return false;
}

enum http_verdict
job_result(struct call *call)
{
    struct error err = {0};
    struct output output;
    struct job job;
    uint64_t len;
    int fd;

    if (!store_get(call->api->store, call->param, &job, &err))
        return call_store_problem(call, &err);
    if (job.state != JOB_SUCCEEDED) {
        if (!job_is_over(job.state))
            reply_header(call->request, call->reply, "Retry-After", "1");
        return result_refuse(call, &job, PROBLEM_CONFLICT_STATE);
    }
    if (!stored_output(call, &job, &output) || !layer_fits(call, &output) ||
        !format_fits(call, &output))
        return HTTP_REPLY;
    fd = result_open(call, &job, &len, false);
    if (fd < 0)
        return HTTP_REPLY;
    return result_send(call, &job, fd, len, NULL);
}
