/* rays.h - batches: what travels between the stages of a tile (HOUSE 7).
 *
 * Structure of arrays, 64-byte aligned, at most BATCH_MAX entries. A stage
 * loops over lanes_up(count) entries: up to LANES - 1 entries past the end are
 * computed too, so that no loop needs a remainder. They hold whatever an
 * earlier batch left (zero at first), their indices are therefore always in
 * range, and nobody reads their results. */
#ifndef CORE_TRACE_RAYS_H
#define CORE_TRACE_RAYS_H

#include <stdint.h>

enum {
    TILE_SIZE = 32, /* pixels */
    BATCH_MAX = TILE_SIZE * TILE_SIZE,
    LANES = 16
};

#define OBJECT_NONE UINT32_MAX

/* One column of a batch. */
#define COLUMN(type, name)     _Alignas(64) type name[BATCH_MAX]
#define COLUMNS(type, name, n) _Alignas(64) type name[n][BATCH_MAX]

/* Before a loop over entries none of which reads what another one wrote: lets
 * the compiler turn indexed reads into vector gathers. */
#if defined(__clang__)
#define LANE_LOOP _Pragma("clang loop vectorize(assume_safety)")
#else
#define LANE_LOOP _Pragma("GCC ivdep")
#endif

static inline uint32_t
lanes_up(uint32_t count)
{
    return (count + (LANES - 1)) / LANES * LANES;
}

struct rays {
    uint32_t count;
    COLUMNS(float, o, 3); /* origin */
    COLUMNS(float, d, 3); /* direction; t is in units of its length */
    COLUMN(float, far);   /* accel_occluded: hits count below it; negative
                             afterwards: something is in the way */
};

struct hits {
    COLUMN(float, t);            /* +infinity: nothing */
    COLUMN(uint32_t, object);    /* OBJECT_NONE: nothing */
    COLUMN(uint32_t, primitive); /* triangle of a mesh, else 0 */
};

/* The hits of a batch without the misses, in the same order. */
struct surfaces {
    uint32_t count;
    COLUMN(float, t);
    COLUMNS(float, d, 3);  /* of the ray that came */
    COLUMNS(float, p, 3);  /* point */
    COLUMNS(float, n, 3);  /* shading normal, unit, as stored */
    COLUMNS(float, g, 3);  /* geometric normal, unit, as stored */
    COLUMNS(float, uv, 2); /* only if geometry.wants_uv */
    COLUMN(uint32_t, object);
    COLUMN(uint32_t, primitive);
    COLUMN(uint32_t, kind);  /* enum shape_kind */
    COLUMN(uint32_t, index); /* in its shape_set */
    COLUMN(uint32_t, material);
    /* Scratch of the shapes: surfaces_fetch. */
    COLUMN(int32_t, row);
    COLUMNS(float, field, 6);
};

/* field[c] = float first + c of each entry's record, c < count <= 6; entries of
 * other kinds get those of record 0, which every set has. (A step of its own:
 * in a loop that uses the value for one kind only, gcc 12 makes the reads
 * conditional and gives up on vectors.) */
static inline void
surfaces_fetch(struct surfaces *s, uint32_t kind, const float *restrict records,
               uint32_t stride, int32_t first, int32_t count)
{
    uint32_t n = lanes_up(s->count);
    for (uint32_t i = 0; i < n; i++)
        s->row[i] = (int32_t)(s->kind[i] == kind ? s->index[i] * stride : 0);
    for (int32_t c = 0; c < count; c++) {
        LANE_LOOP
        for (uint32_t i = 0; i < n; i++)
            s->field[c][i] = records[s->row[i] + first + c];
    }
}

#endif
