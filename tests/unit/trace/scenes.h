/* scenes.h - scenes built by hand for the tracer's tests and benchmarks, without
 * the reader: what is not set has the document's default. */
#ifndef TESTS_UNIT_TRACE_SCENES_H
#define TESTS_UNIT_TRACE_SCENES_H

#include "core/scene/scene.h"

enum { SCENE_PARTS_MAX = 64 };

/* Zero it, scene_start it, add parts, use .scene. */
struct built {
    struct arena arena;
    struct scene scene;
    uint32_t objects_max;
};

/* 64 x 48 pixels, eye (0, 0, 5) looking at the origin, fov 45, recursive with
 * the defaults of SCENE 3.3, one grey lambert material, no light. */
void
built_start(struct built *built, uint32_t objects_max);
void
built_clear(struct built *built);

void
built_look(struct built *built, const double eye[3], const double target[3],
           const double up[3], double fov_deg);
void
built_size(struct built *built, uint32_t width, uint32_t height);

/* Each returns its index. */
int32_t
built_material(struct built *built, enum material_kind kind,
               const double diffuse[3], const double specular[3],
               double shininess, const double mirror[3]);
int32_t
built_checker(struct built *built, enum mapping mapping, double color0,
              double color1);
uint32_t
built_light(struct built *built, enum light_kind kind, double x, double y,
            double z, double intensity);

struct scene_object *
built_object(struct built *built, enum shape_kind kind, int32_t material);
struct scene_object *
built_sphere(struct built *built, int32_t material, double x, double y,
             double z, double radius);
struct scene_object *
built_box(struct built *built, int32_t material, double x0, double y0,
          double z0, double x1, double y1, double z1);
struct scene_object *
built_plane(struct built *built, int32_t material, double nx, double ny,
            double nz, double offset);
struct scene_object *
built_triangle(struct built *built, int32_t material, const double a[3],
               const double b[3], const double c[3]);
struct scene_object *
built_quad(struct built *built, int32_t material, const double origin[3],
           const double u[3], const double v[3]);

/* Arrays are copied. normals may be NULL. */
struct scene_object *
built_mesh(struct built *built, int32_t material, const float *positions,
           const float *normals, uint32_t position_count,
           const uint32_t *indices, uint32_t triangle_count);

/* object->to_world = matrix (rows of 3 x 4). */
void
built_transform(struct scene_object *object, const double matrix[12]);

/* The lecture's table (schemas/examples/course-table-*.json). */
void
built_table(struct built *built, enum accumulation accumulation, uint32_t width,
            uint32_t height, uint32_t bounces);

/* The sphereflake of the benchmark: 7 382 spheres on a plane, three lights,
 * mirrors of 0.5. */
void
built_sphereflake(struct built *built, unsigned level, uint32_t size);

/* Random numbers for tests, the same everywhere. */
struct dice {
    uint64_t state;
};
double
dice_unit(struct dice *dice); /* [0, 1) */
double
dice_range(struct dice *dice, double lo, double hi);

/* Shapes, materials, lights and transforms at random. */
void
built_random(struct built *built, uint64_t seed, uint32_t objects);

#endif
