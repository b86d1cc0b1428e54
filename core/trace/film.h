/* film.h - what the rays brought home: per pixel, linear, top row first.
 *
 * The caller of render_run owns it. Each pixel is written by exactly one
 * thread. Colours are unbounded radiance, already divided by the sample count;
 * layers not asked for are NULL. */
#ifndef CORE_TRACE_FILM_H
#define CORE_TRACE_FILM_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/error.h"
#include "core/scene/layer.h"

struct film {
    uint32_t width, height;     /* pixels */
    float *layers[LAYER_COUNT]; /* [height][width][channels], or NULL */
};

/* `mask` has bit (1 << layer) per layer wanted. ERROR_MEMORY. */
bool
film_init(struct film *film, uint32_t width, uint32_t height, unsigned mask,
          struct error *err);
void
film_clear(struct film *film);

#endif
