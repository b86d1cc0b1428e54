/* problem.h - what went wrong -> application/problem+json (RFC 9457).
 *
 * One table: slug, status, title. Every slug has a page in docs/problems, in
 * English and German, served at /problems/{slug}. Pure; any thread. */
#ifndef SERVER_API_PROBLEM_H
#define SERVER_API_PROBLEM_H

#include "core/base/error.h"
#include "core/base/json_write.h"
#include "core/scene/scene_lint.h"
#include "server/http/message.h"

#define PROBLEM_TABLE(X)                                                       \
    X(PROBLEM_REQUEST_MALFORMED, 400, "request-malformed",                     \
      "The request is malformed")                                              \
    X(PROBLEM_JSON_SYNTAX, 400, "json-syntax", "The body is not strict JSON")  \
    X(PROBLEM_ORIGIN_REJECTED, 403, "origin-rejected",                         \
      "This service answers its own machine only")                             \
    X(PROBLEM_NOT_FOUND, 404, "not-found", "There is no such thing")           \
    X(PROBLEM_LAYER_MISSING, 404, "layer-missing",                             \
      "The result has no such layer")                                          \
    X(PROBLEM_METHOD_NOT_ALLOWED, 405, "method-not-allowed",                   \
      "This path does not know the method")                                    \
    X(PROBLEM_NOT_ACCEPTABLE, 406, "not-acceptable",                           \
      "Nothing the client accepts exists")                                     \
    X(PROBLEM_CONFLICT_STATE, 409, "conflict-state",                           \
      "The job's state does not allow this")                                   \
    X(PROBLEM_RESULT_EXPIRED, 410, "result-expired",                           \
      "The result is no longer kept")                                          \
    X(PROBLEM_TOO_LARGE, 413, "too-large", "The body is too large")            \
    X(PROBLEM_UNSUPPORTED_MEDIA_TYPE, 415, "unsupported-media-type",           \
      "The body's media type is not supported")                                \
    X(PROBLEM_SCENE_INVALID, 422, "scene-invalid", "The scene is not valid")   \
    X(PROBLEM_JOB_INVALID, 422, "job-invalid", "The job is not valid")         \
    X(PROBLEM_BUDGET_EXCEEDED, 422, "budget-exceeded",                         \
      "The render is larger than this service allows")                         \
    X(PROBLEM_NEEDS_ASYNC, 422, "needs-async",                                 \
      "The render takes too long to wait for")                                 \
    X(PROBLEM_INTERNAL, 500, "internal", "The service made a mistake")         \
    X(PROBLEM_RENDER_FAILED, 500, "render-failed", "The render failed")        \
    X(PROBLEM_NOT_IMPLEMENTED, 501, "not-implemented",                         \
      "The service does not know how to do this")                              \
    X(PROBLEM_QUEUE_FULL, 503, "queue-full", "The queue is full")              \
    X(PROBLEM_SYNC_TIMEOUT, 503, "sync-timeout",                               \
      "The render is not done yet, it goes on")                                \
    X(PROBLEM_DRAINING, 503, "draining", "The service is shutting down")       \
    X(PROBLEM_STORAGE_FULL, 503, "storage-full", "The disk is nearly full")    \
    X(PROBLEM_NOT_READY, 503, "not-ready", "The service is not ready")

enum problem_kind {
#define X(kind, status, slug, title) kind,
    PROBLEM_TABLE(X)
#undef X
        PROBLEM_COUNT
};

/* Zero what is not known. Everything pointed to is the caller's and is read
 * only while problem_write or problem_reply runs. */
struct problem {
    enum problem_kind kind;
    const char *detail; /* one or more sentences for a reader */
    const struct error_list *errors;
    const struct lint_item *warnings;
    size_t warning_count;
    unsigned retry_after_s; /* 0: 2 s for every 503 */
    /* Writes further members into the problem's object; may be NULL. */
    void (*more)(struct json_writer *w, const void *user);
    const void *user;
};

const char *
problem_slug(enum problem_kind kind);
const char *
problem_title(enum problem_kind kind);
unsigned
problem_status(enum problem_kind kind);
/* PROBLEM_COUNT if there is no such slug. */
enum problem_kind
problem_find(const char *slug);

/* The body. */
void
problem_write(const struct problem *problem, const char *request_id,
              struct bytes *out);

/* Status, Content-Type, Retry-After for every 503, body. */
void
problem_reply(struct request *request, struct reply *reply,
              const struct problem *problem);

/* The arrays "errors" and "warnings" of a problem, also for validate. */
void
problem_write_errors(struct json_writer *w, const struct error_list *errors);
void
problem_write_warnings(struct json_writer *w, const struct lint_item *items,
                       size_t count);

/* {"line", "column", "offset", "excerpt"} of a place in `text`: offset in
 * bytes, excerpt two lines, the second with a caret. line and column are
 * 1-based, columns count characters; see excerpt.h. */
struct problem_place {
    const char *text;
    size_t len;
    uint32_t line, column;
};
void
problem_write_place(struct json_writer *w, const void *place);

#endif
