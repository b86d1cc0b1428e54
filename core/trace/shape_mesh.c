/* shape_mesh.c - the surface of mesh triangles; Embree finds them. */
#include "core/scene/vec.h"
#include "core/trace/cramer.h"
#include "core/trace/shapes.h"

struct corner_weights {
    const float *a, *b, *c; /* positions */
    uint32_t index[3];
    float u, v;
    struct vec3 normal; /* geometric, unit or zero, as stored */
};

static inline float
clamp01(float x)
{
    return x > 0.0f ? (x < 1.0f ? x : 1.0f) : 0.0f;
}

/* Weights of the point of surface i: SCENE 6.4, clamped into the triangle. The
 * point is Embree's t along the ray, so it is as near to the triangle's plane
 * as a float allows. */
static struct corner_weights
weights(const struct mesh_geometry *mesh, const struct surfaces *f, uint32_t i)
{
    struct corner_weights w;
    const uint32_t *k = mesh->indices + 3 * (size_t)f->primitive[i];
    float r[CRAMER_FLOATS];
    for (int c = 0; c < 3; c++)
        w.index[c] = k[c];
    w.a = mesh->positions + 3 * (size_t)k[0];
    w.b = mesh->positions + 3 * (size_t)k[1];
    w.c = mesh->positions + 3 * (size_t)k[2];
    for (int c = 0; c < 3; c++) {
        r[c] = w.a[c];
        r[3 + c] = w.b[c] - w.a[c];
        r[6 + c] = w.c[c] - w.a[c];
    }
    struct vec3 e1 = {r[3], r[4], r[5]}, e2 = {r[6], r[7], r[8]};
    struct vec3 n = vec_cross(e1, e2);
    r[9] = n.x, r[10] = n.y, r[11] = n.z, r[12] = 0.0f;
    w.normal = vec_unit(n);
    struct cramer s = cramer_solve(r, f->p[0][i], f->p[1][i], f->p[2][i],
                                   w.normal.x, w.normal.y, w.normal.z);
    w.u = clamp01(s.u);
    w.v = clamp01(s.v);
    w.v = w.v < 1.0f - w.u ? w.v : 1.0f - w.u;
    return w;
}

void
mesh_surface(const struct geometry *geometry, struct surfaces *f)
{
    for (uint32_t i = 0; i < f->count; i++) {
        if (f->kind[i] != SHAPE_MESH)
            continue;
        const struct mesh_geometry *mesh = &geometry->meshes[f->index[i]];
        struct corner_weights w = weights(mesh, f, i);
        struct vec3 g = {mesh->sign * w.normal.x, mesh->sign * w.normal.y,
                         mesh->sign * w.normal.z};
        struct vec3 n = g;
        if (mesh->normals != NULL) {
            const float *a = mesh->normals + 3 * (size_t)w.index[0];
            const float *b = mesh->normals + 3 * (size_t)w.index[1];
            const float *c = mesh->normals + 3 * (size_t)w.index[2];
            float first = 1.0f - w.u - w.v, v[3];
            for (int k = 0; k < 3; k++)
                v[k] = first * a[k] + w.u * b[k] + w.v * c[k];
            if (mesh->transformed) {
                float t[3];
                matrix_normal(mesh->inverse, v[0], v[1], v[2], t);
                for (int k = 0; k < 3; k++)
                    v[k] = t[k];
            }
            struct vec3 s = vec_unit((struct vec3){v[0], v[1], v[2]});
            if (vec_dot(s, s) > 0.0f)
                n = s;
        }
        f->n[0][i] = n.x;
        f->n[1][i] = n.y;
        f->n[2][i] = n.z;
        f->g[0][i] = g.x;
        f->g[1][i] = g.y;
        f->g[2][i] = g.z;
    }
}

void
mesh_uv(const struct geometry *geometry, struct surfaces *f)
{
    for (uint32_t i = 0; i < f->count; i++) {
        if (f->kind[i] != SHAPE_MESH)
            continue;
        const struct mesh_geometry *mesh = &geometry->meshes[f->index[i]];
        struct corner_weights w = weights(mesh, f, i);
        float first = 1.0f - w.u - w.v;
        f->uv[0][i] = w.u;
        f->uv[1][i] = w.v;
        if (mesh->uvs == NULL)
            continue;
        for (size_t k = 0; k < 2; k++)
            f->uv[k][i] = first * mesh->uvs[2 * (size_t)w.index[0] + k] +
                          w.u * mesh->uvs[2 * (size_t)w.index[1] + k] +
                          w.v * mesh->uvs[2 * (size_t)w.index[2] + k];
    }
}
