/* light_area_grid.c - a square of positions around the light's own, along x and
 * z (SCENE 6.1). */
#include "core/trace/light_position.h"
#include "core/trace/lights.h"

void
light_area_grid(const struct scene_light *light, uint32_t k,
                const struct surfaces *surfaces, struct light_batch *out)
{
    float x, z, half = (float)light->half_size;
    scene_light_offset(light, k, &x, &z);
    float q[3] = {(float)light->position[0] + x * half,
                  (float)light->position[1],
                  (float)light->position[2] + z * half};
    light_from(q, light->inverse_square, surfaces, out);
}
