/* Checking scenes, and the examples. */
#include <string.h>

#include "core/scene/scene_hash.h"
#include "core/scene/scene_json.h"
#include "server/api/examples.h"
#include "server/api/order.h"
#include "server/api/routes.h"

/* --- POST /v1/scenes/validate --- */

static const char *
texture_kind_name(enum texture_kind kind)
{
    return kind == TEXTURE_CHECKERBOARD ? "checkerboard" : "constant";
}

static void
write_summary(struct json_writer *w, const struct scene *scene)
{
    struct bytes counts = {0};
    bool seen[2] = {false};
    uint32_t i;

    scene_write_object_counts(scene, &counts);
    json_begin_object(w, "summary");
    json_put_raw(w, "objects", counts.data ? counts.data : "{}",
                 counts.data ? counts.len : 2);
    json_put_integer(w, "lights", scene->light_count);
    json_put_integer(w, "max_bounces", scene->integrator.max_bounces);
    json_begin_array(w, "textures");
    for (i = 0; i < scene->texture_count; i++) {
        unsigned kind = scene->textures[i].kind;

        if (kind < 2 && !seen[kind])
            json_put_string(w, NULL,
                            texture_kind_name(scene->textures[i].kind));
        if (kind < 2)
            seen[kind] = true;
    }
    json_end_array(w);
    json_begin_array(w, "assets");
    json_end_array(w);
    json_end_object(w);
    bytes_clear(&counts);
}

static void
write_valid(struct call *call, struct json_writer *w, struct order *order,
            bool lint)
{
    const struct scene_cost *cost = &order->cost;
    const struct lint_item *items = NULL;
    size_t count = 0;

    if (lint)
        count = scene_lint(order->document.scene, &order->scene, &order->arena,
                           &items);
    json_put_bool(w, "valid", true);
    json_put_string(w, "scene_hash", order->job.scene_hash);
    problem_write_errors(w, &order->errors);
    problem_write_warnings(w, items, count);
    write_summary(w, &order->scene);
    json_put_string(w, "lint", lint ? "done" : "skipped");
    json_begin_object(w, "estimate");
    json_put_number(w, "rays", cost->rays);
    json_put_number(w, "seconds", cost->seconds);
    json_put_number(w, "memory_bytes", cost->memory_bytes);
    json_put_bool(w, "fits_sync",
                  cost->seconds <= call->api->options.default_wait);
    json_end_object(w);
}

static void
write_invalid(struct json_writer *w, const struct order *order)
{
    json_put_bool(w, "valid", false);
    json_put_null(w, "scene_hash");
    problem_write_errors(w, &order->errors);
    problem_write_warnings(w, NULL, 0);
    json_put_null(w, "summary");
    json_put_string(w, "lint", "skipped");
    json_put_null(w, "estimate");
}

static enum http_verdict
answer_validate(struct call *call, struct order *order, bool valid, bool lint)
{
    struct bytes body = {0};
    struct json_writer w = {.out = &body};

    if (valid && !order_complete(call, order))
        return HTTP_REPLY;
    json_begin_object(&w, NULL);
    if (valid)
        write_valid(call, &w, order, lint);
    else
        write_invalid(&w, order);
    json_end_object(&w);
    bytes_text(&body, "\n");
    return call_body(call, 200, "application/json", &body);
}

/* Not JSON at all: that is a bad request, not a bad scene. */
static bool
is_readable(const struct order *order)
{
    return order->root != NULL;
}

enum http_verdict
scenes_validate(struct call *call)
{
    const char *lint = request_query(call->request, "lint");
    enum http_verdict verdict;
    struct order order;
    bool valid;

    if (lint && strcmp(lint, "0") != 0 && strcmp(lint, "1") != 0)
        return call_problem(call, PROBLEM_REQUEST_MALFORMED,
                            "lint must be 0 or 1, got '%.32s'", lint);
    if (!order_media_type(call))
        return HTTP_REPLY;
    valid =
        order_read(call, call->request->body, call->request->body_len, &order);
    verdict = is_readable(&order)
                  ? answer_validate(call, &order, valid,
                                    !lint || strcmp(lint, "1") == 0)
                  : order_refuse(call, &order);
    order_clear(&order);
    return verdict;
}

/* --- GET /v1/scenes/examples[/{name}] --- */

static const char *
text_member(const struct json *scene, const char *key)
{
    const struct json *member = json_member(scene, key);

    return member && member->type == JSON_STRING ? member->string : NULL;
}

static void
write_example(struct json_writer *w, const struct file *file, const char *name,
              struct arena *arena)
{
    struct error_list errors = {.arena = arena};
    const struct json *scene =
        json_read((const char *)file->data, file->len, NULL, arena, &errors);
    const char *title = scene ? text_member(scene, "name") : NULL;
    const char *self = arena_printf(arena, "/v1/scenes/examples/%s", name);

    json_begin_object(w, NULL);
    json_put_string(w, "name", name);
    json_put_string(w, "title", title ? title : name);
    json_put_string_or_null(w, "description",
                            scene ? text_member(scene, "description") : NULL);
    json_put_null(w, "thumbnail");
    json_begin_object(w, "links");
    json_put_string_or_null(w, "self", self);
    json_end_object(w);
    json_end_object(w);
}

enum http_verdict
scenes_examples(struct call *call)
{
    struct bytes body = {0};
    struct json_writer w = {.out = &body};
    const struct file *file;
    const char *name;
    char hash[SHA256_HEX_SIZE];
    struct file list = {0};
    size_t i;

    json_begin_object(&w, NULL);
    json_begin_array(&w, "examples");
    for (i = 0; (file = example_at(i, call->request->arena, &name)); i++) {
        struct arena arena;

        arena_init(&arena, 0);
        write_example(&w, file, name, &arena);
        arena_clear(&arena);
    }
    json_end_array(&w);
    json_end_object(&w);
    bytes_text(&body, "\n");
    if (body.failed)
        return call_body(call, 200, "application/json", &body);
    sha256_of(body.data, body.len, hash);
    list.sha256 = hash;
    call_file(call, &list, "application/json");
    if (call->reply->status == 304)
        bytes_clear(&body);
    else
        call->reply->body = body;
    return HTTP_REPLY;
}

enum http_verdict
scenes_example(struct call *call)
{
    const struct file *file = example_find(call->param);

    if (!file)
        return call_problem(call, PROBLEM_NOT_FOUND,
                            "there is no example '%.64s'; GET "
                            "/v1/scenes/examples lists them",
                            call->param);
    return call_file(call, file, "application/json");
}
