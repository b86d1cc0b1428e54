/* Submitting a job, looking at it, canceling and deleting it. */
#include <stdio.h>
#include <string.h>

#include "core/base/clock.h"
#include "server/api/order.h"
#include "server/api/routes.h"

/* --- POST /v1/jobs --- */

static enum http_verdict
answer_accepted(struct call *call, const struct job *job)
{
    reply_header(call->request, call->reply, "Location", "/v1/jobs/%s",
                 job->id);
    reply_header(call->request, call->reply, "Retry-After", "%u",
                 order_retry_after(job->estimate_seconds));
    return call_job(call, 202, job);
}

enum http_verdict
jobs_post(struct call *call)
{
    enum http_verdict verdict = HTTP_REPLY;
    struct order order;
    struct job job;
    bool answered;

    if (call->visit->stage == STAGE_COMMIT) {
        if (call_committed(call, &job, &answered))
            return answer_accepted(call, &job);
        return answered ? HTTP_REPLY : call_park(call);
    }
    if (!order_media_type(call))
        return HTTP_REPLY;
    if (!order_read(call, call->request->body, call->request->body_len, &order))
        verdict = order_refuse(call, &order);
    else if (order_complete(call, &order))
        verdict = order_submit(call, &order);
    order_clear(&order);
    return verdict;
}

/* --- GET /v1/jobs/{id} --- */

/* False: answered. */
static bool
find_job(struct call *call, struct job *job)
{
    struct error err = {0};

    if (!ulid_is_id("job", call->param)) {
        call_problem(call, PROBLEM_NOT_FOUND,
                     "'%.40s' is no job id; one looks like "
                     "job_01JDC8Q4M5XV3ZK7T2N9WB6RHE",
                     call->param);
        return false;
    }
    if (store_get(call->api->store, call->param, job, &err))
        return true;
    call_store_problem(call, &err);
    return false;
}

/* ?wait= in seconds; false: answered. */
static bool
read_wait(struct call *call, double *wait)
{
    const char *text = request_query(call->request, "wait");
    double most = call->api->options.max_wait;

    *wait = 0;
    if (!text || (seconds_read(text, wait) && *wait <= most))
        return true;
    call_problem(call, PROBLEM_REQUEST_MALFORMED,
                 "wait must be a whole number of seconds from 0 to %.0f, got "
                 "'%.32s'",
                 most, text);
    return false;
}

/* Has the client seen just this revision? */
static bool
has_seen(struct call *call, const struct job *job)
{
    const char *seen = request_header(call->request, "If-None-Match");
    char etag[32];

    snprintf(etag, sizeof etag, "W/\"r%u\"", job->revision);
    return seen && etag_listed(seen, etag);
}

static enum http_verdict
answer_unchanged(struct call *call, const struct job *job)
{
    call->reply->status = 304;
    reply_header(call->request, call->reply, "ETag", "W/\"r%u\"",
                 job->revision);
    reply_header(call->request, call->reply, "Cache-Control", "no-cache");
    return HTTP_REPLY;
}

enum http_verdict
job_get(struct call *call)
{
    struct visit *visit = call->visit;
    bool conditional = request_header(call->request, "If-None-Match") != NULL;
    struct job job;

    if (!find_job(call, &job))
        return HTTP_REPLY;
    if (visit->stage == STAGE_NEW) {
        if (!read_wait(call, &visit->wait))
            return HTTP_REPLY;
        visit->stage = STAGE_CHANGE;
        visit->deadline_us =
            clock_monotonic_us() + (int64_t)(visit->wait * 1e6);
        /* Watch, then look again: no change falls between the two. */
        if (visit->wait > 0 && !job_is_over(job.state) &&
            (!call_watch(call, job.id) || !find_job(call, &job)))
            return HTTP_REPLY;
    }
    if (conditional && !has_seen(call, &job))
        return call_job(call, 200, &job);
    if (visit->wait > 0 && !job_is_over(job.state) && !call_is_late(call) &&
        !call_waits_in_vain(call, &job))
        return call_park(call);
    return conditional ? answer_unchanged(call, &job)
                       : call_job(call, 200, &job);
}

/* --- POST /v1/jobs/{id}/cancel, DELETE /v1/jobs/{id} --- */

typedef bool (*store_write_fn)(struct store *store, const char *id,
                               store_done_fn done, void *user,
                               struct error *err);

/* Hand a write about the job at {id} to the store and park. */
static enum http_verdict
begin_write(struct call *call, store_write_fn write)
{
    struct error err = {0};
    struct commit *commit;
    struct job job;

    if (!find_job(call, &job))
        return HTTP_REPLY;
    commit = commit_new(call->api->events, job.id);
    if (!commit)
        return call_problem(call, PROBLEM_INTERNAL, "no memory");
    if (!call_watch(call, job.id)) {
        commit_drop(commit);
        commit_drop(commit);
        return HTTP_REPLY;
    }
    if (!write(call->api->store, job.id, commit_done, commit, &err)) {
        commit_drop(commit);
        commit_drop(commit);
        return call_store_problem(call, &err);
    }
    return call_await_commit(call, commit);
}

/* These take no body; an empty object is allowed. */
static bool
has_no_body(struct call *call)
{
    const char *body = call->request->body;
    char left[3] = "";
    size_t i, n = 0;

    for (i = 0; i < call->request->body_len && n < sizeof left; i++)
        if (!strchr(" \t\r\n", body[i]) || body[i] == '\0')
            left[n++] = body[i];
    if (n == 0 || (n == 2 && left[0] == '{' && left[1] == '}'))
        return true;
    call_problem(call, PROBLEM_REQUEST_MALFORMED, "this request takes no body");
    return false;
}

enum http_verdict
job_cancel(struct call *call)
{
    bool answered;
    struct job job;

    if (call->visit->stage == STAGE_NEW)
        return has_no_body(call) ? begin_write(call, store_cancel) : HTTP_REPLY;
    if (!call_committed(call, &job, &answered))
        return answered ? HTTP_REPLY : call_park(call);
    return find_job(call, &job) ? call_job(call, 200, &job) : HTTP_REPLY;
}

/* What DELETE would remove. */
static enum http_verdict
answer_dry_run(struct call *call)
{
    struct bytes body = {0};
    struct json_writer w = {.out = &body};
    struct job job;

    if (!find_job(call, &job))
        return HTTP_REPLY;
    if (!job_is_over(job.state))
        return call_problem(call, PROBLEM_CONFLICT_STATE,
                            "the job is %s; cancel it first",
                            job_state_name(job.state));
    json_begin_object(&w, NULL);
    json_put_string(&w, "job", job.id);
    json_begin_array(&w, "would_delete");
    json_begin_object(&w, NULL);
    json_put_string(&w, "kind", "record");
    json_end_object(&w);
    if (job.result[0]) {
        json_begin_object(&w, NULL);
        json_put_string(&w, "kind", "result");
        json_put_string(&w, "media_type", job.media_type);
        json_put_integer(&w, "bytes", (int64_t)job.result_len);
        json_end_object(&w);
    }
    json_end_array(&w);
    json_end_object(&w);
    bytes_text(&body, "\n");
    return call_body(call, 200, "application/json", &body);
}

/* A query parameter that is a switch: absent, 0 or 1. False: answered. */
static bool
read_switch(struct call *call, const char *name, bool *on)
{
    const char *text = request_query(call->request, name);

    *on = text && strcmp(text, "1") == 0;
    if (!text || *on || strcmp(text, "0") == 0)
        return true;
    call_problem(call, PROBLEM_REQUEST_MALFORMED,
                 "%s must be 0 or 1, got '%.32s'", name, text);
    return false;
}

enum http_verdict
job_delete(struct call *call)
{
    bool answered, dry;
    struct job job;

    if (call->visit->stage == STAGE_NEW) {
        if (!has_no_body(call) || !read_switch(call, "dry_run", &dry))
            return HTTP_REPLY;
        return dry ? answer_dry_run(call) : begin_write(call, store_delete);
    }
    if (!call_committed(call, &job, &answered))
        return answered ? HTTP_REPLY : call_park(call);
    call->reply->status = 204;
    return HTTP_REPLY;
}
