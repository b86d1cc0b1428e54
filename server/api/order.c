#include "server/api/order.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "core/scene/scene_hash.h"
#include "core/scene/scene_json.h"
#include "server/api/budget.h"

enum {
    /* A tree takes about 40 times its text; the rest is the scene. */
    ARENA_PER_BYTE = 64,
    ARENA_LEAST = 32 << 20,
    STORAGE_LEAST = 256 << 20,
    RETRY_MAX_S = 60
};

static bool
media_type_is(const char *header, const char *type)
{
    size_t len = strlen(type);

    return strncasecmp(header, type, len) == 0 &&
           (header[len] == '\0' || header[len] == ';' || header[len] == ' ');
}

bool
order_media_type(struct call *call)
{
    const char *type = request_header(call->request, "Content-Type");

    if (type && media_type_is(type, "application/json"))
        return true;
    if (type && media_type_is(type, "application/x-www-form-urlencoded") &&
        call->request->body[0] == '{' &&
        !request_header(call->request, "Origin"))
        return true;
    call_problem(call, PROBLEM_UNSUPPORTED_MEDIA_TYPE,
                 "the body must be JSON with Content-Type: application/json, "
                 "got %.100s%s",
                 type ? type : "no Content-Type",
                 type ? ""
                      : "; with curl: -H 'Content-Type: application/json' "
                        "--data-binary @scene.json");
    return false;
}

bool
order_read(struct call *call, const char *text, size_t len, struct order *order)
{
    struct scene_limits limits = call->api->options.scene_limits;
    struct json_limits json_limits = {
        .max_bytes = call->api->options.max_scene_bytes,
    };

    memset(order, 0, sizeof *order);
    arena_init(&order->arena,
               ARENA_LEAST + ARENA_PER_BYTE * json_limits.max_bytes);
    order->errors.arena = &order->arena;
    order->max_pixels = limits.max_pixels;
    order->text = text;
    order->len = len;
    order->root =
        json_read(text, len, &json_limits, &order->arena, &order->errors);
    if (!order->root)
        return false;
    job_json_read(order->root, &order->document, &order->errors);
    if (order->document.scene)
        scene_read(order->document.scene, &limits, &order->arena, &order->scene,
                   &order->errors);
    error_list_sort(&order->errors);
    return order->errors.count == 0;
}

void
order_price(struct call *call, struct order *order)
{
    struct pool_status status;

    events_pool_status(call->api->events, &status);
    order->cost = scene_cost(&order->scene, &order->document.output,
                             status.rays_per_second);
}

/* --- refusing --- */

static bool
starts_with(const char *text, const char *start)
{
    return strncmp(text, start, strlen(start)) == 0;
}

/* Which problem a list of errors is. */
static enum problem_kind
kind_of(const struct order *order)
{
    const struct error_list *errors = &order->errors;
    bool all_budget = true, job = false;
    size_t i;

    for (i = 0; i < errors->count; i++) {
        const struct error_item *item = &errors->items[i];
        const char *name = error_code_name(item->code);

        if (item->code == ERROR_BUDGET_BYTES)
            return PROBLEM_TOO_LARGE;
        if (starts_with(name, "json."))
            return PROBLEM_JSON_SYNTAX;
        all_budget = all_budget && (starts_with(name, "budget.") ||
                                    item->code == ERROR_MEMORY);
        job = job || (order->document.is_job && item->pointer &&
                      !starts_with(item->pointer, "/scene"));
    }
    return all_budget ? PROBLEM_BUDGET_EXCEEDED
           : job      ? PROBLEM_JOB_INVALID
                      : PROBLEM_SCENE_INVALID;
}

/* `curl -d @file` drops the line breaks: then every place is on line 1. */
static bool
lost_its_lines(struct call *call, const struct order *order)
{
    const char *agent = request_header(call->request, "User-Agent");
    const char *type = request_header(call->request, "Content-Type");

    return order->len > 80 && !memchr(order->text, '\n', order->len) &&
           ((agent && starts_with(agent, "curl/")) ||
            (type &&
             media_type_is(type, "application/x-www-form-urlencoded"))) &&
           !call->visit->form_scene;
}

static void
add_line_hint(struct order *order)
{
    static const char hint[] =
        "The body came without line breaks, so everything is on line 1; with "
        "curl use --data-binary @file, not -d @file.";
    size_t i;

    for (i = 0; i < order->errors.count; i++) {
        struct error_item *item = &order->errors.items[i];

        item->hint =
            item->hint ? arena_printf(&order->arena, "%s %s", item->hint, hint)
                       : hint;
    }
}

/* "2 errors; the first: /objects/2/radius must be greater than 0, got -1" */
static const char *
summary(struct order *order)
{
    const struct error_list *errors = &order->errors;
    const struct error_item *first = &errors->items[0];
    const char *text = arena_printf(
        &order->arena, "%s%s%s", first->pointer ? first->pointer : "",
        !first->pointer || !first->pointer[0] ? ""
        : starts_with(first->detail, "must ") ? " "
                                              : ": ",
        first->detail);

    if (errors->count == 1)
        return arena_printf(&order->arena, "1 error: %s", text);
    return arena_printf(&order->arena, "%s%zu errors; the first: %s",
                        errors->truncated ? "more than " : "", errors->count,
                        text);
}

/* A scene refused only for its cost: read it again without that limit, so that
 * budget.c can say what would fit. */
static bool
read_costly(struct call *call, struct order *order)
{
    struct scene_limits limits = call->api->options.scene_limits;
    struct error_list *errors = arena_alloc(&order->arena, sizeof *errors);

    if (!errors || order->errors.items[0].code != ERROR_BUDGET_RAYS)
        return false;
    errors->arena = &order->arena;
    limits.max_rays = UINT64_MAX;
    memset(&order->scene, 0, sizeof order->scene);
    if (!scene_read(order->document.scene, &limits, &order->arena,
                    &order->scene, errors))
        return false;
    order_price(call, order);
    return true;
}

enum http_verdict
order_refuse(struct call *call, struct order *order)
{
    const struct error_item *first = &order->errors.items[0];
    struct problem_place place = {order->text, order->len, first->line,
                                  first->column};
    struct problem problem = {.kind = kind_of(order), .errors = &order->errors};

    if (lost_its_lines(call, order))
        add_line_hint(order);
    problem.detail = summary(order);
    if (problem.kind == PROBLEM_JSON_SYNTAX && first->line > 0) {
        problem.more = problem_write_place;
        problem.user = &place;
    } else if (problem.kind == PROBLEM_BUDGET_EXCEEDED) {
        if (read_costly(call, order))
            return budget_refuse(call, order);
        problem.more = budget_write_pixels;
        problem.user = order;
    }
    return call_show_problem(call, &problem);
}

/* --- completing --- */

/* Text that fits its field in struct job; false otherwise. */
static bool
copy_text(const struct bytes *text, char *to, size_t size)
{
    if (text->failed || text->len >= size)
        return false;
    memcpy(to, text->data ? text->data : "", text->len);
    to[text->len] = '\0';
    return true;
}

/* Everything in order->job but the id. */
static bool
fill_job(struct call *call, struct order *order)
{
    struct job *job = &order->job;
    struct job_document *document = &order->document;
    struct bytes output = {0}, settings = {0};
    char hash[SCENE_HASH_SIZE];
    bool ok = false;

    scene_write_canonical(document->scene, &order->canonical);
    output_write(&document->output, &output);
    scene_write_settings(&order->scene, &settings);
    if (order->canonical.failed ||
        !copy_text(&output, job->output, sizeof job->output) ||
        !copy_text(&settings, job->settings, sizeof job->settings))
        goto out;
    scene_hash(order->canonical.data, order->canonical.len, &document->output,
               hash);
    snprintf(job->scene_hash, sizeof job->scene_hash, "%s", hash);
    scene_render_key(hash, glint_build, call->api->isa, job->render_key);
    memcpy(job->tags, document->tags, sizeof job->tags);
    snprintf(job->media_type, sizeof job->media_type, "%s",
             output_media_type(&document->output));
    job->max_attempts = document->max_attempts;
    job->priority = document->priority;
    job->estimate_rays = order->cost.rays;
    job->estimate_seconds = order->cost.seconds;
    job->estimate_bytes = order->cost.memory_bytes;
    ok = true;
out:
    bytes_clear(&output);
    bytes_clear(&settings);
    return ok;
}

bool
order_complete(struct call *call, struct order *order)
{
    order_price(call, order);
    if (!budget_check(call, order))
        return false;
    if (!fill_job(call, order)) {
        call_problem(call, PROBLEM_INTERNAL,
                     "no memory for the scene's canonical text");
        return false;
    }
    return true;
}

bool
order_storage_full(struct api *api, uint64_t *free_bytes, uint64_t *need)
{
    uint64_t total;

    if (!blobs_space(api->blobs, free_bytes, &total, NULL)) {
        *free_bytes = *need = 0;
        return true;
    }
    *need = total / 20 > STORAGE_LEAST ? total / 20 : STORAGE_LEAST;
    return *free_bytes < *need;
}

bool
order_welcome(struct call *call)
{
    struct api *api = call->api;
    struct store_counts counts;
    struct error err = {0};
    uint64_t free_bytes, need;

    if (atomic_load(&api->draining)) {
        call_problem(call, PROBLEM_DRAINING,
                     "the service is shutting down and takes no new jobs");
        return false;
    }
    if (order_storage_full(api, &free_bytes, &need)) {
        call_problem(call, PROBLEM_STORAGE_FULL,
                     "%llu bytes are free on the disk, new jobs need %llu",
                     (unsigned long long)free_bytes, (unsigned long long)need);
        return false;
    }
    if (!store_count(api->store, &counts, &err)) {
        call_store_problem(call, &err);
        return false;
    }
    if (counts.jobs[JOB_QUEUED] + counts.pending_writes >=
        api->options.max_queued) {
        call_problem(call, PROBLEM_QUEUE_FULL,
                     "%llu jobs are waiting, at most %u may (max_queued)",
                     (unsigned long long)counts.jobs[JOB_QUEUED],
                     api->options.max_queued);
        return false;
    }
    return true;
}

enum http_verdict
order_submit(struct call *call, struct order *order)
{
    struct error err = {0};
    struct commit *commit;

    if (!order_welcome(call))
        return HTTP_REPLY;
    ulid_id("job", order->job.id);
    commit = commit_new(call->api->events, order->job.id);
    if (!commit)
        return call_problem(call, PROBLEM_INTERNAL, "no memory for a job");
    if (!call_watch(call, order->job.id)) {
        commit_drop(commit);
        commit_drop(commit);
        return HTTP_REPLY;
    }
    if (!store_submit(call->api->store, &order->job, order->canonical.data,
                      order->canonical.len, commit_done, commit, &err)) {
        commit_drop(commit);
        commit_drop(commit);
        return call_store_problem(call, &err);
    }
    return call_await_commit(call, commit);
}

void
order_clear(struct order *order)
{
    bytes_clear(&order->canonical);
    arena_clear(&order->arena);
    memset(order, 0, sizeof *order);
}

unsigned
order_retry_after(double estimate_seconds)
{
    if (!(estimate_seconds > 1))
        return 1;
    if (estimate_seconds >= RETRY_MAX_S)
        return RETRY_MAX_S;
    return (unsigned)estimate_seconds + 1;
}
