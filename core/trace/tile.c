#include "core/trace/tile.h"

#include <string.h>

#include "core/trace/sampler.h"

/* Even bits of x, packed. */
static uint32_t
even_bits(uint32_t x)
{
    x &= 0x55555555u;
    x = (x | x >> 1) & 0x33333333u;
    x = (x | x >> 2) & 0x0f0f0f0fu;
    x = (x | x >> 4) & 0x00ff00ffu;
    return (x | x >> 8) & 0x0000ffffu;
}

static void
tile_pixels(const struct plan *plan, uint32_t index, struct tile *t)
{
    uint32_t left = index % plan->tiles_x * TILE_SIZE;
    uint32_t top = index / plan->tiles_x * TILE_SIZE;
    uint32_t width = plan->scene->width, height = plan->scene->height;
    if (!t->ready)
        for (uint32_t i = 0; i < BATCH_MAX; i++)
            t->morton[i] = even_bits(i) | even_bits(i >> 1) << 16;
    t->ready = true;
    t->count = 0;
    for (uint32_t i = 0; i < BATCH_MAX; i++) {
        uint32_t x = left + (t->morton[i] & 0xffffu);
        uint32_t y = top + (t->morton[i] >> 16);
        t->x[t->count] = x;
        t->y[t->count] = y;
        t->pixel[t->count] = y * width + x;
        t->count += x < width && y < height ? 1 : 0;
    }
}

/* Misses, until a hit says otherwise. */
static void
film_start(const struct tile *t, struct film *film)
{
    float *depth = film->layers[LAYER_DEPTH];
    float *normal = film->layers[LAYER_NORMAL];
    float *id = film->layers[LAYER_OBJECT_ID];
    for (uint32_t i = 0; i < t->count; i++) {
        size_t p = t->pixel[i];
        if (depth != NULL)
            depth[p] = __builtin_inff();
        if (normal != NULL)
            normal[3 * p] = normal[3 * p + 1] = normal[3 * p + 2] = 0.0f;
        if (id != NULL)
            id[p] = 0.0f;
    }
}

static void
film_add(const struct tile *t, float spp, struct film *film)
{
    float *beauty = film->layers[LAYER_BEAUTY];
    float *albedo = film->layers[LAYER_ALBEDO];
    for (uint32_t i = 0; i < t->count; i++) {
        size_t p = 3 * (size_t)t->pixel[i];
        for (size_t k = 0; k < 3; k++) {
            if (beauty != NULL)
                beauty[p + k] = t->sum[k][i] / spp;
            if (albedo != NULL)
                albedo[p + k] = t->albedo[k][i] / spp;
        }
    }
}

bool
tile_run(const struct plan *plan, uint32_t index, struct tile *t,
         struct film *film)
{
    const struct scene *scene = plan->scene;
    tile_pixels(plan, index, t);
    uint32_t padded = lanes_up(t->count);
    film_start(t, film);
    memset(t->sum, 0, sizeof t->sum);
    memset(t->albedo, 0, sizeof t->albedo);
    for (uint32_t sample = 0; sample < scene->sampler.spp; sample++) {
        if (t->stop != NULL && atomic_load(t->stop))
            return false;
        sampler_fill(&scene->sampler, padded, t->pixel, sample, 0, t->sample_x,
                     t->sample_y);
        for (uint32_t i = 0; i < padded; i++) {
            t->sample_x[i] += (float)t->x[i];
            t->sample_y[i] += (float)t->y[i];
            t->slot[i] = i;
        }
        camera_rays(&plan->camera, t->count, t->sample_x, t->sample_y,
                    &t->rays);
        whitted_shade(plan, t, sample == 0, film);
        for (int k = 0; k < 3; k++)
            for (uint32_t i = 0; i < padded; i++)
                t->sum[k][i] += t->color[k][i];
    }
    film_add(t, (float)scene->sampler.spp, film);
    return true;
}
