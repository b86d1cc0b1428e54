/* accel_small.c - every primitive against whole batches, without a BVH: what a
 * handful of shapes is quickest with, and how unbounded shapes are tested in
 * any scene. Strips keep a batch's columns in the first-level cache. */
#include "core/trace/accel.h"

struct strip {
    _Alignas(64) float inv_d[3][STRIP_MAX];
};

static void
strip_lanes(const struct rays *rays, uint32_t first, uint32_t n, bool inverted,
            struct strip *strip, struct lanes *lanes)
{
    for (int k = 0; k < 3; k++) {
        lanes->o[k] = rays->o[k] + first;
        lanes->d[k] = rays->d[k] + first;
        lanes->inv_d[k] = NULL;
    }
    lanes->valid = NULL;
    if (!inverted)
        return;
    for (int k = 0; k < 3; k++) {
        const float *restrict d = lanes->d[k];
        float *restrict inverse = strip->inv_d[k];
        for (uint32_t i = 0; i < lanes_up(n); i++)
            inverse[i] = lane_invert(d[i]);
        lanes->inv_d[k] = inverse;
    }
}

/* Calls fn for runs of primitives that are visible. */
static void
set_run(const struct shape_set *set, unsigned visible,
        void (*fn)(const struct shape_set *, uint32_t, uint32_t,
                   const struct lanes *, uint32_t),
        const struct lanes *lanes, uint32_t n)
{
    for (uint32_t k = 0; k < set->count;) {
        uint32_t end = k;
        while (end < set->count && (set->visible[end] & visible) != 0)
            end++;
        if (end > k)
            fn(set, k, end - k, lanes, n);
        k = end + 1;
    }
}

void
accel_small_nearest(const struct geometry *geometry, uint32_t kinds,
                    unsigned visible, const struct rays *rays,
                    struct hits *hits)
{
    struct strip strip;
    struct lanes lanes;
    bool inverted =
        (kinds >> SHAPE_BOX & 1) != 0 && geometry->sets[SHAPE_BOX].count > 0;
    for (uint32_t first = 0; first < rays->count; first += STRIP_MAX) {
        uint32_t n = rays->count - first;
        n = n < STRIP_MAX ? n : STRIP_MAX;
        strip_lanes(rays, first, n, inverted, &strip, &lanes);
        lanes.t = hits->t + first;
        lanes.object = hits->object + first;
        for (uint32_t kind = 0; kind < SHAPE_KIND_COUNT; kind++)
            if ((kinds >> kind & 1) != 0 && geometry->sets[kind].count > 0)
                set_run(&geometry->sets[kind], visible,
                        shape_table[kind]->nearest, &lanes, n);
    }
}

void
accel_small_any(const struct geometry *geometry, uint32_t kinds,
                unsigned visible, struct rays *rays)
{
    struct strip strip;
    struct lanes lanes;
    bool inverted =
        (kinds >> SHAPE_BOX & 1) != 0 && geometry->sets[SHAPE_BOX].count > 0;
    for (uint32_t first = 0; first < rays->count; first += STRIP_MAX) {
        uint32_t n = rays->count - first;
        n = n < STRIP_MAX ? n : STRIP_MAX;
        strip_lanes(rays, first, n, inverted, &strip, &lanes);
        lanes.t = rays->far + first;
        lanes.object = NULL;
        for (uint32_t kind = 0; kind < SHAPE_KIND_COUNT; kind++)
            if ((kinds >> kind & 1) != 0 && geometry->sets[kind].count > 0)
                set_run(&geometry->sets[kind], visible, shape_table[kind]->any,
                        &lanes, n);
    }
}
