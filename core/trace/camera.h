/* camera.h - pixels -> camera rays (SCENE 5). */
#ifndef CORE_TRACE_CAMERA_H
#define CORE_TRACE_CAMERA_H

#include "core/scene/scene.h"
#include "core/trace/kernel_names.h"
#include "core/trace/rays.h"

/* The image plane as floats: a point of it is corner + x right + y down, in
 * pixels from the top left. */
struct camera {
    enum camera_kind kind;
    float eye[3];
    float corner[3], right[3], down[3]; /* relative to the eye */
    float forward[3];                   /* -w, unit */
};

void
camera_prepare(const struct scene *scene, struct camera *camera);

/* One ray per entry, direction unit. x[n], y[n] in pixels, fraction included,
 * padded to lanes_up(n). Sets rays->count. */
void
camera_rays(const struct camera *camera, uint32_t n, const float *x,
            const float *y, struct rays *rays);

#endif
