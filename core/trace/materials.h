/* materials.h - what a surface answers light with.
 *
 * Every material of step one is some ambient, diffuse, highlight, mirror and
 * emission, so all become records of one form: a batch is fetched by index
 * without branching on the kind. One file and one row of the table per kind
 * says which fields it has. */
#ifndef CORE_TRACE_MATERIALS_H
#define CORE_TRACE_MATERIALS_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/arena.h"
#include "core/base/error.h"
#include "core/scene/scene.h"
#include "core/trace/kernel_names.h"
#include "core/trace/shapes.h"
#include "core/trace/textures.h"

enum paint_field {
    PAINT_DIFFUSE,
    PAINT_AMBIENT,
    PAINT_SPECULAR,
    PAINT_MIRROR,
    PAINT_EMISSION,
    PAINT_COUNT
};

/* One material as fields; a zeroed paint is black without a texture only if its
 * texture is SCENE_NONE. */
struct material_record {
    struct paint paint[PAINT_COUNT];
    double shininess;
};

typedef void (*material_fn)(const struct scene_material *material,
                            struct material_record *record);

void
material_lambert(const struct scene_material *material,
                 struct material_record *record);
void
material_blinn(const struct scene_material *material,
               struct material_record *record);
void
material_glazed(const struct scene_material *material,
                struct material_record *record);
void
material_mirror(const struct scene_material *material,
                struct material_record *record);

struct materials {
    uint32_t count;
    unsigned used;     /* 1 << field: some material is not black there */
    unsigned textured; /* 1 << field: some material has a texture there */
    float *color[PAINT_COUNT][3]; /* [count] */
    int32_t *texture[PAINT_COUNT];
    float *shininess;
    uint8_t *ambient_is_diffuse; /* [count] the same paint */
};

/* Fetched for a batch of surfaces. Fields without a bit in materials.used are
 * never written: they stay zero. */
struct paints {
    float color[PAINT_COUNT][3][BATCH_MAX] __attribute__((aligned(64)));
    COLUMN(float, shininess);
    COLUMN(int32_t, texture);
    struct texture_scratch scratch;
};

/* Tables live in the arena. ERROR_MEMORY. */
bool
materials_build(const struct scene *scene, struct arena *arena,
                struct materials *materials, struct error *err);

/* `fields`: mask of 1 << paint_field that the caller wants. */
void
materials_fetch(const struct materials *materials, const struct scene *scene,
                const struct geometry *geometry,
                const struct surfaces *surfaces, unsigned fields,
                struct paints *paints);

#endif
