/* order.h - the body of a submission -> a checked scene and the job to be.
 *
 * Shared by render, jobs and validate. An order owns an arena with the
 * document's tree and the scene; it lives for one turn. */
#ifndef SERVER_API_ORDER_H
#define SERVER_API_ORDER_H

#include "core/scene/scene_cost.h"
#include "server/api/inside.h"
#include "server/api/job_json.h"

struct order {
    struct arena arena;
    struct error_list errors; /* in document order */
    const char *text;
    size_t len;
    uint64_t max_pixels; /* 0: SCENE section 8's */
    const struct json *root;
    struct job_document document;
    struct scene scene;
    struct scene_cost cost;
    struct bytes canonical;
    struct job job;
};

/* Is the Content-Type one that may carry JSON? Else the call is answered. */
bool
order_media_type(struct call *call);

/* Read and check everything. False: order->errors say why. order_clear is due
 * in either case. */
bool
order_read(struct call *call, const char *text, size_t len,
           struct order *order);

/* Answer with what order_read found. */
enum http_verdict
order_refuse(struct call *call, struct order *order);

/* What it would cost, at the speed learned from finished jobs. */
void
order_price(struct call *call, struct order *order);

/* Canonical text, hashes, settings: order->job is ready for the store. False:
 * answered (over the budget, no memory). */
bool
order_complete(struct call *call, struct order *order);

/* Does the service take new jobs? Else the call is answered 503. */
bool
order_welcome(struct call *call);

/* Hand the job to the store; the call watches it and parks until it is durable,
 * or is answered. */
enum http_verdict
order_submit(struct call *call, struct order *order);

void
order_clear(struct order *order);

/* Whole seconds until it is worth asking again. */
unsigned
order_retry_after(double estimate_seconds);

/* Is the disk so full that no job is taken: below max(256 MiB, 5 %)? */
bool
order_storage_full(struct api *api, uint64_t *free_bytes, uint64_t *need);

#endif
