/* cramer.h - o + t d = p + u e1 + v e2 by Cramer's rule (SCENE 6.4).
 *
 * One body for triangles, quads and the triangles of meshes. With A = -d,
 * B = e1, C = e2, D = o - p: D0 = det(A, B, C), t = det(D, B, C) / D0,
 * u = det(A, D, C) / D0, v = det(A, B, D) / D0. */
#ifndef CORE_TRACE_CRAMER_H
#define CORE_TRACE_CRAMER_H

#include "core/scene/vec.h"

/* Record: p, e1, e2, e1 x e2, 1e-12 |e1||e2|. */
enum { CRAMER_FLOATS = 13 };

struct cramer {
    float d0, t, u, v;
};

static inline struct cramer
cramer_solve(const float *r, float ox, float oy, float oz, float dx, float dy,
             float dz)
{
    struct cramer c;
    float fx = ox - r[0], fy = oy - r[1], fz = oz - r[2];
    c.d0 = -dot3(dx, dy, dz, r[9], r[10], r[11]);
    float inv = 1.0f / c.d0;
    c.t = dot3(fx, fy, fz, r[9], r[10], r[11]) * inv;
    /* w = d x D: u = C.w / D0, v = -B.w / D0 */
    float wx = madd(dy, fz, -(dz * fy));
    float wy = madd(dz, fx, -(dx * fz));
    float wz = madd(dx, fy, -(dy * fx));
    c.u = -dot3(r[6], r[7], r[8], wx, wy, wz) * inv;
    c.v = dot3(r[3], r[4], r[5], wx, wy, wz) * inv;
    return c;
}

static inline void
cramer_record(const double p[3], const double e1[3], const double e2[3],
              float *r)
{
    double n[3] = {e1[1] * e2[2] - e1[2] * e2[1], e1[2] * e2[0] - e1[0] * e2[2],
                   e1[0] * e2[1] - e1[1] * e2[0]};
    double l1 = 0.0, l2 = 0.0;
    for (int k = 0; k < 3; k++) {
        r[k] = (float)p[k];
        r[3 + k] = (float)e1[k];
        r[6 + k] = (float)e2[k];
        r[9 + k] = (float)n[k];
        l1 += e1[k] * e1[k];
        l2 += e2[k] * e2[k];
    }
    r[12] = (float)(1e-12 * __builtin_sqrt(l1) * __builtin_sqrt(l2));
}

#endif
