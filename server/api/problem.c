#include "server/api/problem.h"

#include <string.h>

#include "server/api/excerpt.h"

static const struct {
    unsigned status;
    const char *slug, *title;
} kinds[PROBLEM_COUNT] = {
#define X(kind, status, slug, title) [kind] = {status, slug, title},
    PROBLEM_TABLE(X)
#undef X
};

enum { RETRY_AFTER_S = 2 };

const char *
problem_slug(enum problem_kind kind)
{
    return kinds[kind].slug;
}

const char *
problem_title(enum problem_kind kind)
{
    return kinds[kind].title;
}

unsigned
problem_status(enum problem_kind kind)
{
    return kinds[kind].status;
}

enum problem_kind
problem_find(const char *slug)
{
    unsigned kind;

    for (kind = 0; kind < PROBLEM_COUNT; kind++)
        if (strcmp(kinds[kind].slug, slug) == 0)
            break;
    return (enum problem_kind)kind;
}

/* json.* codes have their own page, all others share one. */
static void
write_help(struct json_writer *w, enum error_code code)
{
    const char *name = error_code_name(code);
    bool json = strncmp(name, "json.", 5) == 0;
    struct bytes text = {0};

    bytes_printf(&text, "/problems/%s#%s",
                 json ? "json-syntax" : "scene-invalid", name);
    json_put_string_or_null(w, "help", text.data);
    bytes_clear(&text);
}

static void
write_place(struct json_writer *w, const char *pointer, uint32_t line,
            uint32_t column)
{
    json_put_string_or_null(w, "pointer", pointer);
    if (line > 0) {
        json_put_integer(w, "line", line);
        json_put_integer(w, "column", column);
    }
}

void
problem_write_errors(struct json_writer *w, const struct error_list *errors)
{
    size_t i;

    json_begin_array(w, "errors");
    for (i = 0; i < errors->count; i++) {
        const struct error_item *item = &errors->items[i];

        json_begin_object(w, NULL);
        write_place(w, item->pointer, item->line, item->column);
        json_put_string(w, "code", error_code_name(item->code));
        json_put_string(w, "detail", item->detail ? item->detail : "");
        if (item->hint)
            json_put_string(w, "hint", item->hint);
        if (item->fix)
            json_put_raw(w, "fix", item->fix, strlen(item->fix));
        write_help(w, item->code);
        json_end_object(w);
    }
    json_end_array(w);
    if (errors->truncated)
        json_put_bool(w, "errors_truncated", true);
}

void
problem_write_warnings(struct json_writer *w, const struct lint_item *items,
                       size_t count)
{
    size_t i;

    json_begin_array(w, "warnings");
    for (i = 0; i < count; i++) {
        json_begin_object(w, NULL);
        write_place(w, items[i].pointer, items[i].line, items[i].column);
        json_put_string(w, "code", items[i].code);
        json_put_string(w, "detail", items[i].detail);
        json_end_object(w);
    }
    json_end_array(w);
}

void
problem_write_place(struct json_writer *w, const void *place)
{
    const struct problem_place *at = place;
    struct bytes excerpt = {0};

    json_put_integer(w, "line", at->line);
    json_put_integer(w, "column", at->column);
    json_put_integer(
        w, "offset",
        (int64_t)excerpt_offset(at->text, at->len, at->line, at->column));
    excerpt_write(at->text, at->len, at->line, at->column, &excerpt);
    json_put_string_or_null(w, "excerpt", excerpt.data);
    bytes_clear(&excerpt);
}

void
problem_write(const struct problem *problem, const char *request_id,
              struct bytes *out)
{
    struct json_writer w = {.out = out};
    struct bytes text = {0};

    json_begin_object(&w, NULL);
    bytes_printf(&text, "/problems/%s", problem_slug(problem->kind));
    json_put_string_or_null(&w, "type", text.data);
    json_put_string(&w, "title", problem_title(problem->kind));
    json_put_integer(&w, "status", problem_status(problem->kind));
    json_put_string(&w, "detail", problem->detail ? problem->detail : "");
    bytes_clear(&text);
    bytes_printf(&text, "/v1/requests/%s", request_id);
    json_put_string_or_null(&w, "instance", text.data);
    json_put_string(&w, "request_id", request_id);
    if (problem->more)
        problem->more(&w, problem->user);
    if (problem->errors)
        problem_write_errors(&w, problem->errors);
    if (problem->warning_count > 0)
        problem_write_warnings(&w, problem->warnings, problem->warning_count);
    json_end_object(&w);
    bytes_text(out, "\n");
    bytes_clear(&text);
}

void
problem_reply(struct request *request, struct reply *reply,
              const struct problem *problem)
{
    unsigned status = problem_status(problem->kind);

    reply->status = status;
    reply_header(request, reply, "Content-Type", "application/problem+json");
    reply_header(request, reply, "Cache-Control", "no-store");
    if (status == 429 || status == 503)
        reply_header(request, reply, "Retry-After", "%u",
                     problem->retry_after_s ? problem->retry_after_s
                                            : RETRY_AFTER_S);
    problem_write(problem, request->id, &reply->body);
}
