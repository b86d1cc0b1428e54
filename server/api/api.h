/* api.h - requests -> what Glint promises; the handler that http.c calls.
 *
 * routes.c is the table of everything it can do. All calls but api_on_change
 * come on the HTTP loop thread, and none blocks. */
#ifndef SERVER_API_API_H
#define SERVER_API_API_H

#include "core/scene/scene_json.h"
#include "server/blobs/blobs.h"
#include "server/http/http.h"
#include "server/pool/pool.h"
#include "server/store/store.h"

struct api;

struct api_options {
    const char *host; /* listening, for the Host rule */
    bool open;        /* not loopback only: the Host rule is off */
    uint64_t max_scene_bytes;
    struct scene_limits scene_limits;
    double max_render_seconds; /* an estimate over it is refused; 0: no limit */
    uint64_t max_render_bytes; /* the same */
    double default_wait, max_wait; /* seconds */
    uint32_t max_queued;
};

/* The store may be opened before the api exists: pass api_on_change with the
 * api as user. */
struct api *
api_new(const struct api_options *options, struct error *err);

/* Before http_start's first request. The pool is called until it is
 * connected again as NULL, or the store is closed. */
void
api_connect(struct api *api, struct store *store, struct blobs *blobs,
            struct pool *pool);
void
api_connect_http(struct api *api, struct http *http);

struct http_handler
api_handler(struct api *api);

/* store_change_fn: wakes whoever waits for that job, and the pool. */
void
api_on_change(void *api, const struct job *job, bool deleted);

/* New submissions get 503 draining, /readyz 503. */
void
api_drain(struct api *api);

void
api_free(struct api *api);

#endif
