#include "core/scene/scene.h"

#include "core/base/must.h"

/* The lecture's loop, `for (x = -1; x <= 1; x += 2 / (N - 1))` in single
 * precision: how often it runs, and the k-th value. For N = 1 the step is
 * infinite: one value, -1. A float is stored after every step, so no register
 * keeps more digits. */
static uint32_t
float32_loop(uint32_t samples, uint32_t k, float *value)
{
    *value = -1.0f;
    if (samples == 1)
        return 1;
    volatile float x = -1.0f;
    volatile float step = 2.0f / (float)(samples - 1);
    uint32_t count = 0;
    while (x <= 1.0f) {
        if (count == k)
            *value = x;
        count++;
        x = x + step;
    }
    return count;
}

static uint32_t
per_axis(const struct scene_light *light)
{
    float value;
    if (light->kind != LIGHT_AREA_GRID)
        return 1;
    return light->loop_float32 ? float32_loop(light->samples, 0, &value)
                               : light->samples;
}

uint32_t
scene_light_positions(const struct scene_light *light)
{
    uint32_t count = per_axis(light);
    return count * count;
}

/* Position i of one axis, -1 ... 1. */
static float
axis_value(const struct scene_light *light, uint32_t i)
{
    float value;
    if (light->kind != LIGHT_AREA_GRID)
        return 0;
    if (light->loop_float32) {
        float32_loop(light->samples, i, &value);
        return value;
    }
    if (light->samples == 1)
        return 0;
    return (float)(-1.0 + 2.0 * i / (light->samples - 1.0));
}

void
scene_light_offset(const struct scene_light *light, uint32_t k, float *x,
                   float *z)
{
    uint32_t count = per_axis(light);
    MUST(count > 0);
    *x = axis_value(light, k / count);
    *z = axis_value(light, k % count);
}
