/* inside.h - what the files of this room share: the api itself, one call, and
 * what a call remembers while it is parked. All of it belongs to the HTTP loop
 * thread. */
#ifndef SERVER_API_INSIDE_H
#define SERVER_API_INSIDE_H

#include <stdatomic.h>

#include "core/base/isa.h"
#include "server/api/api.h"
#include "server/api/commit.h"
#include "server/api/events.h"
#include "server/api/prefer.h"
#include "server/api/problem.h"

struct api {
    struct api_options options;
    char host[256];
    char isa[ISA_SIZE];
    struct events *events;
    struct store *store;
    struct blobs *blobs;
    atomic_bool draining;
};

struct route;
struct call;

/* What a request waits for. */
enum stage {
    STAGE_NEW,    /* nothing: its first turn */
    STAGE_COMMIT, /* its write becomes durable */
    STAGE_CHANGE  /* the watched job changes */
};

/* request->state, from the first turn to finish. */
struct visit {
    enum stage stage;
    struct commit *commit; /* STAGE_COMMIT */
    uint64_t ticket;       /* of the request; http forgets it at its end */
    char job[ID_SIZE];     /* watched in events; "": none */
    int64_t deadline_us;   /* monotonic; the park ends here */
    int64_t wait_until_us; /* the render's deadline, once it is durable */
    bool cancel_when_gone; /* a client that leaves takes its job along */
    struct prefer prefer;
    double wait;       /* seconds, the default or as preferred */
    bool as_job;       /* a job object was asked for, not an image */
    uint32_t revision; /* the client has seen this one; 0: none */
    /* How problems are shown; NULL: problem+json. */
    void (*show_problem)(struct call *call, const struct problem *problem);
    const char *form_scene; /* the text in the form */
};

/* One turn. */
struct call {
    struct api *api;
    struct request *request;
    struct reply *reply;
    const struct route *route;
    const char *param; /* the part of the path at {...}; NULL: none */
    struct visit *visit;
    int64_t *park_ms;
};

/* --- endings of a turn (call.c); all but call_park return HTTP_REPLY --- */

/* Park until the watched job changes or the deadline comes. */
enum http_verdict
call_park(struct call *call);

/* Nobody will work on this job before the service ends: do not wait for it. */
bool
call_waits_in_vain(const struct call *call, const struct job *job);

/* Has the deadline come? */
bool
call_is_late(const struct call *call);

enum http_verdict
call_problem(struct call *call, enum problem_kind kind, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
enum http_verdict
call_show_problem(struct call *call, const struct problem *problem);

/* Takes the body over. A body whose memory ran out becomes a problem. */
enum http_verdict
call_body(struct call *call, unsigned status, const char *media_type,
          struct bytes *body);

/* The job as JSON with its ETag. */
enum http_verdict
call_job(struct call *call, unsigned status, const struct job *job);

/* The job object, with its place in the queue. */
void
call_write_job(struct call *call, struct json_writer *w, const char *key,
               const struct job *job);

/* Static bytes with a strong ETag, or 304. */
struct file;
enum http_verdict
call_file(struct call *call, const struct file *file, const char *media_type);

/* A store's error as a problem: not found, conflict, full, internal. */
enum http_verdict
call_store_problem(struct call *call, const struct error *err);

/* The list of what would have been acceptable: member "available". */
enum http_verdict
call_not_acceptable(struct call *call, const char *const *available,
                    size_t count, const char *detail);

/* --- steps of a turn --- */

/* Watch `job` for this request from now on. False: answered (no memory). */
bool
call_watch(struct call *call, const char *job);

/* Park until `commit` is done; `job` is watched already. */
enum http_verdict
call_await_commit(struct call *call, struct commit *commit);

/* Is the commit done? Then *job is as committed; or it failed and the call is
 * answered (*answered). False and not answered: park again. */
bool
call_committed(struct call *call, struct job *job, bool *answered);

#endif
