/* light_position.h - a batch looking at one position. */
#ifndef CORE_TRACE_LIGHT_POSITION_H
#define CORE_TRACE_LIGHT_POSITION_H

#include <stdbool.h>

#include "core/scene/vec.h"
#include "core/trace/lights.h"

static inline void
light_from(const float position[3], bool inverse_square,
           const struct surfaces *restrict s, struct light_batch *restrict out)
{
    float qx = position[0], qy = position[1], qz = position[2];
    uint32_t n = lanes_up(s->count);
    for (uint32_t i = 0; i < n; i++) {
        float x = qx - s->p[0][i], y = qy - s->p[1][i], z = qz - s->p[2][i];
        float squared = dot3(x, y, z, x, y, z);
        float distance = __builtin_sqrtf(squared);
        float inv = 1.0f / (distance > 0.0f ? distance : 1.0f);
        out->l[0][i] = x * inv;
        out->l[1][i] = y * inv;
        out->l[2][i] = z * inv;
        out->distance[i] = distance;
        out->falloff[i] = inverse_square ? inv * inv : 1.0f;
    }
}

#endif
