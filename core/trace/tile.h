/* tile.h - the stages of one tile, and the scratch of one crew member. */
#ifndef CORE_TRACE_TILE_H
#define CORE_TRACE_TILE_H

#include <stdatomic.h>

#include "core/trace/film.h"
#include "core/trace/plan.h"

/* Everything a crew member writes besides the film. Zeroed once, 64-byte
 * aligned, of a fixed size: nothing is allocated inside a tile. */
struct tile {
    /* The pixels of the tile in Morton order. A slot is a place in it. */
    uint32_t count;
    COLUMN(uint32_t, x);
    COLUMN(uint32_t, y);
    COLUMN(uint32_t, pixel);  /* y * width + x */
    COLUMN(uint32_t, morton); /* x | y << 16 inside a tile, filled once */
    bool ready;

    /* Sums over the samples so far, per slot. */
    COLUMNS(float, sum, 3);
    COLUMNS(float, albedo, 3);

    /* The sample under way, per slot. */
    COLUMNS(float, color, 3);
    COLUMN(float, weight_sum); /* course: H */

    /* The batch under way, per ray. */
    struct rays rays;
    COLUMN(uint32_t, slot);
    COLUMNS(float, weight, 3); /* recursive: product of mirrors so far */
    struct hits hits;
    struct surfaces surfaces;
    COLUMN(uint32_t, live);
    COLUMN(uint32_t, keep);
    COLUMN(uint32_t, list);
    COLUMN(uint32_t, flag);
    struct paints paints;

    /* Lights of the batch, per surface. */
    struct light_batch light;
    struct rays shadow;
    COLUMNS(float, base, 3); /* A */
    COLUMNS(float, term, 3); /* of one light sample, if nothing is between */
    COLUMNS(float, light_sum, 3);
    COLUMNS(float, local, 3); /* the surface's own light */
    COLUMN(float, scratch);
    COLUMN(float, sample_x);
    COLUMN(float, sample_y);

    uint64_t rays_traced[RAY_KIND_COUNT];
    const atomic_bool *stop; /* set: give up between two samples */
};

/* Traces tile `index` into the film; adds to tile->rays_traced. False: stopped,
 * the film's beauty and albedo are untouched. */
bool
tile_run(const struct plan *plan, uint32_t index, struct tile *tile,
         struct film *film);

/* whitted.c: shades the camera rays in tile->rays (slot i = ray i) and leaves
 * the sample's radiance in tile->color. With `first`, the film's data layers
 * of the pixels are written. */
void
whitted_shade(const struct plan *plan, struct tile *tile, bool first,
              struct film *film);

#endif
