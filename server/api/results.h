/* results.h - the image of a job as an answer. */
#ifndef SERVER_API_RESULTS_H
#define SERVER_API_RESULTS_H

#include "server/api/inside.h"

/* Strong entity tag of what a render key names, in `arena`. */
const char *
result_etag(const char *render_key, struct arena *arena);

/* Open the result; -1 if it is no longer there (answered 410, or 500) unless
 * `quiet`. */
int
result_open(struct call *call, const struct job *job, uint64_t *len,
            bool quiet);

/* 200 with the image in `fd` (taken over), or 304; `cache` is the value of
 * Glint-Cache or NULL. */
enum http_verdict
result_send(struct call *call, const struct job *job, int fd, uint64_t len,
            const char *cache);

/* A job that will never have a result, or has none yet: 409 conflict-state. */
enum http_verdict
result_refuse(struct call *call, const struct job *job, enum problem_kind kind);

#endif
