/* plan.h - a scene made ready for one level's stages: everything a tile reads.
 * Built once per render, then read-only. Dies before the scene. */
#ifndef CORE_TRACE_PLAN_H
#define CORE_TRACE_PLAN_H

#include "core/trace/accel.h"
#include "core/trace/camera.h"
#include "core/trace/lights.h"
#include "core/trace/materials.h"

struct plan {
    struct arena arena;
    const struct scene *scene;
    struct accel *accel;
    struct camera camera;
    struct materials materials;
    struct scene_light *lights; /* [light_count] an area grid is a point
                                     unless shadows are soft */
    uint32_t *light_positions;  /* [light_count] */
    uint32_t tiles_x, tiles_y;
};

/* ERROR_MEMORY, ERROR_CANCELED, ERROR_INTERNAL. */
struct plan *
plan_build(const struct scene *scene, const struct accel_options *options,
           struct error *err);
void
plan_free(struct plan *plan);

#endif
