/* lights.h - where light comes from, as seen from a batch of surfaces.
 *
 * One file and one row of the table per kind. A light has positions (one, but
 * for area grids); each fills, per surface, the unit direction to it, its
 * distance and the falloff. */
#ifndef CORE_TRACE_LIGHTS_H
#define CORE_TRACE_LIGHTS_H

#include <stdint.h>

#include "core/scene/scene.h"
#include "core/trace/kernel_names.h"
#include "core/trace/rays.h"

struct light_batch {
    COLUMNS(float, l, 3);    /* unit, from the surface to the light */
    COLUMN(float, distance); /* +infinity: directional */
    COLUMN(float, falloff);
};

/* Position `k` of the light as seen from all surfaces. */
typedef void (*light_fn)(const struct scene_light *light, uint32_t k,
                         const struct surfaces *surfaces,
                         struct light_batch *out);

void
light_point(const struct scene_light *light, uint32_t k,
            const struct surfaces *surfaces, struct light_batch *out);
void
light_directional(const struct scene_light *light, uint32_t k,
                  const struct surfaces *surfaces, struct light_batch *out);
void
light_area_grid(const struct scene_light *light, uint32_t k,
                const struct surfaces *surfaces, struct light_batch *out);

extern const light_fn light_table[];

#endif
