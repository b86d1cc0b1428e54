/* render.h - from a document to the bytes of a picture, here or on a server.
 *
 * Both ways print what goes wrong on `messages` themselves, so that they can
 * say it in their own words, and give the exit status. One thread. */
#ifndef CLI_RENDER_H
#define CLI_RENDER_H

#include <stdbool.h>
#include <stdint.h>

#include "cli/document.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "core/base/bytes.h"
#include "core/scene/output.h"

struct render_ask {
    const struct document *document;
    const struct output *output;
    const struct channel *messages;
    struct progress *progress;
    unsigned threads;    /* 0: one per core; render_local only */
    int64_t deadline_us; /* of clock_monotonic_us; 0: none */
    bool quiet;
    const char *server; /* render_remote only */
};

/* Through one worker process. The document has passed document_check.
 * STATUS_OK, _FAILED, _TIMEOUT or _INTERRUPTED. */
int
render_local(const struct render_ask *ask, struct bytes *picture);

/* Through a glintd: POST /v1/render, which answers with the picture at once or
 * with a job to wait for. The document is JSON; the server judges it. Any
 * status. */
int
render_remote(const struct render_ask *ask, struct bytes *picture);

#endif
