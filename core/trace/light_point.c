/* light_point.c - all light from one position. */
#include "core/scene/vec.h"
#include "core/trace/light_position.h"
#include "core/trace/lights.h"

const light_fn light_table[] = {
    [LIGHT_POINT] = light_point,
    [LIGHT_DIRECTIONAL] = light_directional,
    [LIGHT_AREA_GRID] = light_area_grid,
};

void
light_point(const struct scene_light *light, uint32_t k,
            const struct surfaces *surfaces, struct light_batch *out)
{
    (void)k;
    float q[3] = {(float)light->position[0], (float)light->position[1],
                  (float)light->position[2]};
    light_from(q, light->inverse_square, surfaces, out);
}
