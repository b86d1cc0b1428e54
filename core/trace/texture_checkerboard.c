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
    float a[3], b[3];
    for (int k = 0; k < 3; k++) {
        a[k] = (float)texture->color0[k];
        b[k] = (float)texture->color1[k];
    }
    for (uint32_t j = 0; j < padded; j++) {
        float x = math_floorf(p[0][j]), y = math_floorf(p[1][j]);
        float z = dimensions == 3 ? math_floorf(p[2][j]) : 0.0f;
        /* Parity of each before the sum: whole floats stay exact. */
        x -= 2.0f * math_floorf(0.5f * x);
        y -= 2.0f * math_floorf(0.5f * y);
        z -= 2.0f * math_floorf(0.5f * z);
        float sum = x + y + z;
        bool odd = (sum == 1.0f) | (sum == 3.0f);
        out[0][j] = odd ? b[0] : a[0];
        out[1][j] = odd ? b[1] : a[1];
        out[2][j] = odd ? b[2] : a[2];
    }
}
