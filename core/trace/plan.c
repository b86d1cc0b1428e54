#include "core/trace/plan.h"

#include <stdlib.h>

static bool
lights_build(const struct scene *scene, struct plan *plan, struct error *err)
{
    size_t count = scene->light_count;
    plan->lights = arena_array(&plan->arena, count, sizeof *plan->lights);
    plan->light_positions = arena_array(&plan->arena, count, sizeof(uint32_t));
    if (plan->lights == NULL || plan->light_positions == NULL)
        return error_set(err, ERROR_MEMORY, "no memory for %u lights",
                         (unsigned)count);
    for (size_t i = 0; i < count; i++) {
        plan->lights[i] = scene->lights[i];
        if (plan->lights[i].kind == LIGHT_AREA_GRID &&
            scene->integrator.shadows != SHADOWS_SOFT)
            plan->lights[i].kind = LIGHT_POINT;
        plan->light_positions[i] = scene_light_positions(&plan->lights[i]);
    }
    return true;
}

struct plan *
plan_build(const struct scene *scene, const struct accel_options *options,
           struct error *err)
{
    struct plan *plan = calloc(1, sizeof *plan);
    if (plan == NULL) {
        error_set(err, ERROR_MEMORY, "no memory for a plan");
        return NULL;
    }
    plan->scene = scene;
    plan->tiles_x = (scene->width + TILE_SIZE - 1) / TILE_SIZE;
    plan->tiles_y = (scene->height + TILE_SIZE - 1) / TILE_SIZE;
    camera_prepare(scene, &plan->camera);
    if (!lights_build(scene, plan, err) ||
        !materials_build(scene, &plan->arena, &plan->materials, err))
        goto fail;
    plan->accel = accel_build(scene, options, err);
    if (plan->accel == NULL)
        goto fail;
    return plan;
fail:
    plan_free(plan);
    return NULL;
}

void
plan_free(struct plan *plan)
{
    if (plan == NULL)
        return;
    accel_free(plan->accel);
    arena_clear(&plan->arena);
    free(plan);
}
