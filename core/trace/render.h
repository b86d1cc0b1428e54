/* render.h - scene -> film: the crew, progress, cancel.
 *
 * render_run builds the acceleration structure, lets a crew of threads take
 * tiles of 32 x 32 pixels from one atomic counter, and returns when the film is
 * whole. Pixels do not depend on the crew (HOUSE 7). The scene is only read. */
#ifndef CORE_TRACE_RENDER_H
#define CORE_TRACE_RENDER_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/error.h"
#include "core/base/isa.h"
#include "core/scene/scene.h"
#include "core/trace/film.h"

enum render_phase { RENDER_BUILDING, RENDER_TRACING };
enum render_verdict { RENDER_GO, RENDER_STOP };

enum ray_kind { RAYS_CAMERA, RAYS_SHADOW, RAYS_BOUNCE, RAY_KIND_COUNT };

struct render_progress {
    enum render_phase phase;
    uint32_t tiles_done, tiles_total;
    uint64_t rays; /* so far, all kinds */
};

/* Called by render_run's caller's own thread, about every interval_ms and once
 * at the end of each phase. RENDER_STOP ends the render: the crew drops its
 * tiles after the sample it holds, and render_run fails with ERROR_CANCELED;
 * the finished tiles are in the film. */
typedef enum render_verdict (*render_progress_fn)(
    void *user, const struct render_progress *progress);

/* Zero means the default in brackets. */
struct render_options {
    unsigned threads;               /* crew size [number of cores] */
    const atomic_uint *threads_now; /* crew members allowed to take the next
                                       tile, may change at any time [threads] */
    render_progress_fn on_progress; /* [none] */
    void *user;
    unsigned interval_ms; /* [50] */
    size_t memory_max;    /* bytes for geometry and, again, for what Embree
                           builds of it: past it ERROR_MEMORY [no limit] */
    enum isa_level isa;   /* a lower level than this CPU's [isa_level()] */
};

struct render_stats {
    double build_ms, trace_ms;
    uint64_t rays[RAY_KIND_COUNT];
};

/* `film` was made by film_init with the scene's size; its layers are filled. */
bool
render_run(const struct scene *scene, const struct render_options *options,
           struct film *film, struct render_stats *stats, struct error *err);

#endif
