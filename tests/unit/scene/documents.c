#include "tests/unit/scene/documents.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/must.h"

const char *
source_root(void)
{
    const char *root = getenv("GLINT_SOURCE");
    return root != NULL ? root : ".";
}

void
document_read(struct document *d, const char *text, size_t len,
              const struct scene_limits *limits)
{
    memset(d, 0, sizeof *d);
    arena_init(&d->arena, 0);
    d->errors.arena = &d->arena;
    d->root = json_read(text, len, NULL, &d->arena, &d->errors);
    d->good = d->root != NULL &&
              scene_read(d->root, limits, &d->arena, &d->scene, &d->errors);
}

void
document_load(struct document *d, const char *path)
{
    char full[4096];
    struct error err = {0};
    struct bytes text = {0};
    snprintf(full, sizeof full, "%s/%s", source_root(), path);
    if (!bytes_read_file(&text, full, 16 * 1024 * 1024, &err)) {
        fprintf(stderr, "%s\n", err.text);
        exit(1);
    }
    document_read(d, text.data, text.len, NULL);
    d->text = text;
}

void
document_quoted(struct document *d, const char *text)
{
    struct bytes copy = {0};
    bytes_text(&copy, text);
    for (size_t i = 0; i < copy.len; i++) {
        if (copy.data[i] == '\'')
            copy.data[i] = '"';
    }
    document_read(d, copy.data, copy.len, NULL);
    d->text = copy;
}

void
document_clear(struct document *d)
{
    bytes_clear(&d->text);
    arena_clear(&d->arena);
}

void
document_errors(const struct document *d, struct bytes *out)
{
    bytes_append(out, "", 0);
    for (size_t i = 0; i < d->errors.count; i++) {
        const struct error_item *e = &d->errors.items[i];
        bytes_printf(out, "%s %s %u:%u\n", error_code_name(e->code),
                     e->pointer != NULL ? e->pointer : "null", e->line,
                     e->column);
    }
}

/* --- dump ---------------------------------------------------------------------------- */

static void
put(struct bytes *out, const char *name, const double *numbers, size_t count)
{
    bytes_printf(out, " %s", name);
    for (size_t i = 0; i < count; i++)
        bytes_printf(out, " %a", numbers[i] + 0.0);
}

static void
put_paint(struct bytes *out, const char *name, const struct paint *paint)
{
    put(out, name, paint->color, 3);
    bytes_printf(out, " texture %d", paint->texture);
}

static const char *
or_none(const char *name)
{
    return name != NULL ? name : "-";
}

static void
put_shape(struct bytes *out, const struct scene_object *o)
{
    switch (o->kind) {
    case SHAPE_SPHERE:
        put(out, "sphere", o->shape.sphere.center, 3);
        put(out, "radius", &o->shape.sphere.radius, 1);
        break;
    case SHAPE_BOX:
        put(out, "box", o->shape.box.min, 3);
        put(out, "max", o->shape.box.max, 3);
        break;
    case SHAPE_PLANE:
        put(out, "plane", o->shape.plane.normal, 3);
        put(out, "offset", &o->shape.plane.offset, 1);
        break;
    case SHAPE_TRIANGLE:
        put(out, "triangle", &o->shape.triangle.vertices[0][0], 9);
        put(out, "normals", &o->shape.triangle.normals[0][0], 9);
        put(out, "uvs", &o->shape.triangle.uvs[0][0], 6);
        bytes_printf(out, " %d %d", o->shape.triangle.has_normals,
                     o->shape.triangle.has_uvs);
        break;
    case SHAPE_QUAD:
        put(out, "quad", o->shape.quad.origin, 3);
        put(out, "u", o->shape.quad.edge_u, 3);
        put(out, "v", o->shape.quad.edge_v, 3);
        break;
    case SHAPE_MESH:
        bytes_printf(out, " mesh %u %d", o->shape.mesh.mesh,
                     o->shape.mesh.smooth);
        break;
    case SHAPE_KIND_COUNT: break;
    }
}

static void
put_mesh(struct bytes *out, const struct scene_mesh *m)
{
    bytes_printf(out, "mesh %u %u", m->position_count, m->triangle_count);
    for (uint32_t i = 0; i < 3 * m->position_count; i++)
        bytes_printf(out, " %a", (double)m->positions[i]);
    for (uint32_t i = 0; m->normals && i < 3 * m->position_count; i++)
        bytes_printf(out, " n%a", (double)m->normals[i]);
    for (uint32_t i = 0; m->uvs && i < 2 * m->position_count; i++)
        bytes_printf(out, " t%a", (double)m->uvs[i]);
    for (uint32_t i = 0; i < 3 * m->triangle_count; i++)
        bytes_printf(out, " %u", m->indices[i]);
    bytes_text(out, "\n");
}

static void
put_view(struct bytes *out, const struct scene *s)
{
    const struct scene_camera *c = &s->camera;
    const struct scene_integrator *i = &s->integrator;
    bytes_printf(out, "%s %u x %u camera %d", or_none(s->name), s->width,
                 s->height, c->kind);
    put(out, "eye", c->eye, 3);
    put(out, "u", c->u, 3);
    put(out, "v", c->v, 3);
    put(out, "w", c->w, 3);
    const double window[] = {c->left, c->right, c->bottom, c->top, c->distance};
    put(out, "window", window, 5);
    bytes_printf(out, "\nsampler %d %u %u integrator %d %u %d %d %d",
                 s->sampler.kind, s->sampler.spp, s->sampler.seed, i->kind,
                 i->max_bounces, i->accumulation, i->shadows, i->inside_hits);
    put(out, "ambient", i->ambient, 3);
    const double rest[] = {i->clamp_local, i->fresnel_bias, i->fresnel_exponent,
                           i->ray_offset};
    put(out, "rest", rest, 4);
    bytes_printf(out, "\nbackground %d", s->background.kind);
    put(out, "color", s->background.color, 3);
    put(out, "top", s->background.top, 3);
    bytes_text(out, "\n");
}

static void
put_surfaces(struct bytes *out, const struct scene *s)
{
    for (uint32_t i = 0; i < s->texture_count; i++) {
        const struct scene_texture *t = &s->textures[i];
        bytes_printf(out, "texture %d %s %d", t->kind, or_none(t->name),
                     t->mapping);
        uint32_t n =
            t->mapping == MAPPING_WORLD_XYZ || t->mapping == MAPPING_OBJECT_XYZ
                ? 3
                : 2;
        put(out, "scale", t->scale, n);
        put(out, "offset", t->offset, n);
        put(out, "color0", t->color0, 3);
        put(out, "color1", t->color1, 3);
        bytes_text(out, "\n");
    }
    for (uint32_t i = 0; i < s->material_count; i++) {
        const struct scene_material *m = &s->materials[i];
        bytes_printf(out, "material %d %s", m->kind, or_none(m->name));
        put_paint(out, "diffuse", &m->diffuse);
        put_paint(out, "ambient", &m->ambient);
        put_paint(out, "specular", &m->specular);
        put_paint(out, "mirror", &m->mirror);
        put_paint(out, "emission", &m->emission);
        put(out, "shininess", &m->shininess, 1);
        bytes_text(out, "\n");
    }
    for (uint32_t i = 0; i < s->light_count; i++) {
        const struct scene_light *l = &s->lights[i];
        bytes_printf(out, "light %d %s %d %u %d", l->kind, or_none(l->name),
                     l->inverse_square, l->samples, l->loop_float32);
        put(out, "intensity", l->intensity, 3);
        put(out, "position", l->position, 3);
        put(out, "to_light", l->to_light, 3);
        put(out, "half_size", &l->half_size, 1);
        bytes_text(out, "\n");
    }
}

void
scene_dump(const struct scene *s, struct bytes *out)
{
    put_view(out, s);
    put_surfaces(out, s);
    for (uint32_t i = 0; i < s->mesh_count; i++)
        put_mesh(out, &s->meshes[i]);
    for (uint32_t i = 0; i < s->object_count; i++) {
        const struct scene_object *o = &s->objects[i];
        bytes_printf(out, "object %s %s material %d visible %u %d",
                     or_none(o->name), o->pointer, o->material, o->visible,
                     o->transformed);
        put(out, "to_world", o->to_world, 12);
        put_shape(out, o);
        bytes_text(out, "\n");
    }
    bytes_printf(out, "triangles %llu\n",
                 (unsigned long long)s->triangle_count);
}

/* --- files ------------------------------------------------------------------------------ */

static int
compare_names(const void *a, const void *b)
{
    return strcmp(*(char *const *)a, *(char *const *)b);
}

size_t
document_list(const char *folder, char **names, size_t most)
{
    char full[4096];
    size_t count = 0;
    snprintf(full, sizeof full, "%s/%s", source_root(), folder);
    DIR *dir = opendir(full);
    MUST(dir != NULL);
    for (struct dirent *e = readdir(dir); e != NULL; e = readdir(dir)) {
        size_t len = strlen(e->d_name);
        if (e->d_name[0] == '.' || len < 6 || count == most ||
            strcmp(e->d_name + len - 5, ".json") != 0)
            continue;
        names[count++] = strdup(e->d_name);
    }
    closedir(dir);
    qsort(names, count, sizeof *names, compare_names);
    return count;
}

/* --- JSON Patch ---------------------------------------------------------------------------- */

static const struct json *
at_pointer(const struct json *node, const char *pointer)
{
    while (*pointer == '/' && node != NULL) {
        char token[256];
        size_t n = 0;
        for (pointer++; *pointer != '\0' && *pointer != '/'; pointer++) {
            char c = *pointer;
            if (c == '~')
                c = *++pointer == '1' ? '/' : '~';
            MUST(n + 1 < sizeof token);
            token[n++] = c;
        }
        token[n] = '\0';
        if (node->type == JSON_OBJECT) {
            node = json_member(node, token);
        } else {
            const struct json *child = node->child;
            for (int i = atoi(token); i > 0 && child != NULL; i--)
                child = child->next;
            node = child;
        }
    }
    return node;
}

/* Byte where a member's name, or an element's value, begins. */
static size_t
start_of(const char *text, const struct json *node)
{
    size_t at = node->begin;
    if (node->key == NULL)
        return at;
    while (text[at] != ':')
        at--;
    while (text[at] != '"')
        at--;
    do
        at--;
    while (text[at] != '"');
    return at;
}

static void
splice(const char *text, size_t len, size_t begin, size_t end, const char *with,
       size_t with_len, struct bytes *out)
{
    bytes_append(out, text, begin);
    bytes_append(out, with, with_len);
    bytes_append(out, text + end, len - end);
}

bool
patch_apply(const char *text, size_t len, const char *patch, struct bytes *out)
{
    struct arena arena;
    bool ok = false;
    arena_init(&arena, 0);
    struct error_list errors = {.arena = &arena};
    const struct json *root = json_read(text, len, NULL, &arena, &errors);
    const struct json *list =
        json_read(patch, strlen(patch), NULL, &arena, &errors);
    if (root == NULL || list == NULL || list->count != 1)
        goto done;
    const struct json *op = list->child;
    const char *name = json_member(op, "op")->string;
    const char *path = json_member(op, "path")->string;
    if (strcmp(name, "replace") == 0) {
        const struct json *node = at_pointer(root, path);
        const struct json *value = json_member(op, "value");
        if (node == NULL)
            goto done;
        splice(text, len, node->begin, node->end, patch + value->begin,
               value->end - value->begin, out);
        ok = true;
    } else if (strcmp(name, "remove") == 0) {
        const struct json *node = at_pointer(root, path);
        if (node == NULL)
            goto done;
        size_t begin = start_of(text, node), end = node->end;
        if (node->next != NULL)
            end = start_of(text, node->next);
        else
            while (begin > 0 && text[begin - 1] != '{' &&
                   text[begin - 1] != '[' && text[begin] != ',')
                begin--;
        splice(text, len, begin, end, "", 0, out);
        ok = true;
    } else if (strcmp(name, "move") == 0) {
        const struct json *node =
            at_pointer(root, json_member(op, "from")->string);
        if (node == NULL)
            goto done;
        const char *key = strrchr(path, '/') + 1;
        size_t begin = start_of(text, node) + 1, end = begin;
        while (text[end] != '"')
            end++;
        splice(text, len, begin, end, key, strlen(key), out);
        ok = true;
    }
done:
    arena_clear(&arena);
    return ok;
}
