/* POST /v1/render: a job with a wait (decision 0010). A client that asked for
 * an image gets an image or an error, never a 2xx body of another kind. */
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "core/base/clock.h"
#include "server/api/order.h"
#include "server/api/pages.h"
#include "server/api/results.h"
#include "server/api/routes.h"

/* An estimate this many times longer than the wait is refused at once. */
enum { HOPELESS = 4 };

/* --- what is asked for --- */

static void
read_preferences(struct call *call)
{
    struct visit *visit = call->visit;
    const struct api_options *options = &call->api->options;

    visit->prefer = prefer_read(request_header(call->request, "Prefer"));
    if (visit->prefer.has_wait && visit->prefer.wait > options->max_wait)
        visit->prefer.wait = options->max_wait;
    /* respond-async alone does not want to wait at all. */
    visit->wait = visit->prefer.has_wait        ? visit->prefer.wait
                  : visit->prefer.respond_async ? 0
                                                : options->default_wait;
    visit->deadline_us =
        call->request->started_us + (int64_t)(visit->wait * 1e6);
}

static enum http_verdict
refuse_format(struct call *call, struct order *order, const char *format)
{
    const struct json *output = json_member(order->root, "output");

    error_list_add(&order->errors, ERROR_PROPERTY_CONFLICT, "/output",
                   output->line, output->column, "leave out one of them", NULL,
                   "the body asks for %s, ?format= for '%.32s'",
                   output_extension(&order->document.output), format);
    return order_refuse(call, order);
}

/* As if the body had said {"format": ...} and nothing else. */
static void
take_format(struct order *order, const char *format)
{
    const char *text =
        arena_printf(&order->arena, "{\"format\":\"%s\"}", format);
    const struct json *node = text ? json_read(text, strlen(text), NULL,
                                               &order->arena, &order->errors)
                                   : NULL;

    if (node)
        output_read(node, &order->document.output, &order->errors);
}

/* ?format= and Accept choose the output where the body has none. False:
 * answered. */
static bool
choose_output(struct call *call, struct order *order)
{
    static const char *const all[] = {"image/png", "image/x-exr",
                                      "application/json"};
    static const char *const formats[] = {"png", "exr"};
    const char *format = request_query(call->request, "format");
    const char *accept = call->visit->form_scene
                             ? NULL /* a page shows what the body asks for */
                             : request_header(call->request, "Accept");
    struct output *output = &order->document.output;
    const char *types[] = {output_media_type(output), "application/json"};
    int chosen;

    if (format && strcmp(format, "png") != 0 && strcmp(format, "exr") != 0) {
        call_not_acceptable(call, formats, 2,
                            arena_printf(call->request->arena,
                                         "there is no format '%.32s' yet",
                                         format));
        return false;
    }
    if (format && order->document.has_output &&
        strcmp(format, output_extension(output)) != 0) {
        refuse_format(call, order, format);
        return false;
    }
    if (format) {
        if (!order->document.has_output)
            take_format(order, format);
        /* It wins over Accept; only a job object can still be preferred. */
        types[0] = output_media_type(output);
        call->visit->as_job = accept_choose(accept, types, 2) == 1;
        return true;
    }
    if (order->document.has_output) {
        chosen = accept_choose(accept, types, 2);
        call->visit->as_job = chosen == 1;
        if (chosen < 0)
            call_not_acceptable(call, types, 2,
                                "the body's output is not what Accept allows");
        return chosen >= 0;
    }
    chosen = accept_choose(accept, all, 3);
    if (chosen == 1)
        take_format(order, "exr");
    call->visit->as_job = chosen == 2;
    if (chosen < 0)
        call_not_acceptable(call, all, 3,
                            "a render is an image or a job object");
    return chosen >= 0;
}

/* --- endings --- */

static void
say_preferences(struct call *call, bool waited)
{
    const struct prefer *prefer = &call->visit->prefer;
    char wait[32] = "";

    if (prefer->has_wait && waited)
        snprintf(wait, sizeof wait, "%swait=%.0f",
                 prefer->respond_async ? ", " : "", prefer->wait);
    if (prefer->respond_async || wait[0])
        reply_header(call->request, call->reply, "Preference-Applied", "%s%s",
                     prefer->respond_async ? "respond-async" : "", wait);
}

static enum http_verdict
deliver(struct call *call, const struct job *job, const char *cache)
{
    uint64_t len;
    int fd;

    if (call->visit->form_scene)
        return page_picture(call, job);
    say_preferences(call, true);
    if (call->visit->as_job) {
        reply_header(call->request, call->reply, "Glint-Cache", "%s", cache);
        return call_job(call, 200, job);
    }
    fd = result_open(call, job, &len, false);
    if (fd < 0)
        return HTTP_REPLY;
    if (strcmp(cache, "miss") == 0)
        reply_header(call->request, call->reply, "Content-Location",
                     "/v1/jobs/%s/result", job->id);
    return result_send(call, job, fd, len, cache);
}

static void
write_job_link(struct json_writer *w, const void *user)
{
    const struct job *job = user;
    struct bytes link = {0};

    bytes_printf(&link, "/v1/jobs/%s", job->id);
    json_put_string(w, "job", job->id);
    json_put_string(w, "state", job_state_name(job->state));
    json_put_number(w, "progress", job->progress);
    json_put_string_or_null(w, "location", link.data);
    bytes_clear(&link);
}

/* The wait is over and the image is not there: the job goes on. */
static enum http_verdict
leave_running(struct call *call, const struct job *job)
{
    unsigned after =
        order_retry_after(job->estimate_seconds * (1 - job->progress));
    struct problem problem = {
        .kind = PROBLEM_SYNC_TIMEOUT,
        .retry_after_s = after,
        .more = write_job_link,
        .user = job,
    };

    reply_header(call->request, call->reply, "Location", "/v1/jobs/%s",
                 job->id);
    say_preferences(call, true);
    if (call->visit->prefer.respond_async) {
        reply_header(call->request, call->reply, "Retry-After", "%u", after);
        return call_job(call, 202, job);
    }
    problem.detail =
        call_waits_in_vain(call, job)
            ? "the service is shutting down; the job is kept and goes on when "
              "it is back"
            : arena_printf(call->request->arena,
                           "not done after %.0f s; the job goes on, and the "
                           "same request later is answered from the cache",
                           call->visit->wait);
    return call_show_problem(call, &problem);
}

static void
write_estimate(struct json_writer *w, const void *user)
{
    const struct scene_cost *cost = user;

    json_begin_object(w, "estimate");
    json_put_number(w, "rays", cost->rays);
    json_put_number(w, "seconds", cost->seconds);
    json_put_number(w, "memory_bytes", cost->memory_bytes);
    json_end_object(w);
}

static enum http_verdict
refuse_hopeless(struct call *call, const struct scene_cost *cost)
{
    struct problem problem = {
        .kind = PROBLEM_NEEDS_ASYNC,
        .more = write_estimate,
        .user = cost,
    };

    problem.detail = arena_printf(
        call->request->arena,
        "about %.0f s, but the answer is awaited for %.0f s; send Prefer: "
        "respond-async or use POST /v1/jobs",
        cost->seconds, call->visit->wait);
    return call_show_problem(call, &problem);
}

/* --- turns --- */

/* Answer from what was rendered before. False: there is nothing. */
static bool
answer_from_cache(struct call *call, const struct order *order)
{
    struct request *request = call->request;
    const char *etag = result_etag(order->job.render_key, request->arena);
    struct job job;
    uint64_t len;
    int fd;

    if (header_has_word(request_header(request, "Cache-Control"), "no-cache"))
        return false;
    /* The tag names the very bytes, whether or not they are still stored. */
    if (etag && !call->visit->as_job && !call->visit->form_scene &&
        etag_listed(request_header(request, "If-None-Match"), etag)) {
        call->reply->status = 304;
        reply_header(request, call->reply, "ETag", "%s", etag);
        reply_header(request, call->reply, "Cache-Control",
                     "private, max-age=86400");
        return true;
    }
    if (!store_find(call->api->store, order->job.render_key, "", &job, NULL))
        return false;
    fd = result_open(call, &job, &len, true);
    if (fd < 0)
        return false;
    if (call->visit->as_job || call->visit->form_scene) {
        close(fd);
        deliver(call, &job, "hit");
        return true;
    }
    say_preferences(call, true);
    result_send(call, &job, fd, len, "hit");
    return true;
}

static enum http_verdict
place_order(struct call *call, struct order *order)
{
    if (!choose_output(call, order) || !order_complete(call, order))
        return HTTP_REPLY;
    if (answer_from_cache(call, order))
        return HTTP_REPLY;
    if (!call->visit->prefer.respond_async &&
        order->cost.seconds > HOPELESS * call->visit->wait)
        return refuse_hopeless(call, &order->cost);
    return order_submit(call, order);
}

static enum http_verdict
render_begin(struct call *call, const char *text, size_t len)
{
    struct order order;
    int64_t wait_until;
    enum http_verdict verdict;

    read_preferences(call);
    wait_until = call->visit->deadline_us;
    verdict = order_read(call, text, len, &order) ? place_order(call, &order)
                                                  : order_refuse(call, &order);
    order_clear(&order);
    call->visit->wait_until_us = wait_until;
    /* An Idempotency-Key says that the client will come back for it. */
    call->visit->cancel_when_gone =
        verdict == HTTP_PARK &&
        !request_header(call->request, "Idempotency-Key");
    return verdict;
}

static enum http_verdict
look_at_job(struct call *call)
{
    struct error err = {0};
    struct job job;

    if (!store_get(call->api->store, call->visit->job, &job, &err))
        return call_store_problem(call, &err);
    if (job.state == JOB_SUCCEEDED)
        return deliver(call, &job, "miss");
    if (job.state == JOB_FAILED)
        return result_refuse(call, &job, PROBLEM_RENDER_FAILED);
    if (job.state == JOB_CANCELED)
        return result_refuse(call, &job, PROBLEM_CONFLICT_STATE);
    if (call_is_late(call) || call_waits_in_vain(call, &job))
        return leave_running(call, &job);
    return call_park(call);
}

static enum http_verdict
render_go_on(struct call *call)
{
    struct visit *visit = call->visit;
    struct job job;
    bool answered;

    if (visit->stage == STAGE_COMMIT) {
        if (!call_committed(call, &job, &answered))
            return answered ? HTTP_REPLY : call_park(call);
        visit->stage = STAGE_CHANGE;
        visit->deadline_us = visit->wait_until_us;
        call->request->timed_out = false; /* that was the commit's turn */
    }
    return look_at_job(call);
}

enum http_verdict
render_post(struct call *call)
{
    if (call->visit->stage != STAGE_NEW)
        return render_go_on(call);
    if (!order_media_type(call))
        return HTTP_REPLY;
    return render_begin(call, call->request->body, call->request->body_len);
}

enum http_verdict
render_form(struct call *call)
{
    size_t len;

    if (call->visit->stage != STAGE_NEW)
        return render_go_on(call);
    if (!page_read_form(call, &len))
        return HTTP_REPLY;
    return render_begin(call, call->visit->form_scene, len);
}
