/* geometry.c - struct geometry from a scene, and the surfaces of a batch. */
#include <string.h>

#include "core/scene/vec.h"
#include "core/trace/flat.h"
#include "core/trace/shapes.h"

const struct shape_ops *const shape_table[SHAPE_KIND_COUNT] = {
    [SHAPE_SPHERE] = &shape_sphere_ops, [SHAPE_BOX] = &shape_box_ops,
    [SHAPE_PLANE] = &shape_plane_ops,   [SHAPE_TRIANGLE] = &shape_triangle_ops,
    [SHAPE_QUAD] = &shape_quad_ops,
};

/* World to object. A singular matrix was refused by the scene's checker. */
static void
invert(const double *m, float out[12])
{
    double c[3][3];
    double det = flat_cofactors(m, c);
    for (int r = 0; r < 3; r++) {
        double row[3], move = 0.0;
        for (int k = 0; k < 3; k++) {
            row[k] = c[k][r] / det; /* the cofactors, transposed */
            move -= row[k] * m[4 * k + 3];
            out[4 * r + k] = (float)row[k];
        }
        out[4 * r + 3] = (float)move;
    }
}

static struct shape_rules
rules_of(const struct scene_integrator *integrator)
{
    bool course = integrator->accumulation != ACCUMULATION_RECURSIVE;
    struct shape_rules rules = {
        .inside = integrator->inside_hits,
        .course = course,
        .face_epsilon = (float)integrator->ray_offset,
        /* smallest normal float: a parallel ray has 0 across */
        .plane_parallel = course ? 1e-6f : 1.1754944e-38f,
    };
    return rules;
}

static bool
sets_allocate(const struct scene *scene, struct geometry *g)
{
    bool moved[SHAPE_KIND_COUNT] = {false};
    for (uint32_t i = 0; i < scene->object_count; i++) {
        const struct scene_object *object = &scene->objects[i];
        g->sets[object->kind].count++;
        moved[object->kind] |= object->transformed;
    }
    g->mesh_count = g->sets[SHAPE_MESH].count;
    g->sets[SHAPE_MESH].count = 0;
    bool ok = true;
    for (int kind = 0; kind < SHAPE_KIND_COUNT; kind++) {
        struct shape_set *set = &g->sets[kind];
        if (shape_table[kind] == NULL)
            continue;
        set->stride = shape_table[kind]->stride;
        /* One more record than primitives: entries of other kinds read
         * record 0 of every set. */
        set->records = arena_array(&g->arena, (size_t)set->count + 1,
                                   set->stride * sizeof(float));
        set->object =
            arena_array(&g->arena, (size_t)set->count + 1, sizeof(uint32_t));
        set->visible = arena_array(&g->arena, (size_t)set->count + 1, 1);
        set->transformed = arena_array(&g->arena, (size_t)set->count + 1, 1);
        if (moved[kind]) {
            set->inverse = arena_array(&g->arena, (size_t)set->count + 1,
                                       12 * sizeof(float));
            set->forward = arena_array(&g->arena, (size_t)set->count + 1,
                                       12 * sizeof(float));
        }
        ok = ok && set->records != NULL && set->object != NULL &&
             set->visible != NULL && set->transformed != NULL &&
             (!moved[kind] || (set->inverse != NULL && set->forward != NULL));
    }
    g->meshes =
        arena_array(&g->arena, (size_t)g->mesh_count + 1, sizeof *g->meshes);
    return ok && g->meshes != NULL;
}

static bool
mesh_build(const struct scene *scene, uint32_t index, struct arena *arena,
           struct mesh_geometry *mesh)
{
    const struct scene_object *object = &scene->objects[index];
    const struct scene_mesh *source = &scene->meshes[object->shape.mesh.mesh];
    size_t count = source->position_count;
    mesh->object = index;
    mesh->position_count = source->position_count;
    mesh->triangle_count = source->triangle_count;
    mesh->indices = source->indices;
    mesh->normals = object->shape.mesh.smooth ? source->normals : NULL;
    mesh->uvs = source->uvs;
    mesh->sign = 1.0f;
    mesh->transformed = object->transformed;
    mesh->positions = arena_array(arena, count + 2, 3 * sizeof(float));
    if (mesh->positions == NULL)
        return false;
    if (!object->transformed) {
        memcpy(mesh->positions, source->positions, count * 3 * sizeof(float));
        return true;
    }
    double c[3][3];
    mesh->sign = flat_cofactors(object->to_world, c) < 0.0 ? -1.0f : 1.0f;
    invert(object->to_world, mesh->inverse);
    for (size_t i = 0; i < count; i++) {
        const float *p = source->positions + 3 * i;
        double from[3] = {p[0], p[1], p[2]}, to[3];
        flat_point(object, from, to);
        for (size_t k = 0; k < 3; k++)
            mesh->positions[3 * i + k] = (float)to[k];
    }
    return true;
}

static void
set_add(const struct scene_object *object, uint32_t index, uint32_t place,
        struct shape_set *set)
{
    const struct shape_ops *ops = shape_table[object->kind];
    set->object[place] = index;
    set->visible[place] = (uint8_t)object->visible;
    bool world =
        ops->prepare(object, set, set->records + (size_t)place * set->stride);
    set->transformed[place] = world ? 0 : 1;
    set->any_transformed |= !world;
    if (set->inverse == NULL)
        return;
    float *m = set->inverse + 12 * (size_t)place;
    if (object->transformed)
        invert(object->to_world, m);
    else
        m[0] = m[5] = m[10] = 1.0f;
    for (int k = 0; k < 12; k++)
        set->forward[12 * (size_t)place + (size_t)k] =
            (float)object->to_world[k];
}

static bool
objects_build(const struct scene *scene, struct geometry *g)
{
    uint32_t next[SHAPE_KIND_COUNT] = {0};
    bool moved = false;
    for (uint32_t i = 0; i < scene->object_count; i++)
        moved |= scene->objects[i].transformed;
    g->object_count = scene->object_count;
    g->place = arena_array(&g->arena, scene->object_count, sizeof(uint32_t));
    g->material = arena_array(&g->arena, scene->object_count, sizeof(uint32_t));
    if (moved)
        g->inverse =
            arena_array(&g->arena, scene->object_count, 12 * sizeof(float));
    if (g->place == NULL || g->material == NULL ||
        (moved && g->inverse == NULL))
        return false;
    for (uint32_t i = 0; i < scene->object_count; i++) {
        const struct scene_object *object = &scene->objects[i];
        uint32_t kind = object->kind, index = next[kind]++;
        g->place[i] = kind << 28 | index;
        g->material[i] = (uint32_t)object->material;
        if (moved && object->transformed)
            invert(object->to_world, g->inverse + 12 * (size_t)i);
        else if (moved)
            for (size_t k = 0; k < 3; k++)
                g->inverse[12 * (size_t)i + 5 * k] = 1.0f;
        if (kind != SHAPE_MESH)
            set_add(object, i, index, &g->sets[kind]);
        else if (!mesh_build(scene, i, &g->arena, &g->meshes[index]))
            return false;
    }
    return true;
}

bool
geometry_build(const struct scene *scene, size_t memory_max, struct geometry *g,
               struct error *err)
{
    memset(g, 0, sizeof *g);
    arena_init(&g->arena, memory_max);
    g->rules = rules_of(&scene->integrator);
    for (uint32_t i = 0; i < scene->texture_count; i++)
        g->wants_uv |= scene->textures[i].kind != TEXTURE_CONSTANT &&
                       scene->textures[i].mapping == MAPPING_UV;
    for (int kind = 0; kind < SHAPE_KIND_COUNT; kind++) {
        g->sets[kind].kind = (uint32_t)kind;
        g->sets[kind].rules = g->rules;
    }
    if (!sets_allocate(scene, g) || !objects_build(scene, g))
        return error_set(err, ERROR_MEMORY,
                         "no memory for the geometry of %u objects",
                         (unsigned)scene->object_count);
    return true;
}

void
geometry_clear(struct geometry *g)
{
    arena_clear(&g->arena);
    memset(g, 0, sizeof *g);
}

void
shape_world_bounds(const struct shape_set *set, uint32_t index, float lo[3],
                   float hi[3])
{
    const struct shape_ops *ops = shape_table[set->kind];
    ops->bounds(set->records + (size_t)index * set->stride, lo, hi);
    if (set->transformed[index] != 0) {
        /* The box around the eight corners, of which only the center and the
         * half sizes matter. */
        const float *m = set->forward + 12 * (size_t)index;
        float c[3], half[3], center[3];
        for (int k = 0; k < 3; k++) {
            center[k] = 0.5f * (lo[k] + hi[k]);
            half[k] = 0.5f * (hi[k] - lo[k]);
        }
        matrix_point(m, center[0], center[1], center[2], c);
        for (int r = 0; r < 3; r++) {
            float reach = 0.0f;
            for (int k = 0; k < 3; k++)
                reach += __builtin_fabsf(m[4 * r + k]) * half[k];
            lo[r] = c[r] - reach;
            hi[r] = c[r] + reach;
        }
    }
    for (int k = 0; k < 3; k++) {
        float a = __builtin_fabsf(lo[k]), b = __builtin_fabsf(hi[k]);
        float margin = 1e-5f * (a > b ? a : b) + 1e-20f;
        lo[k] -= margin;
        hi[k] += margin;
    }
}

/* Rays and hits -> surfaces, misses left out. */
static void
compact(const struct rays *restrict rays, const struct hits *restrict hits,
        struct surfaces *restrict s, uint32_t *restrict live)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < rays->count; i++) {
        live[count] = i;
        count += hits->object[i] != OBJECT_NONE ? 1 : 0;
    }
    s->count = count;
    uint32_t n = lanes_up(count);
    for (uint32_t j = count; j < n; j++)
        live[j] = 0;
    LANE_LOOP
    for (uint32_t j = 0; j < n; j++) {
        uint32_t i = live[j];
        s->t[j] = hits->t[i];
        s->primitive[j] = hits->primitive[i];
        s->object[j] = hits->object[i];
    }
    for (uint32_t j = count; j < n; j++) {
        s->object[j] = 0;
        s->t[j] = 0.0f;
    }
    for (int k = 0; k < 3; k++) {
        LANE_LOOP
        for (uint32_t j = 0; j < n; j++) {
            uint32_t i = live[j];
            s->d[k][j] = rays->d[k][i];
            s->p[k][j] = madd(s->t[j], rays->d[k][i], rays->o[k][i]);
        }
    }
}

void
surfaces_fill(const struct geometry *g, const struct rays *rays,
              const struct hits *hits, struct surfaces *s, uint32_t *live)
{
    compact(rays, hits, s, live);
    uint32_t n = lanes_up(s->count);
    uint32_t present = 0;
    LANE_LOOP
    for (uint32_t j = 0; j < n; j++) {
        uint32_t place = g->place[s->object[j]];
        s->kind[j] = place >> 28;
        s->index[j] = place & 0xfffffffu;
        s->material[j] = g->material[s->object[j]];
    }
    for (uint32_t j = 0; j < s->count; j++)
        present |= 1u << s->kind[j];
    for (int kind = 0; kind < SHAPE_KIND_COUNT; kind++) {
        if ((present >> kind & 1) == 0)
            continue;
        const struct shape_ops *ops = shape_table[kind];
        if (ops != NULL) {
            ops->surface(&g->sets[kind], s);
            if (g->wants_uv)
                ops->uv(&g->sets[kind], s);
        } else {
            mesh_surface(g, s);
            if (g->wants_uv)
                mesh_uv(g, s);
        }
    }
}
