/* run.h - what a worker does with an ask: one function per kind.
 *
 * Each reads the passed memory files, does the work, and fills `answer` (body
 * and descriptors; kind DONE and ask number are set). False: `err` says why,
 * and FAILED is sent. The worker lives on either way. */
#ifndef SERVER_WORKER_RUN_H
#define SERVER_WORKER_RUN_H

#include <stdbool.h>

#include "core/base/error.h"
#include "server/worker/serve.h"
#include "server/worker/wire.h"

typedef bool (*run_fn)(struct turn *turn, const struct message *ask,
                       struct message *answer, struct error *err);

/* Scene and output -> encoded image. */
bool
run_render(struct turn *turn, const struct message *ask, struct message *answer,
           struct error *err);

#endif
