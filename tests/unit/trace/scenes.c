#include "scenes.h"

#include <math.h>
#include <string.h>

#include "core/base/must.h"

static void
unit(double v[3])
{
    double n = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int k = 0; k < 3; k++)
        v[k] /= n;
}

static void
cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

void
built_look(struct built *built, const double eye[3], const double target[3],
           const double up[3], double fov_deg)
{
    struct scene_camera *c = &built->scene.camera;
    for (int k = 0; k < 3; k++) {
        c->eye[k] = eye[k];
        c->w[k] = eye[k] - target[k];
    }
    unit(c->w);
    cross(up, c->w, c->u);
    unit(c->u);
    cross(c->w, c->u, c->v);
    c->kind = CAMERA_PERSPECTIVE;
    c->distance = 1.0;
    c->top = tan(fov_deg * 3.14159265358979323846 / 360.0);
    c->bottom = -c->top;
    c->right = c->top * built->scene.width / built->scene.height;
    c->left = -c->right;
}

void
built_size(struct built *built, uint32_t width, uint32_t height)
{
    struct scene_camera *c = &built->scene.camera;
    built->scene.width = width;
    built->scene.height = height;
    c->right = c->top * width / height;
    c->left = -c->right;
}

void
built_start(struct built *built, uint32_t objects_max)
{
    const double eye[3] = {0, 0, 5}, target[3] = {0, 0, 0}, up[3] = {0, 1, 0};
    const double grey[3] = {0.8, 0.8, 0.8}, black[3] = {0, 0, 0};
    memset(built, 0, sizeof *built);
    arena_init(&built->arena, 0);
    struct scene *s = &built->scene;
    s->arena = &built->arena;
    s->width = 64;
    s->height = 48;
    built_look(built, eye, target, up, 45);
    s->sampler.spp = 1;
    s->integrator.max_bounces = 4;
    for (int k = 0; k < 3; k++)
        s->integrator.ambient[k] = 0.1;
    s->integrator.shadows = SHADOWS_SOFT;
    s->integrator.fresnel_exponent = 2.0;
    s->integrator.inside_hits = true;
    s->integrator.ray_offset = 1e-4;
    built->objects_max = objects_max;
    s->objects = arena_array(&built->arena, objects_max, sizeof *s->objects);
    s->materials =
        arena_array(&built->arena, SCENE_PARTS_MAX, sizeof *s->materials);
    s->textures =
        arena_array(&built->arena, SCENE_PARTS_MAX, sizeof *s->textures);
    s->lights = arena_array(&built->arena, SCENE_PARTS_MAX, sizeof *s->lights);
    s->meshes = arena_array(&built->arena, SCENE_PARTS_MAX, sizeof *s->meshes);
    built_material(built, MATERIAL_LAMBERT, grey, black, 0, black);
}

void
built_clear(struct built *built)
{
    arena_clear(&built->arena);
}

static void
paint_set(struct paint *p, const double color[3])
{
    memcpy(p->color, color, sizeof p->color);
    p->texture = SCENE_NONE;
}

int32_t
built_material(struct built *built, enum material_kind kind,
               const double diffuse[3], const double specular[3],
               double shininess, const double mirror[3])
{
    const double black[3] = {0, 0, 0};
    MUST(built->scene.material_count < SCENE_PARTS_MAX);
    struct scene_material *m =
        &built->scene.materials[built->scene.material_count];
    m->kind = kind;
    paint_set(&m->diffuse, diffuse);
    paint_set(&m->ambient, diffuse);
    paint_set(&m->specular, specular);
    paint_set(&m->mirror, mirror);
    paint_set(&m->emission, black);
    m->shininess = shininess;
    return (int32_t)built->scene.material_count++;
}

int32_t
built_checker(struct built *built, enum mapping mapping, double color0,
              double color1)
{
    MUST(built->scene.texture_count < SCENE_PARTS_MAX);
    struct scene_texture *t =
        &built->scene.textures[built->scene.texture_count];
    t->kind = TEXTURE_CHECKERBOARD;
    t->mapping = mapping;
    for (int k = 0; k < 3; k++) {
        t->scale[k] = 1.0;
        t->color0[k] = color0;
        t->color1[k] = color1;
    }
    return (int32_t)built->scene.texture_count++;
}

uint32_t
built_light(struct built *built, enum light_kind kind, double x, double y,
            double z, double intensity)
{
    MUST(built->scene.light_count < SCENE_PARTS_MAX);
    struct scene_light *l = &built->scene.lights[built->scene.light_count];
    double v[3] = {x, y, z};
    l->kind = kind;
    for (int k = 0; k < 3; k++)
        l->intensity[k] = intensity;
    memcpy(l->position, v, sizeof v);
    if (kind == LIGHT_DIRECTIONAL) {
        unit(v);
        memcpy(l->to_light, v, sizeof v);
    }
    l->half_size = 0.5;
    l->samples = 4;
    return built->scene.light_count++;
}

struct scene_object *
built_object(struct built *built, enum shape_kind kind, int32_t material)
{
    MUST(built->scene.object_count < built->objects_max);
    struct scene_object *o = &built->scene.objects[built->scene.object_count++];
    o->kind = kind;
    o->pointer = "";
    o->material = material;
    o->visible = VISIBLE_CAMERA | VISIBLE_SHADOW | VISIBLE_REFLECTION;
    o->to_world[0] = o->to_world[5] = o->to_world[10] = 1.0;
    return o;
}

struct scene_object *
built_sphere(struct built *built, int32_t material, double x, double y,
             double z, double radius)
{
    struct scene_object *o = built_object(built, SHAPE_SPHERE, material);
    o->shape.sphere = (struct shape_sphere){{x, y, z}, radius};
    return o;
}

struct scene_object *
built_box(struct built *built, int32_t material, double x0, double y0,
          double z0, double x1, double y1, double z1)
{
    struct scene_object *o = built_object(built, SHAPE_BOX, material);
    o->shape.box = (struct shape_box){{x0, y0, z0}, {x1, y1, z1}};
    return o;
}

struct scene_object *
built_plane(struct built *built, int32_t material, double nx, double ny,
            double nz, double offset)
{
    struct scene_object *o = built_object(built, SHAPE_PLANE, material);
    double n[3] = {nx, ny, nz};
    unit(n);
    o->shape.plane = (struct shape_plane){{n[0], n[1], n[2]}, offset};
    return o;
}

struct scene_object *
built_triangle(struct built *built, int32_t material, const double a[3],
               const double b[3], const double c[3])
{
    struct scene_object *o = built_object(built, SHAPE_TRIANGLE, material);
    memcpy(o->shape.triangle.vertices[0], a, 3 * sizeof(double));
    memcpy(o->shape.triangle.vertices[1], b, 3 * sizeof(double));
    memcpy(o->shape.triangle.vertices[2], c, 3 * sizeof(double));
    built->scene.triangle_count++;
    return o;
}

struct scene_object *
built_quad(struct built *built, int32_t material, const double origin[3],
           const double u[3], const double v[3])
{
    struct scene_object *o = built_object(built, SHAPE_QUAD, material);
    memcpy(o->shape.quad.origin, origin, 3 * sizeof(double));
    memcpy(o->shape.quad.edge_u, u, 3 * sizeof(double));
    memcpy(o->shape.quad.edge_v, v, 3 * sizeof(double));
    return o;
}

struct scene_object *
built_mesh(struct built *built, int32_t material, const float *positions,
           const float *normals, uint32_t position_count,
           const uint32_t *indices, uint32_t triangle_count)
{
    struct scene_object *o = built_object(built, SHAPE_MESH, material);
    MUST(built->scene.mesh_count < SCENE_PARTS_MAX);
    struct scene_mesh *m = &built->scene.meshes[built->scene.mesh_count];
    size_t bytes = (size_t)position_count * 3 * sizeof(float);
    o->shape.mesh.mesh = built->scene.mesh_count++;
    o->shape.mesh.smooth = normals != NULL;
    m->position_count = position_count;
    m->triangle_count = triangle_count;
    m->positions = arena_alloc(&built->arena, bytes);
    m->indices = arena_alloc(&built->arena, (size_t)triangle_count * 12);
    memcpy(m->positions, positions, bytes);
    memcpy(m->indices, indices, (size_t)triangle_count * 12);
    if (normals != NULL) {
        m->normals = arena_alloc(&built->arena, bytes);
        memcpy(m->normals, normals, bytes);
    }
    built->scene.triangle_count += triangle_count;
    return o;
}

void
built_transform(struct scene_object *object, const double matrix[12])
{
    object->transformed = true;
    memcpy(object->to_world, matrix, 12 * sizeof(double));
}

void
built_table(struct built *built, enum accumulation accumulation, uint32_t width,
            uint32_t height, uint32_t bounces)
{
    const double eye[3] = {10, 6, 12}, target[3] = {1, 1.5, 0},
                 up[3] = {0, 1, 0};
    const double one[3] = {1, 1, 1}, none[3] = {0, 0, 0};
    const double colors[6][3] = {{1, 0, 0}, {0, 1, 0}, {1, 0, 1},
                                 {1, 1, 0}, {0, 0, 1}, {0, 0, 0}};
    int32_t m[6];
    built_start(built, 16);
    built->scene.width = width;
    built->scene.height = height;
    built_look(built, eye, target, up, 45);
    struct scene_integrator *g = &built->scene.integrator;
    g->accumulation = accumulation;
    g->max_bounces = bounces;
    g->clamp_local = 1.0;
    g->inside_hits = false;
    for (int k = 0; k < 3; k++)
        g->ambient[k] = 0.3;
    for (int i = 0; i < 6; i++)
        m[i] = built_material(built, MATERIAL_BLINN_PHONG, colors[i], one, 50,
                              none);
    struct scene_material *floor = &built->scene.materials[m[5]];
    floor->diffuse.texture = built_checker(built, MAPPING_WORLD_XZ, 0.15, 0.65);
    floor->ambient.texture = floor->diffuse.texture;
    built_light(built, LIGHT_POINT, 6, 9, 6, 1);
    built_sphere(built, m[0], 1, 2, 5, 2);
    built_sphere(built, m[1], 5, 1, 2, 1);
    built_sphere(built, m[2], 5, 2.8, 1, 0.6);
    built_plane(built, m[5], 0, 1, 0, 0);
    built_box(built, m[3], 0, 3, 0, 1, 4, 1);
    built_box(built, m[4], -2, 1.65, -2, 2, 1.8, 2);
    built_box(built, m[4], -1.9, 0, -1.9, -1.6, 1.65, -1.6);
    built_box(built, m[4], -1.9, 0, 1.6, -1.6, 1.65, 1.9);
    built_box(built, m[4], 1.6, 0, 1.6, 1.9, 1.65, 1.9);
    built_box(built, m[4], 1.6, 0, -1.9, 1.9, 1.65, -1.6);
}

/* v turned by `angle` around the unit axis. */
static void
turn(const double axis[3], double angle, const double v[3], double out[3])
{
    double c = cos(angle), s = sin(angle), x[3];
    double along = axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2];
    cross(axis, v, x);
    for (int k = 0; k < 3; k++)
        out[k] = v[k] * c + x[k] * s + axis[k] * along * (1 - c);
}

static void
flake(struct built *built, int32_t material, unsigned level, const double c[3],
      double r, const double direction[3], const double directions[9][3])
{
    built_sphere(built, material, c[0], c[1], c[2], r);
    if (level == 0)
        return;
    double axis[3] = {-direction[1], direction[0], 0}, angle = 0;
    double z = direction[2];
    if (z >= 1 - 1e-12) {
        axis[0] = 1;
        axis[1] = 0;
    } else if (z <= -1 + 1e-12) {
        axis[0] = 0;
        axis[1] = 1;
        angle = 3.14159265358979323846;
    } else {
        unit(axis);
        angle = acos(z);
    }
    for (int i = 0; i < 9; i++) {
        double v[3], p[3];
        turn(axis, angle, directions[i], v);
        for (int k = 0; k < 3; k++)
            p[k] = c[k] + v[k] * (r + r / 3);
        flake(built, material, level - 1, p, r / 3, v, directions);
    }
}

void
built_sphereflake(struct built *built, unsigned level, uint32_t size)
{
    const double eye[3] = {2.1, 1.3, 1.7}, target[3] = {0, 0, 0},
                 up[3] = {0, 0, 1};
    const double pi = 3.14159265358979323846, d = 1 / sqrt(2);
    const double triple[3][3] = {{d, d, 0}, {d, 0, -d}, {0, d, -d}};
    double tilt_axis[3] = {1, -1, 0}, tilt = asin(2 / sqrt(6));
    const double z[3] = {0, 0, 1}, origin[3] = {0, 0, 0};
    double directions[9][3];
    const double ball[3] = {0.5, 0.45, 0.35}, shine[3] = {0.5, 0.5, 0.5};
    const double ground[3] = {0.8, 0.6, 0.264}, none[3] = {0, 0, 0};
    uint32_t count = 1, power = 1;
    for (unsigned i = 0; i < level; i++) {
        power *= 9;
        count += power;
    }
    built_start(built, count + 1);
    built->scene.width = built->scene.height = size;
    built_look(built, eye, target, up, 45);
    built->scene.integrator.max_bounces = 5;
    for (int k = 0; k < 3; k++)
        built->scene.integrator.ambient[k] = 0;
    built->scene.background.color[0] = 0.078;
    built->scene.background.color[1] = 0.361;
    built->scene.background.color[2] = 0.753;
    built_light(built, LIGHT_POINT, 4, 3, 2, 0.57735);
    built_light(built, LIGHT_POINT, 1, -4, 4, 0.57735);
    built_light(built, LIGHT_POINT, -3, 1, 5, 0.57735);
    int32_t balls =
        built_material(built, MATERIAL_BLINN_PHONG, ball, shine, 45, shine);
    int32_t floor =
        built_material(built, MATERIAL_LAMBERT, ground, none, 0, none);
    unit(tilt_axis);
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++) {
            double v[3];
            turn(tilt_axis, tilt, triple[i], v);
            turn(z, k * 2 * pi / 3, v, directions[3 * k + i]);
        }
    flake(built, balls, level, origin, 0.5, z, (const double(*)[3])directions);
    const double corner[3] = {-12, -12, -0.5}, u[3] = {24, 0, 0},
                 v[3] = {0, 24, 0};
    built_quad(built, floor, corner, u, v);
}

double
dice_unit(struct dice *dice)
{
    dice->state = dice->state * 6364136223846793005u + 1442695040888963407u;
    uint64_t x = dice->state;
    x ^= x >> 33;
    x *= 0xff51afd7ed558ccdu;
    x ^= x >> 33;
    return (double)(x >> 11) * 0x1p-53;
}

double
dice_range(struct dice *dice, double lo, double hi)
{
    return lo + (hi - lo) * dice_unit(dice);
}

static void
random_object(struct built *built, struct dice *d, int32_t material)
{
    double p[3][3];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            p[i][k] = dice_range(d, -2, 2);
    struct scene_object *o;
    switch ((int)dice_range(d, 0, 5)) {
    case 0:
        o = built_sphere(built, material, p[0][0], p[0][1], p[0][2],
                         dice_range(d, 0.1, 0.9));
        break;
    case 1:
        o = built_box(built, material, p[0][0], p[0][1], p[0][2],
                      p[0][0] + dice_range(d, 0.1, 1),
                      p[0][1] + dice_range(d, 0.1, 1),
                      p[0][2] + dice_range(d, 0.1, 1));
        break;
    case 2: o = built_triangle(built, material, p[0], p[1], p[2]); break;
    case 3: o = built_quad(built, material, p[0], p[1], p[2]); break;
    default:
        o = built_plane(built, material, p[0][0], p[0][1], p[0][2],
                        dice_range(d, -4, -2));
    }
    if (dice_unit(d) < 0.4) {
        double m[12];
        for (int k = 0; k < 12; k++)
            m[k] = (k % 5 == 0 ? 1.0 : 0.0) + dice_range(d, -0.4, 0.4);
        built_transform(o, m);
    }
    o->visible = 1u | (unsigned)dice_range(d, 0, 8);
}

void
built_random(struct built *built, uint64_t seed, uint32_t objects)
{
    struct dice d = {seed};
    built_start(built, objects + 1);
    struct scene *s = &built->scene;
    int32_t texture = built_checker(
        built, (enum mapping)dice_range(&d, 0, MAPPING_OBJECT_XYZ + 1), 0.1,
        0.9);
    for (int i = 0; i < 6; i++) {
        double c[3][3];
        for (int j = 0; j < 9; j++)
            c[j / 3][j % 3] = dice_unit(&d);
        int32_t m =
            built_material(built, (enum material_kind)dice_range(&d, 0, 4),
                           c[0], c[1], dice_range(&d, 0, 200), c[2]);
        if (dice_unit(&d) < 0.4)
            s->materials[m].diffuse.texture = texture;
        if (dice_unit(&d) < 0.4)
            s->materials[m].ambient.texture = texture;
    }
    for (uint32_t i = 0; i < objects; i++)
        random_object(built, &d, (int32_t)dice_range(&d, 0, s->material_count));
    const float positions[] = {-3, -1, -1, 3, -1, -1, 0, 3, -2, 0, -2, 2};
    const uint32_t indices[] = {0, 1, 2, 0, 3, 1, 1, 3, 2, 2, 3, 0};
    if (dice_unit(&d) < 0.5)
        built_mesh(built, 0, positions, NULL, 4, indices, 4);
    for (int i = 0; i < 3; i++) {
        uint32_t l = built_light(
            built, (enum light_kind)dice_range(&d, 0, LIGHT_AREA_GRID + 1),
            dice_range(&d, -5, 5), dice_range(&d, 1, 5), dice_range(&d, -5, 5),
            dice_range(&d, 0.1, 2));
        s->lights[l].inverse_square = dice_unit(&d) < 0.5;
        s->lights[l].samples = 1 + (uint32_t)dice_range(&d, 0, 4);
        s->lights[l].loop_float32 = dice_unit(&d) < 0.5;
    }
    s->background.kind =
        dice_unit(&d) < 0.5 ? BACKGROUND_CONSTANT : BACKGROUND_GRADIENT;
    s->background.color[0] = dice_unit(&d);
    s->background.top[2] = dice_unit(&d);
    s->integrator.inside_hits = dice_unit(&d) < 0.5;
    s->integrator.max_bounces = (uint32_t)dice_range(&d, 0, 6);
}
