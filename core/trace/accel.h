/* accel.h - rays against the scene.
 *
 * Callers hand over whole batches with a kind; the accel decides how they are
 * traced: plane by plane over the batch, then primitive by primitive in a
 * scene of a handful of shapes (accel_small.c), else through Embree in packets
 * whose width a table picks by kind. No way of tracing shows in the result: the
 * nearest hit is the same, and between equal distances the object with the
 * lower index wins, in a mesh the triangle with the lower index.
 *
 * An accel is read-only once built: any number of threads may ask it. It refers
 * to the scene's meshes, so it goes before the scene. */
#ifndef CORE_TRACE_ACCEL_H
#define CORE_TRACE_ACCEL_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/error.h"
#include "core/scene/scene.h"
#include "core/trace/kernel_names.h"
#include "core/trace/rays.h"
#include "core/trace/render.h"
#include "core/trace/shapes.h"

struct accel;

enum accel_way { ACCEL_AUTO, ACCEL_EMBREE, ACCEL_SMALL };

/* Zero means the default in brackets. */
struct accel_options {
    unsigned threads;   /* that a build may use [1] */
    size_t memory_max;  /* bytes [no limit] */
    uint64_t rays;      /* expected: few rays make a quick build [many] */
    enum accel_way way; /* [by scene]; SMALL is ignored if there is a mesh */
    unsigned width;     /* 1, 4, 8, 16: of every packet [the table] */
    /* Asked while building, from any thread; false stops it: ERROR_CANCELED. */
    bool (*go_on)(void *user);
    void *user;
};

/* ERROR_MEMORY, ERROR_CANCELED, ERROR_INTERNAL (Embree's own sentence). */
struct accel *
accel_build(const struct scene *scene, const struct accel_options *options,
            struct error *err);
void
accel_free(struct accel *accel);

const struct geometry *
accel_geometry(const struct accel *accel);

/* Nearest hits of all rays; rays->far is not read. A ray that is not finite
 * (or beyond 1e18) hits nothing. */
void
accel_intersect(const struct accel *accel, enum ray_kind kind,
                const struct rays *rays, struct hits *hits);

/* Is anything that casts shadows nearer than far? Such rays get a negative
 * far; a ray that is not finite is not blocked. */
void
accel_occluded(const struct accel *accel, struct rays *rays);

/* accel_small.c: every primitive of `kinds` (a mask of 1 << enum shape_kind)
 * with a bit of `visible`, against count lanes from `first` on. */
void
accel_small_nearest(const struct geometry *geometry, uint32_t kinds,
                    unsigned visible, const struct rays *rays,
                    struct hits *hits);
void
accel_small_any(const struct geometry *geometry, uint32_t kinds,
                unsigned visible, struct rays *rays);

#endif
