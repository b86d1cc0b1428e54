/* GET /v1/jobs: filters, pages. */
#include <stdlib.h>
#include <string.h>

#include "core/base/clock.h"
#include "server/api/moment.h"
#include "server/api/routes.h"

enum { LIMIT_DEFAULT = 50, LIMIT_MAX = 200 };

static enum http_verdict
refuse_parameter(struct call *call, const char *name, const char *wanted)
{
    return call_problem(call, PROBLEM_REQUEST_MALFORMED,
                        "%s must be %s, got '%.64s'", name, wanted,
                        request_query(call->request, name));
}

/* "queued,running" -> bits. */
static bool
read_states(const char *text, unsigned *states)
{
    char name[16];

    for (;;) {
        size_t len = strcspn(text, ",");
        enum job_state state;

        if (len >= sizeof name)
            return false;
        memcpy(name, text, len);
        name[len] = '\0';
        state = job_state_find(name);
        if (state == JOB_STATE_COUNT)
            return false;
        *states |= 1u << state;
        if (text[len] == '\0')
            return true;
        text += len + 1;
    }
}

static bool
is_tag(const char *text)
{
    static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                  "abcdefghijklmnopqrstuvwxyz0123456789";
    size_t len = strlen(text);

    return len >= 1 && len <= 64 && strspn(text, letters) >= 1 &&
           len == strspn(text, "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
                               "abcdefghijklmnopqrstuvwxyz0123456789_.-");
}

/* False: answered. */
static bool
read_filter(struct call *call, struct store_filter *filter)
{
    struct request *request = call->request;
    const char *state = request_query(request, "state");
    const char *since = request_query(request, "since");
    const char *limit = request_query(request, "limit");
    double number = LIMIT_DEFAULT;

    filter->tag = request_query(request, "tag");
    filter->before = request_query(request, "cursor");
    if (state && !read_states(state, &filter->states))
        refuse_parameter(call, "state",
                         "queued, running, succeeded, failed or canceled, or "
                         "several of them with commas");
    else if (filter->tag && !is_tag(filter->tag))
        refuse_parameter(call, "tag", "a name");
    else if (since && !moment_read(since, &filter->since_ms))
        refuse_parameter(call, "since",
                         "a time like 2026-11-22T11:30:00Z (write a + as "
                         "%2B)");
    else if (limit && (!seconds_read(limit, &number) || number < 1 ||
                       number > LIMIT_MAX))
        refuse_parameter(call, "limit", "a whole number from 1 to 200");
    else if (filter->before && !ulid_is_id("job", filter->before))
        refuse_parameter(call, "cursor", "one that a former page gave");
    else {
        filter->limit = (unsigned)number;
        return true;
    }
    return false;
}

/* Is there a job after the last one of a full page? */
static bool
has_more(struct call *call, const struct store_filter *filter, const char *last)
{
    struct store_filter next = *filter;
    struct job job;

    next.before = last;
    next.limit = 1;
    return store_list(call->api->store, &next, &job, NULL) == 1;
}

/* The path of the next page, in the request's arena. */
static const char *
next_page(struct call *call, const struct store_filter *filter,
          const char *last)
{
    struct arena *arena = call->request->arena;
    const char *state = request_query(call->request, "state");
    char since[CLOCK_RFC3339_SIZE] = "";

    if (filter->since_ms)
        clock_rfc3339(filter->since_ms, since);
    return arena_printf(
        arena, "/v1/jobs?limit=%u&cursor=%s%s%s%s%s%s%s", filter->limit, last,
        state ? "&state=" : "", state ? state : "", filter->tag ? "&tag=" : "",
        filter->tag ? filter->tag : "", since[0] ? "&since=" : "", since);
}

static enum http_verdict
answer_list(struct call *call, const struct job *jobs, int count,
            const char *next)
{
    struct bytes body = {0};
    struct json_writer w = {.out = &body};
    int i;

    json_begin_object(&w, NULL);
    json_begin_array(&w, "jobs");
    for (i = 0; i < count; i++)
        call_write_job(call, &w, NULL, &jobs[i]);
    json_end_array(&w);
    json_put_string_or_null(&w, "next", next);
    json_end_object(&w);
    bytes_text(&body, "\n");
    if (next)
        reply_header(call->request, call->reply, "Link", "<%s>; rel=\"next\"",
                     next);
    reply_header(call->request, call->reply, "Cache-Control", "no-cache");
    return call_body(call, 200, "application/json", &body);
}

enum http_verdict
jobs_list(struct call *call)
{
    struct store_filter filter = {0};
    enum http_verdict verdict;
    const char *next = NULL;
    struct error err = {0};
    struct job *jobs;
    int count;

    if (!read_filter(call, &filter))
        return HTTP_REPLY;
    jobs = calloc(filter.limit, sizeof *jobs);
    if (!jobs)
        return call_problem(call, PROBLEM_INTERNAL, "no memory for a list");
    count = store_list(call->api->store, &filter, jobs, &err);
    if (count == (int)filter.limit &&
        has_more(call, &filter, jobs[count - 1].id))
        next = next_page(call, &filter, jobs[count - 1].id);
    verdict = count < 0 ? call_store_problem(call, &err)
                        : answer_list(call, jobs, count, next);
    free(jobs);
    return verdict;
}
