#include "tests/unit/scene/property.h"

#include <math.h>
#include <string.h>

#include "core/base/must.h"
#include "core/scene/scene_cost.h"
#include "core/scene/scene_lint.h"
#include "tests/unit/scene/documents.h"

static void
bounded(const double *numbers, size_t count, double most)
{
    for (size_t i = 0; i < count; i++)
        MUST(isfinite(numbers[i]) && fabs(numbers[i]) <= most);
}

static void
unit(const double n[3])
{
    MUST(fabs(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1) < 1e-9);
}

static void
sane_paint(const struct scene *s, const struct paint *paint)
{
    bounded(paint->color, 3, 1e6);
    MUST(paint->texture >= SCENE_NONE &&
         paint->texture < (int32_t)s->texture_count);
}

static void
sane_surfaces(const struct scene *s)
{
    for (uint32_t i = 0; i < s->texture_count; i++) {
        bounded(s->textures[i].scale, 3, 1e6);
        bounded(s->textures[i].offset, 3, 1e6);
        bounded(s->textures[i].color0, 3, 1e6);
        bounded(s->textures[i].color1, 3, 1e6);
    }
    for (uint32_t i = 0; i < s->material_count; i++) {
        const struct scene_material *m = &s->materials[i];
        sane_paint(s, &m->diffuse);
        sane_paint(s, &m->ambient);
        sane_paint(s, &m->specular);
        sane_paint(s, &m->mirror);
        sane_paint(s, &m->emission);
        bounded(&m->shininess, 1, 1e5);
    }
    for (uint32_t i = 0; i < s->light_count; i++) {
        const struct scene_light *l = &s->lights[i];
        bounded(l->intensity, 3, 1e12);
        bounded(l->position, 3, 1e6);
        if (l->kind == LIGHT_DIRECTIONAL)
            unit(l->to_light);
        MUST(scene_light_positions(l) >= 1);
        MUST(scene_light_positions(l) <= 64 * 64);
    }
}

static void
sane_mesh(const struct scene_mesh *m)
{
    MUST(m->position_count >= 3 && m->triangle_count >= 1);
    for (uint32_t i = 0; i < 3 * m->position_count; i++) {
        MUST(fabsf(m->positions[i]) <= 1e6f);
        MUST(m->normals == NULL || fabsf(m->normals[i]) <= 1.0001f);
    }
    for (uint32_t i = 0; m->uvs != NULL && i < 2 * m->position_count; i++)
        MUST(fabsf(m->uvs[i]) <= 1e6f);
    for (uint32_t i = 0; i < 3 * m->triangle_count; i++)
        MUST(m->indices[i] < m->position_count);
}

static void
sane_object(const struct scene *s, const struct scene_object *o)
{
    MUST(o->material >= 0 && o->material < (int32_t)s->material_count);
    MUST(o->visible <= 7 && o->pointer != NULL);
    bounded(o->to_world, 12, 1e9);
    switch (o->kind) {
    case SHAPE_SPHERE:
        bounded(o->shape.sphere.center, 3, 1e6);
        MUST(o->shape.sphere.radius >= 1e-6 && o->shape.sphere.radius <= 1e6);
        break;
    case SHAPE_BOX:
        for (int i = 0; i < 3; i++)
            MUST(o->shape.box.min[i] < o->shape.box.max[i]);
        break;
    case SHAPE_PLANE:
        unit(o->shape.plane.normal);
        bounded(&o->shape.plane.offset, 1, 3e6);
        break;
    case SHAPE_TRIANGLE:
        bounded(&o->shape.triangle.vertices[0][0], 9, 1e6);
        for (int i = 0; i < 3 && o->shape.triangle.has_normals; i++)
            unit(o->shape.triangle.normals[i]);
        bounded(&o->shape.triangle.uvs[0][0], 6, 1e6);
        break;
    case SHAPE_QUAD:
        bounded(o->shape.quad.origin, 3, 1e6);
        bounded(o->shape.quad.edge_u, 3, 1e6);
        bounded(o->shape.quad.edge_v, 3, 1e6);
        break;
    case SHAPE_MESH: MUST(o->shape.mesh.mesh < s->mesh_count); break;
    case SHAPE_KIND_COUNT: MUST(false); break;
    }
}

static void
sane_scene(const struct scene *s)
{
    const struct scene_camera *c = &s->camera;
    MUST(s->width >= 1 && s->width <= 8192);
    MUST(s->height >= 1 && s->height <= 8192);
    MUST((uint64_t)s->width * s->height <= 16777216);
    MUST(s->sampler.spp >= 1 && s->sampler.spp <= 65536);
    MUST(s->sampler.kind != SAMPLER_CENTER || s->sampler.spp == 1);
    MUST(s->integrator.max_bounces <= 64);
    bounded(c->eye, 3, 1e6);
    unit(c->u);
    unit(c->v);
    unit(c->w);
    /* A field of view of 5e-324 degrees is a window of no width. */
    MUST(c->left <= c->right && c->bottom <= c->top);
    MUST(isfinite(c->right) && isfinite(c->top));
    MUST(c->kind != CAMERA_PERSPECTIVE || c->distance > 0);
    bounded(s->integrator.ambient, 3, 1e6);
    sane_surfaces(s);
    for (uint32_t i = 0; i < s->mesh_count; i++)
        sane_mesh(&s->meshes[i]);
    MUST(s->object_count >= 1 && s->object_count <= 10000);
    for (uint32_t i = 0; i < s->object_count; i++)
        sane_object(s, &s->objects[i]);
}

static void
sane_errors(const struct error_list *errors)
{
    MUST(errors->count <= ERROR_LIST_MAX);
    for (size_t i = 0; i < errors->count; i++) {
        const struct error_item *e = &errors->items[i];
        MUST(e->code != ERROR_NONE && e->detail != NULL);
        MUST(e->detail[0] != '\0');
        MUST(i == 0 || e->line >= e[-1].line);
        MUST(e->pointer == NULL || e->line >= 1);
    }
}

static void
round_trip(const struct document *d)
{
    struct document again;
    struct bytes first = {0}, second = {0}, dump1 = {0}, dump2 = {0};
    scene_write_canonical(d->root, &first);
    if (first.len > 1024 * 1024)
        goto out; /* longer than the original: it may be over the limit */
    document_read(&again, first.data, first.len, NULL);
    MUST(again.good);
    scene_write_canonical(again.root, &second);
    MUST(strcmp(first.data, second.data) == 0);
    scene_dump(&d->scene, &dump1);
    scene_dump(&again.scene, &dump2);
    MUST(strcmp(dump1.data, dump2.data) == 0);
    document_clear(&again);
out:
    bytes_clear(&first);
    bytes_clear(&second);
    bytes_clear(&dump1);
    bytes_clear(&dump2);
}

bool
scene_property(const char *text, size_t len)
{
    struct document d;
    document_read(&d, text, len, NULL);
    MUST(d.good == (d.errors.count == 0));
    sane_errors(&d.errors);
    bool good = d.good;
    if (good) {
        const struct lint_item *items;
        struct output output;
        output_default(&output);
        sane_scene(&d.scene);
        struct scene_cost cost = scene_cost(&d.scene, &output, 0);
        MUST(isfinite(cost.rays) && cost.rays >= 1);
        MUST(scene_lint(d.root, &d.scene, &d.arena, &items) <= 50);
        round_trip(&d);
    }
    document_clear(&d);
    return good;
}

static void
sane_tree(const struct json *node, size_t len)
{
    MUST(node->begin < node->end && node->end <= len);
    MUST(node->line >= 1 && node->column >= 1);
    size_t at = node->begin;
    uint32_t count = 0;
    for (const struct json *n = node->child; n != NULL; n = n->next) {
        MUST(n->parent == node && n->begin > at && n->end < node->end);
        MUST((n->key != NULL) == (node->type == JSON_OBJECT));
        at = n->end - 1;
        count++;
        sane_tree(n, len);
    }
    MUST(count == node->count);
    if (node->type == JSON_NUMBER)
        MUST(isfinite(node->number));
    if (node->type == JSON_STRING)
        MUST(strlen(node->string) == node->string_len);
}

bool
json_property(const char *text, size_t len)
{
    struct arena arena;
    arena_init(&arena, 0);
    struct error_list errors = {.arena = &arena};
    const struct json *root = json_read(text, len, NULL, &arena, &errors);
    MUST((root != NULL) == (errors.count == 0));
    MUST(errors.count <= 1);
    if (root != NULL)
        sane_tree(root, len);
    arena_clear(&arena);
    return root != NULL;
}
