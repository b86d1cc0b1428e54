/* shapes.h - the scene's shapes as floats, and what each kind of shape can do.
 *
 * All primitives of one kind lie in one shape_set, in object order, so that one
 * Embree geometry and one loop serve them all. Each kind is one file and one
 * row of shape_table: bounds, the nearest hit, any hit, and the surface at a
 * hit. Rays come as lanes, pointers to columns of 1, 4, 8, 16 or up to
 * STRIP_MAX entries; a kind has one body for one lane (shape_lanes.h) and every
 * width gives the same bits.
 *
 * Meshes are Embree's when asked for a hit; their surface is ours (mesh_*). */
#ifndef CORE_TRACE_SHAPES_H
#define CORE_TRACE_SHAPES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/arena.h"
#include "core/base/error.h"
#include "core/scene/scene.h"
#include "core/trace/kernel_names.h"
#include "core/trace/rays.h"

enum { STRIP_MAX = 256 };

/* What a scene's integrator settles for every shape (SCENE 6.1). */
struct shape_rules {
    bool inside;          /* exits count too, not only entries */
    bool course;          /* the course's box faces and plane threshold */
    float face_epsilon;   /* course: distance that still belongs to a face */
    float plane_parallel; /* |n.d| below it: no hit */
};

struct shape_set {
    uint32_t kind; /* enum shape_kind */
    struct shape_rules rules;
    uint32_t count;
    uint32_t stride;  /* floats per record */
    float *records;   /* [count][stride], layout known to the shape's file */
    uint32_t *object; /* [count] scene object */
    uint8_t *visible; /* [count] enum visible */
    uint8_t *transformed; /* [count] 1: rays go through `inverse` first */
    float *inverse;       /* [count][12] world to object, rows of 3 x 4; NULL:
                             no object of the set has a transform */
    float *forward;       /* [count][12] object to world, or NULL as inverse */
    bool any_transformed;
};

/* Triangles of one mesh object, in world space. */
struct mesh_geometry {
    uint32_t object;
    uint32_t position_count, triangle_count;
    float *positions; /* [position_count + 1][3], one spare for wide loads */
    const uint32_t *indices;
    const float *normals; /* in object space, or NULL: not smooth */
    const float *uvs;     /* or NULL */
    float sign;           /* -1: the transform mirrors */
    bool transformed;
    float inverse[12];
};

struct geometry {
    struct arena arena;
    struct shape_set sets[SHAPE_KIND_COUNT]; /* that of meshes is empty */
    struct mesh_geometry *meshes;
    uint32_t mesh_count;
    uint32_t object_count;
    uint32_t *place;    /* [object_count] kind << 28 | index */
    uint32_t *material; /* [object_count] */
    float *inverse;     /* [object_count][12], NULL: no transformed object */
    struct shape_rules rules;
    bool wants_uv;
};

/* Columns of rays on their way through a shape; t and object are in and out. */
struct lanes {
    const float *o[3], *d[3];
    const float *inv_d[3]; /* as lanes_invert makes it; box only, else NULL */
    float *t;              /* nearest so far; any: the limit, -inf if hit */
    uint32_t *object;      /* of the nearest so far; any: unused */
    const int *valid;      /* 0: leave the lane alone; NULL: all valid */
};

struct shape_ops {
    uint32_t stride;
    /* Fill record `index` of the set. Returns true if the record is in world
     * space, false if rays must go through the inverse transform. */
    bool (*prepare)(const struct scene_object *object,
                    const struct shape_set *set, float *record);
    /* Bounds in the record's space, without margin. NULL: unbounded kind. */
    void (*bounds)(const float *record, float lo[3], float hi[3]);
    /* Primitives first ... first + count - 1 against n lanes: a nearer hit, or
     * an equal one of an earlier object, replaces t and object. */
    void (*nearest)(const struct shape_set *set, uint32_t first, uint32_t count,
                    const struct lanes *lanes, uint32_t n);
    /* The same, t becoming -infinity in each lane with a hit below it. */
    void (*any)(const struct shape_set *set, uint32_t first, uint32_t count,
                const struct lanes *lanes, uint32_t n);
    /* Point and normals of the entries of this kind. */
    void (*surface)(const struct shape_set *set, struct surfaces *surfaces);
    void (*uv)(const struct shape_set *set, struct surfaces *surfaces);
};

extern const struct shape_ops shape_sphere_ops, shape_box_ops, shape_plane_ops,
    shape_triangle_ops, shape_quad_ops;

/* One row per kind; NULL: no analytic shape. */
extern const struct shape_ops *const shape_table[SHAPE_KIND_COUNT];

/* Everything above from a scene. ERROR_MEMORY. */
bool
geometry_build(const struct scene *scene, size_t memory_max,
               struct geometry *geometry, struct error *err);
void
geometry_clear(struct geometry *geometry);

/* surfaces from rays and hits: misses dropped, order kept; live[j] is the ray
 * of surface j. */
void
surfaces_fill(const struct geometry *geometry, const struct rays *rays,
              const struct hits *hits, struct surfaces *surfaces,
              uint32_t *live);

/* World bounds of one primitive, with a margin for the rounding of its own
 * intersection test: no hit lies outside. */
void
shape_world_bounds(const struct shape_set *set, uint32_t index, float lo[3],
                   float hi[3]);

void
mesh_surface(const struct geometry *geometry, struct surfaces *surfaces);
void
mesh_uv(const struct geometry *geometry, struct surfaces *surfaces);

/* 1 / d with a large finite number for 0: a ray that runs inside a face of a
 * box then gives no NaN. */
static inline float
lane_invert(float d)
{
    float size = d < 0.0f ? -d : d;
    return size < 1e-30f ? 1e30f : 1.0f / d;
}

/* p through rows of 3 x 4. */
static inline void
matrix_point(const float m[12], float x, float y, float z, float out[3])
{
    for (int r = 0; r < 3; r++)
        out[r] =
            m[4 * r] * x + m[4 * r + 1] * y + m[4 * r + 2] * z + m[4 * r + 3];
}

static inline void
matrix_vector(const float m[12], float x, float y, float z, float out[3])
{
    for (int r = 0; r < 3; r++)
        out[r] = m[4 * r] * x + m[4 * r + 1] * y + m[4 * r + 2] * z;
}

/* Row vector times matrix: normals, with m the inverse transform. */
static inline void
matrix_normal(const float m[12], float x, float y, float z, float out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = m[c] * x + m[4 + c] * y + m[8 + c] * z;
}

#endif
