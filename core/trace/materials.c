#include "core/trace/materials.h"

#include <string.h>

static const material_fn material_table[] = {
    [MATERIAL_LAMBERT] = material_lambert,
    [MATERIAL_BLINN_PHONG] = material_blinn,
    [MATERIAL_GLAZED] = material_glazed,
    [MATERIAL_MIRROR] = material_mirror,
};

static bool
paint_black(const struct paint *p)
{
    return p->texture == SCENE_NONE && p->color[0] == 0.0 &&
           p->color[1] == 0.0 && p->color[2] == 0.0;
}

static bool
paint_equal(const struct paint *a, const struct paint *b)
{
    return a->texture == b->texture && a->color[0] == b->color[0] &&
           a->color[1] == b->color[1] && a->color[2] == b->color[2];
}

bool
materials_build(const struct scene *scene, struct arena *arena,
                struct materials *m, struct error *err)
{
    size_t count = scene->material_count;
    bool ok = true;
    memset(m, 0, sizeof *m);
    m->count = scene->material_count;
    m->shininess = arena_array(arena, count, sizeof(float));
    m->ambient_is_diffuse = arena_array(arena, count, 1);
    ok = m->shininess != NULL && m->ambient_is_diffuse != NULL;
    for (int f = 0; f < PAINT_COUNT; f++) {
        m->texture[f] = arena_array(arena, count, sizeof(int32_t));
        ok = ok && m->texture[f] != NULL;
        for (int k = 0; k < 3; k++) {
            m->color[f][k] = arena_array(arena, count, sizeof(float));
            ok = ok && m->color[f][k] != NULL;
        }
    }
    if (!ok)
        return error_set(err, ERROR_MEMORY, "no memory for %u materials",
                         (unsigned)count);
    for (uint32_t i = 0; i < m->count; i++) {
        const struct scene_material *source = &scene->materials[i];
        struct material_record record;
        memset(&record, 0, sizeof record);
        for (int f = 0; f < PAINT_COUNT; f++)
            record.paint[f].texture = SCENE_NONE;
        material_table[source->kind](source, &record);
        m->shininess[i] = (float)record.shininess;
        m->ambient_is_diffuse[i] = paint_equal(&record.paint[PAINT_AMBIENT],
                                               &record.paint[PAINT_DIFFUSE]);
        for (int f = 0; f < PAINT_COUNT; f++) {
            const struct paint *p = &record.paint[f];
            m->texture[f][i] = p->texture;
            for (int k = 0; k < 3; k++)
                m->color[f][k][i] = (float)p->color[k];
            if (!paint_black(p))
                m->used |= 1u << f;
            if (p->texture != SCENE_NONE)
                m->textured |= 1u << f;
        }
    }
    return true;
}

static void
fetch_textures(const struct materials *m, const struct scene *scene,
               const struct geometry *geometry, const struct surfaces *s,
               int field, bool copied, struct paints *p)
{
    const int32_t *restrict texture = m->texture[field];
    for (uint32_t i = 0; i < s->count; i++) {
        uint32_t k = s->material[i];
        bool skip = copied && m->ambient_is_diffuse[k] != 0;
        p->texture[i] = skip ? SCENE_NONE : texture[k];
    }
    textures_apply(scene, geometry, s, p->texture, p->color[field],
                   &p->scratch);
}

void
materials_fetch(const struct materials *m, const struct scene *scene,
                const struct geometry *geometry, const struct surfaces *s,
                unsigned fields, struct paints *p)
{
    uint32_t n = lanes_up(s->count);
    fields &= m->used;
    for (int f = 0; f < PAINT_COUNT; f++) {
        if ((fields >> f & 1) == 0)
            continue;
        for (int k = 0; k < 3; k++) {
            const float *restrict from = m->color[f][k];
            float *restrict to = p->color[f][k];
            LANE_LOOP
            for (uint32_t i = 0; i < n; i++)
                to[i] = from[s->material[i]];
        }
        /* An ambient that is the diffuse paint takes over its value. */
        bool copied = f == PAINT_AMBIENT && (fields >> PAINT_DIFFUSE & 1) != 0;
        if ((m->textured >> f & 1) != 0)
            fetch_textures(m, scene, geometry, s, f, copied, p);
        if (copied && (m->textured >> PAINT_DIFFUSE & 1) != 0)
            for (uint32_t i = 0; i < s->count; i++)
                if (m->ambient_is_diffuse[s->material[i]] != 0)
                    for (int k = 0; k < 3; k++)
                        p->color[f][k][i] = p->color[PAINT_DIFFUSE][k][i];
    }
    if ((fields >> PAINT_SPECULAR & 1) != 0) {
        const float *restrict shininess = m->shininess;
        LANE_LOOP
        for (uint32_t i = 0; i < n; i++)
            p->shininess[i] = shininess[s->material[i]];
    }
}
