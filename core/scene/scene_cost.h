/* scene_cost.h - what a render will cost, told before it is accepted.
 * Formulas: API section 7. */
#ifndef CORE_SCENE_SCENE_COST_H
#define CORE_SCENE_SCENE_COST_H

#include "core/scene/output.h"
#include "core/scene/scene.h"

struct scene_cost {
    double rays;
    double seconds;      /* at rays_per_second */
    double memory_bytes; /* film, layers, meshes; beyond a worker's base */
};

/* rays_per_second <= 0 means the built-in start value. */
struct scene_cost
scene_cost(const struct scene *scene, const struct output *output,
           double rays_per_second);

#endif
