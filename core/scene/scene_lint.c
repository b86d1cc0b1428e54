#include "core/scene/scene_lint.h"

#include <math.h>
#include <string.h>

#include "core/base/number.h"
#include "core/scene/kinds.h"
#include "core/scene/lint_list.h"
#include "core/scene/scene_reader.h"
#include "core/scene/transform.h"

void
lint_add(struct lint_list *list, const struct json *place, const char *code,
         const char *format, ...)
{
    va_list args;
    if (list->count == LINT_MAX || place == NULL)
        return;
    va_start(args, format);
    const char *detail = arena_vprintf(list->arena, format, args);
    va_end(args);
    list->items[list->count++] = (struct lint_item){
        .pointer = json_pointer(place, list->arena),
        .line = place->line,
        .column = place->column,
        .code = code,
        .detail = detail != NULL ? detail : "",
    };
}

static const char *
called(struct lint_list *list, const struct scene_object *object)
{
    const char *text =
        arena_printf(list->arena, "`%s`",
                     object->name != NULL ? object->name : object->pointer);
    return text != NULL ? text : "an object";
}

/* --- documents of the drawn objects -------------------------------------------------- */

static void
collect_nodes(struct lint_list *list, const struct json *array, uint32_t *at)
{
    for (const struct json *n = array->child; n != NULL; n = n->next) {
        if (is_text(json_member(n, "type"), "group"))
            collect_nodes(list, json_member(n, "children"), at);
        else if (*at < list->scene->object_count)
            list->nodes[(*at)++] = n;
    }
}

/* --- reflection ------------------------------------------------------------------------ */

static bool
is_bright(const struct paint *paint)
{
    return paint->texture != SCENE_NONE || paint->color[0] > 0 ||
           paint->color[1] > 0 || paint->color[2] > 0;
}

static void
lint_bounces(struct lint_list *list)
{
    const struct scene *scene = list->scene;
    const struct json *bounces =
        json_member(json_member(list->root, "integrator"), "max_bounces");
    const struct scene_object *mirror = NULL;
    if (bounces == NULL ||
        scene->integrator.accumulation != ACCUMULATION_RECURSIVE)
        return; /* in the course dialects every surface reflects */
    for (uint32_t i = 0; i < scene->object_count && mirror == NULL; i++) {
        const struct scene_object *object = &scene->objects[i];
        if (is_bright(&scene->materials[object->material].mirror))
            mirror = object;
    }
    if (mirror != NULL && scene->integrator.max_bounces == 0)
        lint_add(list, bounces, "mirror.no_bounces",
                 "max_bounces is 0, but %s reflects", called(list, mirror));
    if (mirror == NULL && scene->integrator.max_bounces > 0)
        lint_add(list, bounces, "bounces.unused",
                 "max_bounces is %u, but nothing reflects",
                 scene->integrator.max_bounces);
}

static void
lint_emission(struct lint_list *list)
{
    const struct scene *scene = list->scene;
    if (scene->integrator.accumulation != ACCUMULATION_RECURSIVE)
        return;
    for (uint32_t i = 0; i < scene->object_count; i++) {
        const struct scene_object *object = &scene->objects[i];
        if (is_bright(&scene->materials[object->material].emission))
            lint_add(list, list->nodes[i], "light.emissive_in_whitted",
                     "%s shines on others only under `path`",
                     called(list, object));
    }
}

/* --- what nobody uses -------------------------------------------------------------------- */

/* Names given as `material` in a tree of objects. */
static void
mark_materials(struct lint_list *list, const struct json *array, bool *used)
{
    const struct scene *scene = list->scene;
    for (const struct json *n = array->child; n != NULL; n = n->next) {
        const char *name = text_of(n, "material");
        for (uint32_t i = 0; name != NULL && i < scene->material_count; i++) {
            if (scene->materials[i].name != NULL &&
                strcmp(scene->materials[i].name, name) == 0) {
                used[i] = true;
                break; /* named ones stand before inline ones */
            }
        }
        if (is_text(json_member(n, "type"), "group"))
            mark_materials(list, json_member(n, "children"), used);
    }
}

static void
lint_unused(struct lint_list *list)
{
    const struct scene *scene = list->scene;
    const struct json *materials = json_member(list->root, "materials");
    const struct json *textures = json_member(list->root, "textures");
    bool *material = arena_array(list->arena, scene->material_count, 1);
    bool *texture = arena_array(list->arena, scene->texture_count, 1);
    if (material == NULL || texture == NULL)
        return;
    mark_materials(list, json_member(list->root, "objects"), material);
    for (uint32_t i = 0; i < scene->material_count; i++) {
        const struct scene_material *m = &scene->materials[i];
        const int32_t used[] = {m->diffuse.texture, m->ambient.texture,
                                m->specular.texture, m->mirror.texture,
                                m->emission.texture};
        for (size_t k = 0; k < COUNT_OF(used); k++) {
            if (used[k] != SCENE_NONE)
                texture[used[k]] = true;
        }
    }
    const struct json *n = materials != NULL ? materials->child : NULL;
    for (uint32_t i = 0; n != NULL; n = n->next, i++) {
        if (!material[i])
            lint_add(list, n, "material.unused", "no object uses `%s`",
                     scene->materials[i].name);
    }
    n = textures != NULL ? textures->child : NULL;
    for (uint32_t i = 0; n != NULL; n = n->next, i++) {
        if (!texture[i])
            lint_add(list, n, "texture.unused", "no material uses `%s`",
                     scene->textures[i].name);
    }
}

/* --- surfaces --------------------------------------------------------------------------------- */

/* A mesh without uvs under a texture that reads them. */
static void
lint_uv(struct lint_list *list, const struct scene_object *object,
        const struct json *node)
{
    const struct scene *scene = list->scene;
    const struct scene_material *m = &scene->materials[object->material];
    const int32_t used[] = {m->diffuse.texture, m->ambient.texture,
                            m->specular.texture, m->mirror.texture,
                            m->emission.texture};
    if (object->kind != SHAPE_MESH ||
        scene->meshes[object->shape.mesh.mesh].uvs != NULL)
        return;
    for (size_t k = 0; k < COUNT_OF(used); k++) {
        if (used[k] == SCENE_NONE)
            continue;
        const struct scene_texture *texture = &scene->textures[used[k]];
        if (texture->mapping != MAPPING_UV || texture->kind == TEXTURE_CONSTANT)
            continue;
        lint_add(list, node, "texture.no_uv", "`%s` uses uv, but %s has none",
                 texture->name != NULL ? texture->name : "the texture",
                 called(list, object));
        return;
    }
}

static void
lint_plane(struct lint_list *list, const struct json *node)
{
    double normal[3];
    char text[NUMBER_SIZE];
    if (!is_text(json_member(node, "type"), "plane") ||
        !numbers_of(node, "normal", 3, normal))
        return;
    double length = vector_length(normal);
    if (fabs(length - 1) <= 1e-6)
        return;
    number_text((double)(int64_t)(length * 1000 + 0.5) / 1000, text);
    lint_add(list, json_member(node, "normal"), "normal.not_unit",
             "the plane normal has length %s; the equation was divided by it",
             text);
}

/* --- inside of closed shapes --------------------------------------------------------------------- */

/* A world point in the object's own space, before its transform. */
static void
to_object(const double m[12], const double world[3], double out[3])
{
    /* Cramer's rule with the columns of the linear part. */
    double x[3], y[3], z[3], p[3], yz[3], xp[3];
    for (int i = 0; i < 3; i++) {
        x[i] = m[4 * i];
        y[i] = m[4 * i + 1];
        z[i] = m[4 * i + 2];
        p[i] = world[i] - m[4 * i + 3];
    }
    vector_cross(y, z, yz);
    vector_cross(x, p, xp);
    double determinant = vector_dot(x, yz);
    out[0] = vector_dot(p, yz) / determinant;
    out[1] = vector_dot(z, xp) / determinant;
    out[2] = -vector_dot(y, xp) / determinant;
}

static bool
contains(const struct scene_object *object, const double world[3])
{
    double p[3], d[3];
    to_object(object->to_world, world, p);
    if (object->kind == SHAPE_SPHERE) {
        const struct shape_sphere *sphere = &object->shape.sphere;
        for (int i = 0; i < 3; i++)
            d[i] = p[i] - sphere->center[i];
        return vector_length(d) < sphere->radius;
    }
    if (object->kind != SHAPE_BOX)
        return false;
    for (int i = 0; i < 3; i++) {
        if (!(p[i] > object->shape.box.min[i] &&
              p[i] < object->shape.box.max[i]))
            return false;
    }
    return true;
}

static const struct scene_object *
container(const struct scene *scene, const double point[3], unsigned visible)
{
    for (uint32_t i = 0; i < scene->object_count; i++) {
        const struct scene_object *object = &scene->objects[i];
        if ((object->visible & visible) && contains(object, point))
            return object;
    }
    return NULL;
}

static void
lint_inside(struct lint_list *list)
{
    const struct scene *scene = list->scene;
    const struct json *camera = json_member(list->root, "camera");
    const struct json *eye = json_member(camera, "eye");
    const struct scene_object *around =
        container(scene, scene->camera.eye, VISIBLE_CAMERA);
    if (around != NULL)
        lint_add(list,
                 eye != NULL      ? eye
                 : camera != NULL ? camera
                                  : list->root,
                 "camera.inside_object", "the camera is inside %s",
                 called(list, around));
    const struct json *lights = json_member(list->root, "lights");
    const struct json *n = lights != NULL ? lights->child : NULL;
    for (uint32_t i = 0; n != NULL; n = n->next, i++) {
        const struct scene_light *light = &scene->lights[i];
        if (light->kind == LIGHT_AREA_GRID && light->samples == 1 &&
            scene->integrator.shadows == SHADOWS_SOFT)
            lint_add(list, n, "area_light.one_sample",
                     "one sample: the shadows of this light are hard");
        if (light->kind == LIGHT_DIRECTIONAL ||
            scene->integrator.shadows == SHADOWS_NONE)
            continue;
        around = container(scene, light->position, VISIBLE_SHADOW);
        if (around != NULL)
            lint_add(list, json_member(n, "position"), "light.inside_object",
                     "the light is inside %s: everything outside is in shadow",
                     called(list, around));
    }
}

/* --- all of it ---------------------------------------------------------------------------------- */

static void
sort(struct lint_list *list)
{
    for (size_t i = 1; i < list->count; i++) {
        struct lint_item item = list->items[i];
        size_t j = i;
        for (; j > 0 && (list->items[j - 1].line > item.line ||
                         (list->items[j - 1].line == item.line &&
                          list->items[j - 1].column > item.column));
             j--)
            list->items[j] = list->items[j - 1];
        list->items[j] = item;
    }
}

size_t
scene_lint(const struct json *root, const struct scene *scene,
           struct arena *arena, const struct lint_item **items)
{
    struct lint_list list = {.arena = arena, .root = root, .scene = scene};
    uint32_t at = 0;
    list.items = arena_array(arena, LINT_MAX, sizeof(struct lint_item));
    list.nodes =
        arena_array(arena, scene->object_count, sizeof(const struct json *));
    *items = list.items;
    if (list.items == NULL || list.nodes == NULL)
        return 0;
    collect_nodes(&list, json_member(root, "objects"), &at);
    if (scene->default_light)
        lint_add(&list, root, "lights.default_used",
                 "the document has no `lights`: one directional light is used");
    lint_bounces(&list);
    lint_inside(&list);
    lint_unused(&list);
    lint_emission(&list);
    for (uint32_t i = 0; i < scene->object_count; i++) {
        lint_uv(&list, &scene->objects[i], list.nodes[i]);
        lint_plane(&list, list.nodes[i]);
        lint_mesh(&list, &scene->objects[i], list.nodes[i]);
    }
    sort(&list);
    return list.count;
}
