#include "cli/render.h"

#include <string.h>

#include "cli/exit.h"
#include "cli/interrupt.h"
#include "cli/problem.h"
#include "cli/remote.h"
#include "core/base/clock.h"

enum {
    ANSWER_S = 30,     /* longest silence where no wait was asked for */
    RENDER_WAIT_S = 1, /* then it becomes a job whose progress is told */
    CANCEL_S = 5,      /* for a last word after Ctrl-C */
    JOB_WAIT_S = 1,    /* between two looks at it */
    RETRY_MAX = 5      /* looks in a row that found nobody */
};

/* One render at one server. */
struct call {
    const struct render_ask *ask;
    struct bytes *picture;
    struct remote *remote;
    struct bytes body; /* the job document sent */
    unsigned lines_before;
    char job[64]; /* "job_01J...", "" before the server named it */
    int failures; /* looks in a row that found nobody */
};

static int
fail(struct call *call, int status, const char *text)
{
    progress_erase(call->ask->progress);
    say_error(call->ask->messages, "glint render", "%s", text);
    return status;
}

static int
refuse(struct call *call, const struct remote_reply *reply)
{
    progress_erase(call->ask->progress);
    return problem_print(reply, call->ask->messages, "glint render",
                         call->ask->document, call->lines_before);
}

/* Ids are letters, digits and underscores: nothing else gets into a path. */
static bool
take_job_id(struct call *call, const char *text)
{
    size_t len = strspn(text, "abcdefghijklmnopqrstuvwxyz"
                              "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_");
    if (strncmp(text, "job_", 4) != 0 || len >= sizeof call->job ||
        (text[len] != '\0' && text[len] != '/'))
        return false;
    memcpy(call->job, text, len);
    call->job[len] = '\0';
    return true;
}

static bool
job_of_location(struct call *call, const struct remote_reply *reply)
{
    const char *at = strstr(reply->location, "/v1/jobs/");
    return at != NULL && take_job_id(call, at + strlen("/v1/jobs/"));
}

/* Nobody there, timed out, or interrupted: the transport's own failures. */
static int
broken(struct call *call, const struct error *err)
{
    if (err->code != ERROR_CANCELED && call->job[0] == '\0')
        return fail(call, STATUS_SERVER, err->text);
    if (err->code != ERROR_CANCELED) {
        char text[512];
        snprintf(text, sizeof text, "%s; the job is %s", err->text, call->job);
        return fail(call, STATUS_SERVER, text);
    }
    /* Before a job is known there is none, or the server notices that we left
     * and cancels it. */
    if (call->job[0] != '\0') {
        struct remote_reply reply;
        char path[128];
        snprintf(path, sizeof path, "/v1/jobs/%s/cancel", call->job);
        struct bytes nothing = {0};
        struct remote_ask ask = {.method = "POST",
                                 .path = path,
                                 .body = &nothing,
                                 .timeout_s = CANCEL_S,
                                 .grace_s = CANCEL_S};
        if (remote_send(call->remote, &ask, &reply, NULL))
            remote_reply_clear(&reply);
    }
    return fail(call, STATUS_INTERRUPTED, "interrupted; nothing was written");
}

/* Seconds until --timeout, at most `most`; 0 when it has passed. */
static double
time_left(const struct call *call, double most)
{
    if (call->ask->deadline_us == 0)
        return most;
    double left = (double)(call->ask->deadline_us - clock_monotonic_us()) / 1e6;
    return left < 0 ? 0 : left < most ? left : most;
}

static int
timed_out(struct call *call)
{
    char text[160];
    snprintf(text, sizeof text, "timed out; %s goes on at the server",
             call->job);
    return fail(call, STATUS_TIMEOUT, text);
}

/* ---- a picture at once, or a job ---- */

static bool
is_picture(const struct call *call, const struct remote_reply *reply)
{
    return reply->status == 200 &&
           strcmp(reply->media_type, output_media_type(call->ask->output)) == 0;
}

static void
take_picture(struct call *call, struct remote_reply *reply)
{
    *call->picture = reply->body;
    reply->body = (struct bytes){0};
}

/* Small renders answer at once; others become a job after a second.
 * -1: there is a job to wait for. */
static int
submit(struct call *call)
{
    char prefer[64], accept[64];
    snprintf(prefer, sizeof prefer, "Prefer: respond-async, wait=%d",
             RENDER_WAIT_S);
    snprintf(accept, sizeof accept, "Accept: %s",
             output_media_type(call->ask->output));
    const char *headers[] = {"Content-Type: application/json", prefer, accept,
                             NULL};
    /* An interruption waits for the answer: whoever left a moment before a
     * 202 would leave a job behind. */
    struct remote_ask ask = {.method = "POST",
                             .path = "/v1/render",
                             .body = &call->body,
                             .headers = headers,
                             .timeout_s = ANSWER_S,
                             .grace_s = RENDER_WAIT_S + 1};
    struct remote_reply reply;
    struct error err = {0};
    int status = -1;

    if (!remote_send(call->remote, &ask, &reply, &err))
        return broken(call, &err);
    if (is_picture(call, &reply)) {
        take_picture(call, &reply);
        status = STATUS_OK;
    } else if (reply.status == 202 || reply.status == 503) {
        /* 503 with a job's Location is sync-timeout: it goes on. */
        if (!job_of_location(call, &reply))
            status = refuse(call, &reply);
    } else {
        status = refuse(call, &reply);
    }
    remote_reply_clear(&reply);
    return status;
}

/* ---- the job ---- */

static double
number_of(const struct json *object, const char *name, double otherwise)
{
    const struct json *m = json_member(object, name);
    return m != NULL && m->type == JSON_NUMBER ? m->number : otherwise;
}

static const char *
string_of(const struct json *object, const char *name)
{
    const struct json *m = json_member(object, name);
    return m != NULL && m->type == JSON_STRING ? m->string : "";
}

/* The server's word for what it does, if it is one of ours. */
static const char *
stage_of(const struct json *job)
{
    static const char *const known[] = {"queued", "loading", "building",
                                        "tracing", "encoding"};
    const char *phase = string_of(job, "phase");
    if (strcmp(string_of(job, "state"), "queued") == 0)
        return "queued";
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        if (strcmp(known[i], phase) == 0)
            return known[i];
    }
    return "running";
}

static int
job_failed(struct call *call, const struct json *job, const char *state)
{
    const struct json *error = json_member(job, "error");
    const char *detail = string_of(error, "detail");
    char text[512];
    snprintf(text, sizeof text, "%s %s%s%.300s", call->job, state,
             *detail ? ": " : "", detail);
    return fail(call, STATUS_FAILED, text);
}

/* Read a job object. -1: not finished; STATUS_OK: its result is there. */
static int
read_job(struct call *call, const struct remote_reply *reply)
{
    struct arena arena;
    arena_init(&arena, 0);
    struct error_list errors = {.arena = &arena};
    const struct json *job = json_read(reply->body.data ? reply->body.data : "",
                                       reply->body.len, NULL, &arena, &errors);
    const char *state = job != NULL ? string_of(job, "state") : "";
    int status = -1;

    if (strcmp(state, "succeeded") == 0) {
        status = STATUS_OK;
    } else if (strcmp(state, "failed") == 0 || strcmp(state, "canceled") == 0) {
        status = job_failed(call, job, state);
    } else if (*state == '\0') {
        status = fail(call, STATUS_SERVER, "the server's answer is no job");
    } else {
        struct progress_facts facts = {
            .stage = stage_of(job),
            .fraction = number_of(job, "progress", 0),
            .rays_per_second = number_of(job, "rays_per_second", 0),
            .seconds_left = number_of(job, "eta_seconds", -1),
        };
        progress_show(call->ask->progress, &facts, clock_monotonic_us());
    }
    arena_clear(&arena);
    return status;
}

/* One look at the job. A server that restarts may be away for a moment. */
static int
look(struct call *call)
{
    char path[160];
    snprintf(path, sizeof path, "/v1/jobs/%s?wait=%d", call->job, JOB_WAIT_S);
    struct remote_ask ask = {
        .method = "GET", .path = path, .timeout_s = ANSWER_S};
    struct remote_reply reply;
    struct error err = {0};
    if (!remote_send(call->remote, &ask, &reply, &err)) {
        if (err.code == ERROR_CANCELED || ++call->failures >= RETRY_MAX)
            return broken(call, &err);
        interrupt_wait(1000);
        return -1;
    }
    call->failures = 0;
    int status =
        reply.status == 200 ? read_job(call, &reply) : refuse(call, &reply);
    remote_reply_clear(&reply);
    return status;
}

static int
fetch(struct call *call)
{
    char path[160], accept[64];
    snprintf(path, sizeof path, "/v1/jobs/%s/result", call->job);
    snprintf(accept, sizeof accept, "Accept: %s",
             output_media_type(call->ask->output));
    const char *headers[] = {accept, NULL};
    struct remote_ask ask = {
        .method = "GET", .path = path, .headers = headers, .timeout_s = 600};
    struct remote_reply reply;
    struct error err = {0};
    if (!remote_send(call->remote, &ask, &reply, &err))
        return broken(call, &err);
    int status = STATUS_OK;
    if (is_picture(call, &reply))
        take_picture(call, &reply);
    else
        status = refuse(call, &reply);
    remote_reply_clear(&reply);
    return status;
}

static int
wait_for_job(struct call *call)
{
    for (;;) {
        int status = look(call);
        if (status == STATUS_OK)
            return fetch(call);
        if (status > 0)
            return status;
        if (time_left(call, 1) <= 0)
            return timed_out(call);
    }
}

int
render_remote(const struct render_ask *ask, struct bytes *picture)
{
    struct call call = {.ask = ask, .picture = picture};
    struct bytes output = {0};
    struct error err = {0};
    int status;

    call.remote = remote_open(ask->server, &err);
    if (call.remote == NULL)
        return fail(&call, STATUS_USAGE, err.text);
    output_write(ask->output, &output);
    document_write_job(ask->document, output.data ? output.data : "{}",
                       &call.body, &call.lines_before);
    if (output.failed || call.body.failed) {
        status = fail(&call, STATUS_FAILED, "no memory for the request");
        goto out;
    }
    status = submit(&call);
    if (status < 0)
        status = wait_for_job(&call);
out:
    bytes_clear(&output);
    bytes_clear(&call.body);
    remote_close(call.remote);
    return status;
}
