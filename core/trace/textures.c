#include "core/trace/textures.h"

static const texture_fn texture_table[] = {
    [TEXTURE_CONSTANT] = texture_constant,
    [TEXTURE_CHECKERBOARD] = texture_checker,
};

/* Which coordinates, in which order (SCENE 3.5). */
static const struct {
    unsigned dimensions;
    int axis[3];
    bool object;
} mapping_table[] = {
    [MAPPING_UV] = {2, {0, 1, 0}, false},
    [MAPPING_WORLD_XZ] = {2, {0, 2, 0}, false},
    [MAPPING_WORLD_XY] = {2, {0, 1, 0}, false},
    [MAPPING_WORLD_YZ] = {2, {1, 2, 0}, false},
    [MAPPING_WORLD_XYZ] = {3, {0, 1, 2}, false},
    [MAPPING_OBJECT_XZ] = {2, {0, 2, 0}, true},
    [MAPPING_OBJECT_XY] = {2, {0, 1, 0}, true},
    [MAPPING_OBJECT_YZ] = {2, {1, 2, 0}, true},
    [MAPPING_OBJECT_XYZ] = {3, {0, 1, 2}, true},
};

static void
coordinates(const struct scene_texture *texture,
            const struct geometry *geometry, const struct surfaces *s,
            uint32_t n, const uint32_t *restrict list,
            float p[restrict 3][BATCH_MAX])
{
    unsigned dimensions = mapping_table[texture->mapping].dimensions;
    const int *axis = mapping_table[texture->mapping].axis;
    bool object =
        mapping_table[texture->mapping].object && geometry->inverse != NULL;
    for (unsigned c = 0; c < dimensions; c++) {
        float scale = (float)texture->scale[c];
        float offset = (float)texture->offset[c];
        const float *restrict from =
            texture->mapping == MAPPING_UV ? s->uv[axis[c]] : s->p[axis[c]];
        float *restrict to = p[c];
        if (!object) {
            LANE_LOOP
            for (uint32_t j = 0; j < n; j++)
                to[j] = scale * from[list[j]] + offset;
            continue;
        }
        for (uint32_t j = 0; j < n; j++) {
            uint32_t i = list[j];
            const float *m = geometry->inverse + 12 * (size_t)s->object[i];
            float q[3];
            matrix_point(m, s->p[0][i], s->p[1][i], s->p[2][i], q);
            to[j] = scale * q[axis[c]] + offset;
        }
    }
}

void
textures_apply(const struct scene *scene, const struct geometry *geometry,
               const struct surfaces *s, const int32_t *texture,
               float color[3][BATCH_MAX], struct texture_scratch *w)
{
    uint32_t left = 0;
    for (uint32_t i = 0; i < s->count; i++) {
        w->rest[left] = i;
        left += texture[i] >= 0 ? 1 : 0;
    }
    /* One texture after the other: those of the first one left, then what
     * remains. */
    while (left > 0) {
        int32_t now = texture[w->rest[0]];
        uint32_t n = 0, remain = 0;
        for (uint32_t j = 0; j < left; j++) {
            uint32_t i = w->rest[j];
            bool mine = texture[i] == now;
            w->list[n] = i;
            n += mine ? 1 : 0;
            w->rest[remain] = i;
            remain += mine ? 0 : 1;
        }
        left = remain;
        const struct scene_texture *t = &scene->textures[now];
        for (uint32_t j = n; j < lanes_up(n); j++)
            w->list[j] = 0;
        coordinates(t, geometry, s, lanes_up(n), w->list, w->p);
        texture_table[t->kind](t, n, w->p, mapping_table[t->mapping].dimensions,
                               w->out);
        for (int k = 0; k < 3; k++) {
            LANE_LOOP
            for (uint32_t j = 0; j < n; j++)
                color[k][w->list[j]] = w->out[k][j];
        }
    }
}
