/* Relations between the fields of each shape, and free triangles. */
#include "core/scene/scene_reader.h"

#include <math.h>
#include <string.h>

#include "core/scene/transform.h"

/* geometry.degenerate at the first of two members. */
static void
degenerate(struct reader *r, const struct json *object, const char *a,
           const char *b, const char *hint, const char *detail)
{
    fault(r, ERROR_GEOMETRY_DEGENERATE,
          first_of(json_member(object, a), json_member(object, b)), hint, NULL,
          "%s", detail);
}

void
check_box(struct reader *r, const struct json *object, void *to)
{
    double min[3], max[3];
    (void)to;
    if (!numbers_of(object, "min", 3, min) ||
        !numbers_of(object, "max", 3, max))
        return;
    for (int i = 0; i < 3; i++) {
        if (min[i] < max[i])
            continue;
        fault(r, ERROR_GEOMETRY_DEGENERATE, json_member(object, "min"),
              "`min` is the corner with the smaller coordinates", NULL,
              "min.%c %s is not less than max.%c %s", "xyz"[i],
              number_said(r, min[i]), "xyz"[i], number_said(r, max[i]));
        return;
    }
}

void
check_plane(struct reader *r, const struct json *object, void *to)
{
    static const char *const names[] = {"offset", "point"};
    struct scene_object *made = to;
    struct shape_plane *plane = &made->shape.plane;
    double point[3];
    const struct json *offset = json_member(object, "offset");
    const struct json *normal = json_member(object, "normal");

    check_one_of(r, object, names, COUNT_OF(names));
    double length = vector_length(plane->normal);
    if (length == 0)
        return; /* vector.zero was said */
    vector_unit(plane->normal, plane->normal);
    plane->offset /= length;
    if (numbers_of(object, "point", 3, point))
        plane->offset = vector_dot(plane->normal, point);
    if (offset != NULL && offset->type == JSON_NUMBER &&
        fabs(offset->number) <= 1e6 && fabs(plane->offset) > 1e6)
        fault(r, ERROR_NUMBER_TOO_LARGE, first_of(normal, offset),
              "the equation is divided by the normal's length", NULL,
              "offset / |normal| must be at most 1e6, got %s",
              number_said(r, fabs(plane->offset)));
}

void
check_quad(struct reader *r, const struct json *object, void *to)
{
    double u[3], v[3], normal[3];
    (void)to;
    if (!numbers_of(object, "edge_u", 3, u) ||
        !numbers_of(object, "edge_v", 3, v) || vector_length(u) == 0 ||
        vector_length(v) == 0)
        return;
    vector_unit(u, u);
    vector_unit(v, v);
    vector_cross(u, v, normal);
    if (vector_length(normal) < 1e-9)
        degenerate(r, object, "edge_u", "edge_v", NULL,
                   "`edge_u` and `edge_v` are parallel");
}

void
check_disk(struct reader *r, const struct json *object, void *to)
{
    double inner, radius;
    (void)to;
    if (number_of(object, "inner_radius", &inner) &&
        number_of(object, "radius", &radius) && radius > 0 && inner >= radius)
        degenerate(r, object, "inner_radius", "radius", NULL,
                   "`inner_radius` is not less than `radius`");
}

void
check_axis(struct reader *r, const struct json *object, void *to)
{
    double from[3], end[3];
    (void)to;
    if (numbers_of(object, "from", 3, from) &&
        numbers_of(object, "to", 3, end) && from[0] == end[0] &&
        from[1] == end[1] && from[2] == end[2])
        degenerate(r, object, "from", "to", NULL,
                   "`from` and `to` are the same point");
}

void
check_torus(struct reader *r, const struct json *object, void *to)
{
    double major, minor;
    (void)to;
    if (number_of(object, "major_radius", &major) &&
        number_of(object, "minor_radius", &minor) && major > 0 && minor > 0 &&
        minor >= major)
        degenerate(r, object, "major_radius", "minor_radius", NULL,
                   "`minor_radius` is not less than `major_radius`");
}

/* Three vectors of field->count numbers each, one per corner. */
void
read_vertices(struct reader *r, const struct json *value,
              const struct field *field, void *to)
{
    bool normals = strcmp(field->name, "normals") == 0;
    double numbers[9] = {0};
    double *at = numbers;
    if (value == NULL)
        return;
    if (value->type != JSON_ARRAY) {
        fault_type(r, value, "an array with one entry per corner");
        return;
    }
    if (value->count != 3) {
        fault(r, ERROR_ARRAY_LENGTH, value, NULL, NULL,
              "a triangle has 3 corners, got %u", value->count);
        return;
    }
    for (const struct json *n = value->child; n != NULL; n = n->next) {
        const char *noun = normals             ? "a normal"
                           : field->count == 2 ? "a pair u, v"
                                               : "a point";
        if (read_numbers(r, n, field->count, 1e6, noun, at) && normals &&
            vector_length(at) == 0)
            fault(r, ERROR_VECTOR_ZERO, n, NULL, NULL,
                  "a normal must not be the zero vector");
        at += field->count;
    }
    memcpy((char *)to + field->offset, numbers,
           3 * field->count * sizeof(double));
}

void
check_triangle(struct reader *r, const struct json *object, void *to)
{
    struct scene_object *made = to;
    struct shape_triangle *triangle = &made->shape.triangle;
    (void)r;
    triangle->has_normals = json_member(object, "normals") != NULL;
    triangle->has_uvs = json_member(object, "uvs") != NULL;
    for (int i = 0; i < 3; i++) {
        if (vector_length(triangle->normals[i]) > 0)
            vector_unit(triangle->normals[i], triangle->normals[i]);
    }
}
