/* shape_lanes.h - include many times: from a body for one lane to a shape's
 * `nearest` and `any`.
 *
 * Include it after defining
 *   SHAPE          prefix of the body: SHAPE(hit)
 *   SHAPE_FLOATS   floats of the record that the body reads
 *   SHAPE_INVERTS  1 if the body reads 1 / d
 * with the body
 *   static inline bool
 *   SHAPE(hit)(const float *record, const struct shape_rules *rules,
 *              float ox, float oy, float oz, float dx, float dy, float dz,
 *              float ix, float iy, float iz, float *t);
 * which returns whether there is a hit at *t > 0. It must have no branches
 * that depend on the lane, so that each loop below becomes vector code; the
 * loops exist for 1, 4, 8, 16 and any number of lanes and, as nothing is
 * contracted or reordered, give the same bits. */
#include <string.h>

#include "core/trace/shapes.h"

struct lane_input {
    const float *ox, *oy, *oz, *dx, *dy, *dz, *ix, *iy, *iz;
};

static inline __attribute__((always_inline)) void
lanes_nearest(const float *source, const struct shape_rules *rules,
              uint32_t object, const struct lane_input *in,
              float *restrict best, uint32_t *restrict best_object,
              const int *restrict valid, uint32_t n)
{
    const float *restrict ox = in->ox, *restrict oy = in->oy,
                          *restrict oz = in->oz, *restrict dx = in->dx,
                          *restrict dy = in->dy, *restrict dz = in->dz,
                          *restrict ix = in->ix, *restrict iy = in->iy,
                          *restrict iz = in->iz;
    float record[SHAPE_FLOATS];
    struct shape_rules local = *rules;
    memcpy(record, source, sizeof record);
    for (uint32_t i = 0; i < n; i++) {
        float t;
        bool hit = SHAPE(hit)(record, &local, ox[i], oy[i], oz[i], dx[i], dy[i],
                              dz[i], ix[i], iy[i], iz[i], &t);
        float b = best[i];
        uint32_t o = best_object[i];
        bool nearer = hit & ((t < b) | ((t == b) & (object < o)));
        if (valid != NULL)
            nearer = nearer & (valid[i] != 0);
        best[i] = nearer ? t : b;
        best_object[i] = nearer ? object : o;
    }
}

static inline __attribute__((always_inline)) void
lanes_any(const float *source, const struct shape_rules *rules,
          const struct lane_input *in, float *restrict limit,
          const int *restrict valid, uint32_t n)
{
    const float *restrict ox = in->ox, *restrict oy = in->oy,
                          *restrict oz = in->oz, *restrict dx = in->dx,
                          *restrict dy = in->dy, *restrict dz = in->dz,
                          *restrict ix = in->ix, *restrict iy = in->iy,
                          *restrict iz = in->iz;
    float record[SHAPE_FLOATS];
    struct shape_rules local = *rules;
    memcpy(record, source, sizeof record);
    for (uint32_t i = 0; i < n; i++) {
        float t;
        bool hit = SHAPE(hit)(record, &local, ox[i], oy[i], oz[i], dx[i], dy[i],
                              dz[i], ix[i], iy[i], iz[i], &t);
        float b = limit[i];
        bool blocked = hit & (t < b);
        if (valid != NULL)
            blocked = blocked & (valid[i] != 0);
        limit[i] = blocked ? -__builtin_inff() : b;
    }
}

/* The rays of `lanes` in the object space of one primitive. */
struct lane_scratch {
    _Alignas(64) float column[9][STRIP_MAX];
};

static void
lanes_transform(const float *m, const struct lanes *lanes, uint32_t n,
                struct lane_scratch *to, struct lane_input *in)
{
    const float *restrict ox = lanes->o[0], *restrict oy = lanes->o[1],
                          *restrict oz = lanes->o[2],
                          *restrict dx = lanes->d[0],
                          *restrict dy = lanes->d[1],
                          *restrict dz = lanes->d[2];
    for (int r = 0; r < 3; r++) {
        float a = m[4 * r], b = m[4 * r + 1], c = m[4 * r + 2],
              e = m[4 * r + 3];
        float *restrict o = to->column[r], *restrict d = to->column[3 + r],
                        *restrict inverse = to->column[6 + r];
        for (uint32_t i = 0; i < n; i++) {
            o[i] = a * ox[i] + b * oy[i] + c * oz[i] + e;
            d[i] = a * dx[i] + b * dy[i] + c * dz[i];
            inverse[i] = lane_invert(d[i]);
        }
    }
    *in = (struct lane_input){to->column[0], to->column[1], to->column[2],
                              to->column[3], to->column[4], to->column[5],
                              to->column[6], to->column[7], to->column[8]};
}

/* Inverse directions if the body wants them and the caller has none. */
static inline void
lanes_prepare(const struct lanes *lanes, uint32_t n, struct lane_scratch *to,
              struct lane_input *in)
{
    *in =
        (struct lane_input){lanes->o[0],     lanes->o[1],     lanes->o[2],
                            lanes->d[0],     lanes->d[1],     lanes->d[2],
                            lanes->inv_d[0], lanes->inv_d[1], lanes->inv_d[2]};
#if SHAPE_INVERTS
    if (lanes->inv_d[0] != NULL)
        return;
    for (int r = 0; r < 3; r++) {
        const float *restrict d = lanes->d[r];
        float *restrict inverse = to->column[6 + r];
        for (uint32_t i = 0; i < n; i++)
            inverse[i] = lane_invert(d[i]);
    }
    in->ix = to->column[6];
    in->iy = to->column[7];
    in->iz = to->column[8];
#else
    (void)n;
    (void)to;
    in->ix = in->dx; /* never read; must be a column */
    in->iy = in->dy;
    in->iz = in->dz;
#endif
}

static void
SHAPE(nearest)(const struct shape_set *set, uint32_t first, uint32_t count,
               const struct lanes *lanes, uint32_t n)
{
    struct lane_scratch prepared, turned;
    struct lane_input plain, own;
    lanes_prepare(lanes, n, &prepared, &plain);
    for (uint32_t k = first; k < first + count; k++) {
        const float *record = set->records + (size_t)k * set->stride;
        const struct lane_input *in = &plain;
        if (set->transformed[k] != 0) {
            lanes_transform(set->inverse + 12 * (size_t)k, lanes, n, &turned,
                            &own);
            in = &own;
        }
        uint32_t object = set->object[k];
        float *t = lanes->t;
        uint32_t *best = lanes->object;
        if (lanes->valid == NULL)
            lanes_nearest(record, &set->rules, object, in, t, best, NULL,
                          lanes_up(n));
        else if (n == 16)
            lanes_nearest(record, &set->rules, object, in, t, best,
                          lanes->valid, 16);
        else if (n == 8)
            lanes_nearest(record, &set->rules, object, in, t, best,
                          lanes->valid, 8);
        else if (n == 4)
            lanes_nearest(record, &set->rules, object, in, t, best,
                          lanes->valid, 4);
        else
            for (uint32_t i = 0; i < n; i++) {
                struct lane_input one = {in->ox + i, in->oy + i, in->oz + i,
                                         in->dx + i, in->dy + i, in->dz + i,
                                         in->ix + i, in->iy + i, in->iz + i};
                lanes_nearest(record, &set->rules, object, &one, t + i,
                              best + i, lanes->valid + i, 1);
            }
    }
}

static void
SHAPE(any)(const struct shape_set *set, uint32_t first, uint32_t count,
           const struct lanes *lanes, uint32_t n)
{
    struct lane_scratch prepared, turned;
    struct lane_input plain, own;
    lanes_prepare(lanes, n, &prepared, &plain);
    for (uint32_t k = first; k < first + count; k++) {
        const float *record = set->records + (size_t)k * set->stride;
        const struct lane_input *in = &plain;
        if (set->transformed[k] != 0) {
            lanes_transform(set->inverse + 12 * (size_t)k, lanes, n, &turned,
                            &own);
            in = &own;
        }
        float *t = lanes->t;
        if (lanes->valid == NULL)
            lanes_any(record, &set->rules, in, t, NULL, lanes_up(n));
        else if (n == 16)
            lanes_any(record, &set->rules, in, t, lanes->valid, 16);
        else if (n == 8)
            lanes_any(record, &set->rules, in, t, lanes->valid, 8);
        else if (n == 4)
            lanes_any(record, &set->rules, in, t, lanes->valid, 4);
        else
            for (uint32_t i = 0; i < n; i++) {
                struct lane_input one = {in->ox + i, in->oy + i, in->oz + i,
                                         in->dx + i, in->dy + i, in->dz + i,
                                         in->ix + i, in->iy + i, in->iz + i};
                lanes_any(record, &set->rules, &one, t + i, lanes->valid + i,
                          1);
            }
    }
}
