/* Likely mistakes inside a mesh or a free triangle. */
#include "core/scene/lint_list.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/scene/transform.h"

static const struct json *
entry(const struct json *array, uint32_t index)
{
    const struct json *n = array->child;
    while (index-- > 0)
        n = n->next;
    return n;
}

static const char *
more(struct lint_list *list, uint32_t count)
{
    const char *text =
        count > 1 ? arena_printf(list->arena, ", and %u more", count - 1) : "";
    return text != NULL ? text : "";
}

/* No area: the corners lie on one line, as far as doubles can tell. */
static bool
is_flat(const double a[3], const double b[3], const double c[3])
{
    double u[3], v[3], normal[3];
    for (int i = 0; i < 3; i++) {
        u[i] = b[i] - a[i];
        v[i] = c[i] - a[i];
    }
    if (vector_length(u) == 0 || vector_length(v) == 0)
        return true;
    vector_unit(u, u);
    vector_unit(v, v);
    vector_cross(u, v, normal);
    return vector_length(normal) < 1e-12;
}

static void
corner(const struct scene_mesh *mesh, uint32_t index, double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = (double)mesh->positions[3 * index + (uint32_t)i];
}

static void
lint_area(struct lint_list *list, const struct scene_mesh *mesh,
          const struct json *indices)
{
    uint32_t first = 0, count = 0;
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        double a[3], b[3], c[3];
        corner(mesh, mesh->indices[3 * t], a);
        corner(mesh, mesh->indices[3 * t + 1], b);
        corner(mesh, mesh->indices[3 * t + 2], c);
        if (is_flat(a, b, c) && count++ == 0)
            first = t;
    }
    if (count > 0)
        lint_add(list, entry(indices, first), "triangle.degenerate",
                 "triangle %u has no area%s", first, more(list, count));
}

/* --- equal vertices ------------------------------------------------------------ */

struct vertex {
    float values[8]; /* position, normal, uv; zeros where there is none */
    uint32_t index;
};

static int
compare_vertex(const void *left, const void *right)
{
    const struct vertex *a = left, *b = right;
    for (int i = 0; i < 8; i++) {
        if (a->values[i] < b->values[i])
            return -1;
        if (a->values[i] > b->values[i])
            return 1;
    }
    return a->index < b->index ? -1 : 1;
}

static bool
same_vertex(const struct vertex *a, const struct vertex *b)
{
    for (int i = 0; i < 8; i++) {
        if (a->values[i] < b->values[i] || a->values[i] > b->values[i])
            return false;
    }
    return true;
}

static void
lint_duplicates(struct lint_list *list, const struct scene_mesh *mesh,
                const struct json *positions)
{
    uint32_t n = mesh->position_count, count = 0;
    uint32_t later = UINT32_MAX, first = 0;
    struct vertex *v = arena_array(list->arena, n, sizeof *v);
    if (v == NULL)
        return;
    for (uint32_t i = 0; i < n; i++) {
        memcpy(v[i].values, mesh->positions + 3 * i, 3 * sizeof(float));
        if (mesh->normals != NULL)
            memcpy(v[i].values + 3, mesh->normals + 3 * i, 3 * sizeof(float));
        if (mesh->uvs != NULL)
            memcpy(v[i].values + 6, mesh->uvs + 2 * i, 2 * sizeof(float));
        v[i].index = i;
    }
    qsort(v, n, sizeof *v, compare_vertex);
    for (uint32_t i = 1, run = 0; i < n; i++) {
        if (!same_vertex(&v[run], &v[i])) {
            run = i;
            continue;
        }
        count++;
        if (v[i].index < later) {
            later = v[i].index;
            first = v[run].index;
        }
    }
    if (count > 0)
        lint_add(list, entry(positions, later), "mesh.duplicate_vertex",
                 "position %u equals position %u%s", later, first,
                 more(list, count));
}

/* --- winding --------------------------------------------------------------------- */

/* An edge in the direction its triangle walks it. Two neighbours that agree
 * about the outside walk their common edge in opposite directions. */
struct edge {
    uint32_t from, to, triangle;
};

static int
compare_edge(const void *left, const void *right)
{
    const struct edge *a = left, *b = right;
    if (a->from != b->from)
        return a->from < b->from ? -1 : 1;
    if (a->to != b->to)
        return a->to < b->to ? -1 : 1;
    return a->triangle < b->triangle ? -1 : 1;
}

static void
lint_winding(struct lint_list *list, const struct scene_mesh *mesh,
             const struct json *indices)
{
    uint32_t n = mesh->triangle_count * 3, count = 0;
    uint32_t later = UINT32_MAX, first = 0;
    struct edge *edges = arena_array(list->arena, n, sizeof *edges);
    if (edges == NULL)
        return;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t t = i / 3;
        edges[i] = (struct edge){mesh->indices[i],
                                 mesh->indices[3 * t + (i + 1) % 3], t};
    }
    qsort(edges, n, sizeof *edges, compare_edge);
    for (uint32_t i = 1; i < n; i++) {
        const struct edge *a = &edges[i - 1], *b = &edges[i];
        if (a->from != b->from || a->to != b->to || a->from == a->to)
            continue;
        count++;
        if (b->triangle < later) {
            later = b->triangle;
            first = a->triangle;
        }
    }
    if (count > 0)
        lint_add(list, entry(indices, later), "mesh.winding",
                 "triangles %u and %u share an edge, but face opposite "
                 "sides%s",
                 first, later, more(list, count));
}

void
lint_mesh(struct lint_list *list, const struct scene_object *object,
          const struct json *node)
{
    if (object->kind == SHAPE_TRIANGLE) {
        const struct shape_triangle *t = &object->shape.triangle;
        if (is_flat(t->vertices[0], t->vertices[1], t->vertices[2]))
            lint_add(list, json_member(node, "vertices"), "triangle.degenerate",
                     "the triangle has no area");
    } else if (object->kind == SHAPE_MESH) {
        const struct scene_mesh *mesh =
            &list->scene->meshes[object->shape.mesh.mesh];
        const struct json *indices = json_member(node, "indices");
        lint_area(list, mesh, indices);
        lint_duplicates(list, mesh, json_member(node, "positions"));
        lint_winding(list, mesh, indices);
    }
}
