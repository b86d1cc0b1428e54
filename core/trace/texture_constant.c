/* texture_constant.c - one colour. */
#include "core/trace/textures.h"

void
texture_constant(const struct scene_texture *texture, uint32_t n,
                 float p[3][BATCH_MAX], unsigned dimensions,
                 float out[3][BATCH_MAX])
{
    (void)p;
    (void)dimensions;
    for (int k = 0; k < 3; k++) {
        float color = (float)texture->color0[k];
        for (uint32_t j = 0; j < lanes_up(n); j++)
            out[k][j] = color;
    }
}
