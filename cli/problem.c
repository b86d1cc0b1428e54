#include "cli/problem.h"

#include <string.h>

#include "cli/exit.h"

enum { PROBLEM_MAX = 4 * 1024 * 1024 };

int
problem_status(long http_status)
{
    switch (http_status) {
    case 401:
    case 403:
    case 429: return STATUS_DENIED;
    case 400:
    case 413:
    case 415:
    case 422: return STATUS_INVALID;
    case 408: return STATUS_TIMEOUT;
    case 409:
    case 410: return STATUS_FAILED;
    default: return STATUS_SERVER; /* 5xx, and whoever is no glintd */
    }
}

static const char *
string_of(const struct json *object, const char *name)
{
    const struct json *m = json_member(object, name);
    return m != NULL && m->type == JSON_STRING ? m->string : NULL;
}

/* A render that failed while it was waited for is told with a 5xx; it is the
 * job's end all the same, and no trouble of the server. */
static bool
is_render_failed(const struct json *problem)
{
    const char *type = string_of(problem, "type");
    const char *slug = type != NULL ? strrchr(type, '/') : NULL;
    return slug != NULL && strcmp(slug, "/render-failed") == 0;
}

static uint32_t
count_of(const struct json *object, const char *name)
{
    const struct json *m = json_member(object, name);
    bool whole = m != NULL && m->type == JSON_NUMBER && m->number >= 1 &&
                 m->number < 4e9;
    return whole ? (uint32_t)m->number : 0;
}

/* "`red` is already the name of /scene/materials/0" -> ".../materials/0": a
 * bare scene has no /scene. In place; the text is ours. */
static const char *
unwrap_pointers(const char *text, struct arena *arena)
{
    char *own = arena_strdup(arena, text);
    char *at = own != NULL ? strstr(own, "/scene/") : NULL;
    for (; at != NULL; at = strstr(at + 1, "/scene/")) {
        if (at == own || at[-1] == ' ' || at[-1] == '`')
            memmove(at, at + 6, strlen(at + 6) + 1);
    }
    return own != NULL ? own : text;
}

/* Undo the wrapping of document_write_job. */
static struct finding
finding_at_home(const struct json *item, bool warning,
                const struct document *document, unsigned lines_before,
                struct arena *arena)
{
    const char *code = string_of(item, "code");
    const char *detail = string_of(item, "detail");
    struct finding f = {
        .warning = warning,
        .code = code ? code : "unknown",
        .detail = detail ? detail : "the server gave no reason",
        .pointer = string_of(item, "pointer"),
        .hint = string_of(item, "hint"),
        .line = count_of(item, "line"),
        .column = count_of(item, "column"),
    };
    if (f.line > lines_before && f.column > 0)
        f.line -= lines_before;
    else
        f.line = f.column = 0;
    if (document == NULL || document->is_job)
        return f;
    f.detail = unwrap_pointers(f.detail, arena);
    if (f.pointer != NULL && strncmp(f.pointer, "/scene", 6) == 0 &&
        (f.pointer[6] == '\0' || f.pointer[6] == '/'))
        f.pointer += 6;
    return f;
}

static size_t
print_findings(const struct json *problem, const char *member, bool warning,
               const struct channel *to, const struct document *document,
               unsigned lines_before, struct arena *arena)
{
    const struct json *list = json_member(problem, member);
    size_t count = 0;
    if (list == NULL || list->type != JSON_ARRAY || document == NULL)
        return 0;
    for (const struct json *item = list->child; item; item = item->next) {
        struct finding f =
            finding_at_home(item, warning, document, lines_before, arena);
        document_print(document, to, &f);
        count++;
    }
    return count;
}

int
problem_print(const struct remote_reply *reply, const struct channel *to,
              const char *who, const struct document *document,
              unsigned lines_before)
{
    struct arena arena;
    arena_init(&arena, 0);
    struct error_list errors = {.arena = &arena};
    struct json_limits limits = {.max_bytes = PROBLEM_MAX};
    bool speaks = strcmp(reply->media_type, "application/problem+json") == 0;
    const struct json *problem =
        speaks ? json_read(reply->body.data ? reply->body.data : "",
                           reply->body.len, &limits, &arena, &errors)
               : NULL;

    if (problem == NULL) {
        say_error(to, who, "the server answered %ld and is perhaps no glintd",
                  reply->status);
    } else if (print_findings(problem, "errors", false, to, document,
                              lines_before, &arena) == 0) {
        const char *title = string_of(problem, "title");
        const char *detail = string_of(problem, "detail");
        say_error(to, who, "the server answered %ld: %s%s%s", reply->status,
                  title ? title : "no title", detail ? ": " : "",
                  detail ? detail : "");
    }
    int status = STATUS_SERVER;
    if (problem != NULL)
        status = is_render_failed(problem) ? STATUS_FAILED
                                           : problem_status(reply->status);
    arena_clear(&arena);
    return status;
}
