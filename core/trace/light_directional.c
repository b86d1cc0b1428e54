/* light_directional.c - parallel light from infinitely far away. */
#include "core/trace/lights.h"

void
light_directional(const struct scene_light *light, uint32_t k,
                  const struct surfaces *surfaces, struct light_batch *out)
{
    (void)k;
    uint32_t n = lanes_up(surfaces->count);
    float l[3] = {(float)light->to_light[0], (float)light->to_light[1],
                  (float)light->to_light[2]};
    for (uint32_t i = 0; i < n; i++) {
        out->l[0][i] = l[0];
        out->l[1][i] = l[1];
        out->l[2][i] = l[2];
        out->distance[i] = __builtin_inff();
        out->falloff[i] = 1.0f;
    }
}
