/* texture_checkerboard.c - b = (sum of floor p'_i) mod 2, never negative:
 * 0 color0, 1 color1. */
#include "core/base/math.h"
#include "core/trace/textures.h"

void
texture_checker(const struct scene_texture *texture, uint32_t n,
                float p[restrict 3][BATCH_MAX], unsigned dimensions,
                float out[restrict 3][BATCH_MAX])
{
    uint32_t padded = lanes_up(n);
    float a0 = (float)texture->color0[0], b0 = (float)texture->color1[0];
    float a1 = (float)texture->color0[1], b1 = (float)texture->color1[1];
    float a2 = (float)texture->color0[2], b2 = (float)texture->color1[2];
    const float *restrict px = p[0], *restrict py = p[1];
    /* Of two coordinates the second stands for the third, and is not counted. */
    const float *restrict pz = dimensions == 3 ? p[2] : p[1];
    float count_z = dimensions == 3 ? 1.0f : 0.0f;
    float *restrict r = out[0], *restrict g = out[1], *restrict b = out[2];
    for (uint32_t j = 0; j < padded; j++) {
        float x = math_floorf(px[j]), y = math_floorf(py[j]);
        float z = math_floorf(pz[j]);
        /* Parity of each before the sum: whole floats stay exact. */
        x -= 2.0f * math_floorf(0.5f * x);
        y -= 2.0f * math_floorf(0.5f * y);
        z -= 2.0f * math_floorf(0.5f * z);
        float sum = x + y + count_z * z;
        float odd = sum - 2.0f * math_floorf(0.5f * sum);
        r[j] = odd > 0.5f ? b0 : a0;
        g[j] = odd > 0.5f ? b1 : a1;
        b[j] = odd > 0.5f ? b2 : a2;
    }
}
