/* scene.h - what to render, as plain data.
 *
 * One arena owns everything; nothing changes after the reader returns, so any
 * number of threads may read it. Things refer to each other by index into the
 * arrays of `struct scene`, never by pointer. Numbers are the document's
 * doubles, in world units, degrees and linear colours; the tracer makes floats
 * of them. Everything here has passed scene_check: finite, within range, every
 * index valid.
 *
 * Groups are gone: each object carries its whole transform, object to world,
 * the innermost step first. Object i is the i-th drawn thing (no group) in
 * depth-first document order: object_id in layers is i + 1, and between equal
 * distances the lower i wins. */
#ifndef CORE_SCENE_SCENE_H
#define CORE_SCENE_SCENE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/arena.h"

enum {
    SCENE_NONE = -1 /* "no texture" */
};

enum camera_kind { CAMERA_PERSPECTIVE, CAMERA_ORTHOGRAPHIC };

/* A camera is reduced on reading to its window: the image plane at `distance`
 * before the eye spans [left, right] x [bottom, top] along u and v (SCENE 5).
 * w = unit(eye - target), u = unit(up x w), v = w x u. Orthographic: the ray
 * starts at eye + a u + b v and runs along -w. */
struct scene_camera {
    enum camera_kind kind;
    double eye[3];
    double u[3], v[3], w[3]; /* orthonormal */
    double left, right, bottom, top;
    double distance; /* > 0; perspective only */
};

enum sampler_kind {
    SAMPLER_CENTER,
    SAMPLER_INDEPENDENT,
    SAMPLER_STRATIFIED,
    SAMPLER_SOBOL
};

struct scene_sampler {
    enum sampler_kind kind;
    uint32_t spp; /* 1 for center */
    uint32_t seed;
};

enum integrator_kind { INTEGRATOR_WHITTED, INTEGRATOR_PATH, INTEGRATOR_AO };
enum accumulation {
    ACCUMULATION_RECURSIVE,
    ACCUMULATION_MEAN,
    ACCUMULATION_FRESNEL_WEIGHTED
};
enum shadows { SHADOWS_NONE, SHADOWS_HARD, SHADOWS_SOFT };

struct scene_integrator {
    enum integrator_kind kind;
    uint32_t max_bounces; /* 0...64 */
    enum accumulation accumulation;
    double ambient[3]; /* I_a */
    enum shadows shadows;
    double clamp_local; /* 0: none */
    double fresnel_bias, fresnel_exponent;
    bool inside_hits;
    double ray_offset; /* scene units */
};

enum background_kind { BACKGROUND_CONSTANT, BACKGROUND_GRADIENT };

struct scene_background {
    enum background_kind kind;
    double color[3]; /* constant; gradient: bottom */
    double top[3];   /* gradient: weight (d.y + 1) / 2 */
};

enum texture_kind { TEXTURE_CONSTANT, TEXTURE_CHECKERBOARD };

/* Which coordinates p of the surface a texture reads, in this order. */
enum mapping {
    MAPPING_UV,
    MAPPING_WORLD_XZ,
    MAPPING_WORLD_XY,
    MAPPING_WORLD_YZ,
    MAPPING_WORLD_XYZ,
    MAPPING_OBJECT_XZ,
    MAPPING_OBJECT_XY,
    MAPPING_OBJECT_YZ,
    MAPPING_OBJECT_XYZ
};

/* p' = scale p + offset per coordinate (SCENE 3.5). */
struct scene_texture {
    enum texture_kind kind;
    const char *name; /* NULL: inline */
    enum mapping mapping;
    double scale[3], offset[3];
    double color0[3]; /* constant: the colour */
    double color1[3];
};

/* A colour, or the texture that gives it. */
struct paint {
    double color[3];
    int32_t texture; /* SCENE_NONE: color */
};

enum material_kind {
    MATERIAL_LAMBERT,
    MATERIAL_BLINN_PHONG,
    MATERIAL_GLAZED,
    MATERIAL_MIRROR
};

/* Fields that a kind lacks are zero: a lambert's specular and mirror, a
 * mirror's diffuse. A mirror's reflectance is `mirror`. */
struct scene_material {
    enum material_kind kind;
    const char *name; /* NULL: inline or the default */
    struct paint diffuse, ambient, specular, mirror, emission;
    double shininess;
};

enum light_kind { LIGHT_POINT, LIGHT_DIRECTIONAL, LIGHT_AREA_GRID };

struct scene_light {
    enum light_kind kind;
    const char *name;
    double intensity[3]; /* color x intensity */
    bool inverse_square;
    double position[3]; /* point, area_grid */
    double to_light[3]; /* directional, unit */
    double half_size;   /* area_grid */
    uint32_t samples;   /* area_grid: per axis */
    bool loop_float32;  /* area_grid: the lecture's loop (SCENE 6.1) */
};

enum shape_kind {
    SHAPE_SPHERE,
    SHAPE_BOX,
    SHAPE_PLANE,
    SHAPE_TRIANGLE,
    SHAPE_QUAD,
    SHAPE_MESH,
    SHAPE_KIND_COUNT
};

struct shape_sphere {
    double center[3], radius;
};
struct shape_box {
    double min[3], max[3];
};
struct shape_plane {
    double normal[3]; /* unit */
    double offset;    /* n x = offset */
};
struct shape_triangle {
    double vertices[3][3];
    bool has_normals, has_uvs;
    double normals[3][3]; /* unit */
    double uvs[3][2];
};
struct shape_quad {
    double origin[3], edge_u[3], edge_v[3];
};
struct shape_mesh {
    uint32_t mesh; /* index into scene.meshes */
    bool smooth;
};

enum visible { VISIBLE_CAMERA = 1, VISIBLE_SHADOW = 2, VISIBLE_REFLECTION = 4 };

struct scene_object {
    enum shape_kind kind;
    const char *name;    /* NULL: unnamed */
    const char *pointer; /* into the scene document: "/objects/3/children/0" */
    int32_t material;    /* always valid */
    unsigned visible;    /* enum visible, or-ed */
    bool transformed;    /* false: to_world is the identity */
    double to_world[12]; /* rows of 3 x 4; parameters below are before it */
    union {
        struct shape_sphere sphere;
        struct shape_box box;
        struct shape_plane plane;
        struct shape_triangle triangle;
        struct shape_quad quad;
        struct shape_mesh mesh;
    } shape;
};

/* Triangles of one mesh, in object space. */
struct scene_mesh {
    float *positions;  /* [position_count * 3] */
    float *normals;    /* [position_count * 3] unit, or NULL */
    float *uvs;        /* [position_count * 2], or NULL */
    uint32_t *indices; /* [triangle_count * 3] */
    uint32_t position_count, triangle_count;
};

struct scene {
    struct arena *arena;
    const char *name; /* NULL: unnamed */
    struct scene_camera camera;
    uint32_t width, height; /* film, pixels */
    struct scene_sampler sampler;
    struct scene_integrator integrator;
    struct scene_background background;
    struct scene_texture *textures;
    uint32_t texture_count;
    struct scene_material *materials; /* named, inline and default ones */
    uint32_t material_count;
    struct scene_light *lights;
    uint32_t light_count;
    bool default_light; /* no "lights" in the document */
    struct scene_mesh *meshes;
    uint32_t mesh_count;
    struct scene_object *objects;
    uint32_t object_count;   /* >= 1 */
    uint64_t triangle_count; /* meshes and free triangles */
};

/* Number of positions an area_grid light sends per shading point: samples^2,
 * or what the lecture's single-precision loop really visits (SCENE 6.1: 36 for
 * 7, 144 for 13); 1 for every other light. */
uint32_t
scene_light_positions(const struct scene_light *light);

/* Position k of them, k < scene_light_positions: offsets along x and z in units
 * of half_size, each -1 ... 1, outer loop x. */
void
scene_light_offset(const struct scene_light *light, uint32_t k, float *x,
                   float *z);

#endif
