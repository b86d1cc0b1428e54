/* textures.h - colours that depend on the place (SCENE 3.5).
 *
 * One file and one row of the table per kind. A texture is asked for a list of
 * surfaces at once, whose coordinates p' = scale p + offset are ready. */
#ifndef CORE_TRACE_TEXTURES_H
#define CORE_TRACE_TEXTURES_H

#include <stdint.h>

#include "core/scene/scene.h"
#include "core/trace/kernel_names.h"
#include "core/trace/shapes.h"

/* p: columns of p', of which the first `dimensions` mean something; out: red,
 * green, blue. All of lanes_up(n) entries. */
typedef void (*texture_fn)(const struct scene_texture *texture, uint32_t n,
                           float p[3][BATCH_MAX], unsigned dimensions,
                           float out[3][BATCH_MAX]);

void
texture_constant(const struct scene_texture *texture, uint32_t n,
                 float p[3][BATCH_MAX], unsigned dimensions,
                 float out[3][BATCH_MAX]);
void
texture_checker(const struct scene_texture *texture, uint32_t n,
                float p[3][BATCH_MAX], unsigned dimensions,
                float out[3][BATCH_MAX]);

struct texture_scratch {
    COLUMN(uint32_t, list);
    COLUMN(uint32_t, rest);
    COLUMNS(float, p, 3);
    COLUMNS(float, out, 3);
};

/* color[i] of every surface i with texture[i] >= 0 becomes that texture's
 * value; the others stay. */
void
textures_apply(const struct scene *scene, const struct geometry *geometry,
               const struct surfaces *surfaces, const int32_t *texture,
               float color[3][BATCH_MAX], struct texture_scratch *scratch);

#endif
