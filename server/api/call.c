#include "server/api/inside.h"

#include <stdio.h>
#include <string.h>

#include "core/base/clock.h"
#include "server/api/files.h"
#include "server/api/job_json.h"

enum { COMMIT_WAIT_US = 60 * 1000000 };

enum http_verdict
call_park(struct call *call)
{
    int64_t left_us = call->visit->deadline_us - clock_monotonic_us();

    *call->park_ms = left_us > 0 ? left_us / 1000 + 1 : 1;
    return HTTP_PARK;
}

bool
call_is_late(const struct call *call)
{
    return call->request->timed_out ||
           clock_monotonic_us() >= call->visit->deadline_us;
}

bool
call_waits_in_vain(const struct call *call, const struct job *job)
{
    return job->state == JOB_QUEUED && atomic_load(&call->api->draining);
}

enum http_verdict
call_show_problem(struct call *call, const struct problem *problem)
{
    if (call->visit && call->visit->show_problem)
        call->visit->show_problem(call, problem);
    else
        problem_reply(call->request, call->reply, problem);
    return HTTP_REPLY;
}

enum http_verdict
call_problem(struct call *call, enum problem_kind kind, const char *format, ...)
{
    struct problem problem = {.kind = kind};
    va_list args;

    va_start(args, format);
    problem.detail = arena_vprintf(call->request->arena, format, args);
    va_end(args);
    return call_show_problem(call, &problem);
}

enum http_verdict
call_body(struct call *call, unsigned status, const char *media_type,
          struct bytes *body)
{
    if (body->failed) {
        bytes_clear(body);
        return call_problem(call, PROBLEM_INTERNAL,
                            "no memory to write the answer");
    }
    call->reply->status = status;
    call->reply->body = *body;
    memset(body, 0, sizeof *body);
    reply_header(call->request, call->reply, "Content-Type", "%s", media_type);
    return HTTP_REPLY;
}

void
call_write_job(struct call *call, struct json_writer *w, const char *key,
               const struct job *job)
{
    struct job_around around = {
        .isa = call->api->isa,
        .position = -1,
        .now_ms = clock_wall_ms(),
        .arena = call->request->arena,
    };
    uint64_t position;

    if (job->state == JOB_QUEUED &&
        store_position(call->api->store, job->id, &position, NULL))
        around.position = (int64_t)position;
    job_json_write(w, key, job, &around);
}

enum http_verdict
call_job(struct call *call, unsigned status, const struct job *job)
{
    struct bytes body = {0};
    struct json_writer w = {.out = &body};

    call_write_job(call, &w, NULL, job);
    bytes_text(&body, "\n");
    reply_header(call->request, call->reply, "ETag", "W/\"r%u\"",
                 job->revision);
    reply_header(call->request, call->reply, "Cache-Control", "no-cache");
    return call_body(call, status, "application/json", &body);
}

enum http_verdict
call_file(struct call *call, const struct file *file, const char *media_type)
{
    const char *etag =
        arena_printf(call->request->arena, "\"%.32s\"", file->sha256);

    if (!etag)
        return call_problem(call, PROBLEM_INTERNAL, "no memory");
    reply_header(call->request, call->reply, "ETag", "%s", etag);
    reply_header(call->request, call->reply, "Cache-Control", "no-cache");
    if (etag_listed(request_header(call->request, "If-None-Match"), etag)) {
        call->reply->status = 304;
        return HTTP_REPLY;
    }
    call->reply->status = 200;
    reply_header(call->request, call->reply, "Content-Type", "%s", media_type);
    call->reply->fixed = (const char *)file->data;
    call->reply->fixed_len = file->len;
    return HTTP_REPLY;
}

enum http_verdict
call_store_problem(struct call *call, const struct error *err)
{
    static const struct {
        enum error_code code;
        enum problem_kind kind;
    } rows[] = {
        {ERROR_NOT_FOUND, PROBLEM_NOT_FOUND},
        {ERROR_CONFLICT, PROBLEM_CONFLICT_STATE},
        {ERROR_QUEUE_FULL, PROBLEM_QUEUE_FULL},
        {ERROR_STORAGE_FULL, PROBLEM_STORAGE_FULL},
        {ERROR_DRAINING, PROBLEM_DRAINING},
    };
    size_t i;

    for (i = 0; i < sizeof rows / sizeof rows[0]; i++)
        if (rows[i].code == err->code)
            return call_problem(call, rows[i].kind, "%s", err->text);
    return call_problem(call, PROBLEM_INTERNAL, "%s", err->text);
}

struct available {
    const char *const *names;
    size_t count;
};

static void
write_available(struct json_writer *w, const void *user)
{
    const struct available *available = user;
    size_t i;

    json_begin_array(w, "available");
    for (i = 0; i < available->count; i++)
        json_put_string(w, NULL, available->names[i]);
    json_end_array(w);
}

enum http_verdict
call_not_acceptable(struct call *call, const char *const *available,
                    size_t count, const char *detail)
{
    struct available list = {available, count};
    struct problem problem = {
        .kind = PROBLEM_NOT_ACCEPTABLE,
        .detail = detail,
        .more = write_available,
        .user = &list,
    };

    return call_show_problem(call, &problem);
}

bool
call_watch(struct call *call, const char *job)
{
    struct visit *visit = call->visit;

    if (!events_watch(call->api->events, job, call->request->ticket)) {
        call_problem(call, PROBLEM_INTERNAL, "no memory to wait for a job");
        return false;
    }
    visit->ticket = call->request->ticket;
    snprintf(visit->job, sizeof visit->job, "%s", job);
    return true;
}

enum http_verdict
call_await_commit(struct call *call, struct commit *commit)
{
    call->visit->commit = commit;
    call->visit->stage = STAGE_COMMIT;
    call->visit->deadline_us = clock_monotonic_us() + COMMIT_WAIT_US;
    return call_park(call);
}

bool
call_committed(struct call *call, struct job *job, bool *answered)
{
    struct commit *commit = call->visit->commit;

    *answered = false;
    if (!atomic_load(&commit->done)) {
        if (call_is_late(call)) {
            *answered = true;
            call_problem(call, PROBLEM_QUEUE_FULL,
                         "the disk did not take the change within 60 s; it may "
                         "still be made");
        }
        return false;
    }
    call->visit->commit = NULL;
    if (commit->err.code != ERROR_NONE) {
        *answered = true;
        call_store_problem(call, &commit->err);
    } else if (commit->has_job) {
        *job = commit->job;
    }
    commit_drop(commit);
    return !*answered;
}
