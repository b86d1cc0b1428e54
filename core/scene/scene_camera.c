/* Relations of camera, film, sampler, background and integrator. */
#include "core/scene/scene_reader.h"

#include <math.h>

#include "core/scene/angle.h"
#include "core/scene/transform.h"

/* --- camera -------------------------------------------------------------------- */

/* Default or given, good or bad: a point to reason with. */
static bool
view_vector(const struct json *camera, const char *key, double x, double y,
            double z, double out[3])
{
    out[0] = x, out[1] = y, out[2] = z;
    return json_member(camera, key) == NULL || numbers_of(camera, key, 3, out);
}

/* The value that SCENE section 8 names for a camera that cannot look. */
static const struct json *
blamed(const struct json *camera, bool parallel)
{
    const struct json *up = json_member(camera, "up");
    const struct json *point =
        later_of(json_member(camera, "eye"), json_member(camera, "target"));
    if (parallel && up != NULL)
        return up;
    return point != NULL ? point : camera;
}

static void
check_frame(struct reader *r, const struct json *camera)
{
    double eye[3], target[3], up[3], view[3], side[3];
    if (camera == NULL || !view_vector(camera, "eye", 0, 0, 5, eye) ||
        !view_vector(camera, "target", 0, 0, 0, target) ||
        !view_vector(camera, "up", 0, 1, 0, up))
        return;
    for (int i = 0; i < 3; i++)
        view[i] = eye[i] - target[i];
    if (vector_length(view) == 0) {
        fault(r, ERROR_CAMERA_DEGENERATE, blamed(camera, false),
              "move one of them", NULL,
              "`eye` and `target` are the same point");
        return;
    }
    if (vector_length(up) == 0)
        return; /* vector.zero was said */
    vector_unit(view, view);
    vector_unit(up, up);
    vector_cross(up, view, side);
    if (vector_length(side) < 1e-9)
        fault(r, ERROR_CAMERA_DEGENERATE, blamed(camera, true),
              "for a view straight up or down take `up` [0, 0, -1]", NULL,
              "`up` is parallel to the view direction");
}

static void
check_window(struct reader *r, const struct json *camera)
{
    double w[4];
    const struct json *window = json_member(camera, "window");
    if (!numbers_of(camera, "window", 4, w))
        return;
    if (w[0] >= w[1])
        fault(r, ERROR_GEOMETRY_DEGENERATE, window,
              "the window is [left, right, bottom, top]", NULL,
              "left %s is not less than right %s", number_said(r, w[0]),
              number_said(r, w[1]));
    else if (w[2] >= w[3])
        fault(r, ERROR_GEOMETRY_DEGENERATE, window,
              "the window is [left, right, bottom, top]", NULL,
              "bottom %s is not less than top %s", number_said(r, w[2]),
              number_said(r, w[3]));
}

void
check_perspective(struct reader *r, const struct json *object, void *to)
{
    static const char *const names[] = {"fov", "focal_length", "window"};
    const struct json *first = check_one_of(r, object, names, COUNT_OF(names));
    const struct json *distance = json_member(object, "distance");
    (void)to;
    if (distance != NULL && json_member(object, "window") == NULL) {
        const struct json *later = later_of(first, distance);
        if (first != NULL)
            fault(r, ERROR_PROPERTY_CONFLICT, later,
                  "`distance` belongs to `window`", fix_remove(r, later),
                  "give `%s` or `distance`, not both", first->key);
        else
            fault(r, ERROR_PROPERTY_MISSING, object,
                  "add `window` [left, right, bottom, top]", NULL,
                  "a camera with `distance` needs `window`");
    }
    check_window(r, object);
    check_frame(r, object);
}

void
check_orthographic(struct reader *r, const struct json *object, void *to)
{
    static const char *const names[] = {"height", "window"};
    (void)to;
    check_one_of(r, object, names, COUNT_OF(names));
    check_window(r, object);
    check_frame(r, object);
}

void
finish_camera_fields(struct reader *r, const struct json *object,
                     const struct kind *kind, void *to)
{
    (void)object;
    if (!kind->ready)
        return;
    r->camera = *(const struct camera_fields *)to;
    r->scene->camera.kind = (enum camera_kind)kind->value;
}

/* The image plane spans 2 half_x by 2 half_y, the eye in its middle. */
static void
set_window(struct scene_camera *camera, double half_x, double half_y,
           double distance)
{
    camera->left = -half_x;
    camera->right = half_x;
    camera->bottom = -half_y;
    camera->top = half_y;
    camera->distance = distance;
}

/* Every form of camera becomes a window (SCENE section 5); the film's shape is
 * known by now. */
void
finish_camera(struct reader *r)
{
    const struct camera_fields *c = &r->camera;
    struct scene_camera *out = &r->scene->camera;
    double aspect = (double)r->scene->width / r->scene->height;
    bool has_window = c->window[0] < c->window[1];
    double s, k;

    for (int i = 0; i < 3; i++) {
        out->eye[i] = c->eye[i];
        out->w[i] = c->eye[i] - c->target[i];
    }
    vector_unit(out->w, out->w);
    double up[3];
    vector_unit(c->up, up);
    vector_cross(up, out->w, out->u);
    vector_unit(out->u, out->u);
    vector_cross(out->w, out->u, out->v);

    if (has_window) {
        out->left = c->window[0];
        out->right = c->window[1];
        out->bottom = c->window[2];
        out->top = c->window[3];
        out->distance = c->distance;
    } else if (out->kind == CAMERA_ORTHOGRAPHIC) {
        set_window(out, c->height / 2 * aspect, c->height / 2, 0);
    } else if (c->focal_length > 0) {
        set_window(out, aspect, 1, c->focal_length);
    } else {
        angle_sin_cos(c->fov / 2, &s, &k);
        if (c->fov_axis == 1)
            set_window(out, s / k * aspect, s / k, 1);
        else
            set_window(out, s / k, s / k / aspect, 1);
    }
}

/* --- film and sampler -------------------------------------------------------------- */

void
check_filter(struct reader *r, const struct json *object, void *to)
{
    const struct json *radius = json_member(object, "radius");
    (void)to;
    const char *type = text_of(object, "type");
    if (radius != NULL && radius->type == JSON_NUMBER && radius->number > 0.5 &&
        radius->number <= 4 &&
        (type == NULL || is_text(json_member(object, "type"), "box")))
        fault_not_yet(r, ERROR_PROPERTY_NOT_YET, radius,
                      "a box wider than a pixel", "leave it at 0.5 for now");
}

void
check_film(struct reader *r, const struct json *object, void *to)
{
    double width = 640, height = 360;
    const struct json *w = json_member(object, "width");
    const struct json *h = json_member(object, "height");
    (void)to;
    if ((w != NULL && !number_of(object, "width", &width)) ||
        (h != NULL && !number_of(object, "height", &height)) ||
        !(width >= 1 && height >= 1 && width < 1e12 && height < 1e12))
        return;
    if (width * height > (double)r->limits.max_pixels &&
        (w != NULL || h != NULL))
        fault(r, ERROR_BUDGET_PIXELS, first_of(w, h),
              width <= 8192
                  ? arena_printf(
                        r->arena, "%.0f x %u would fit", width,
                        (unsigned)(r->limits.max_pixels / (uint64_t)width))
                  : "make both smaller",
              NULL, "%s pixels, at most %llu", number_said(r, width * height),
              (unsigned long long)r->limits.max_pixels);
}

void
check_sampler(struct reader *r, const struct json *object, void *to)
{
    const struct scene *scene = to;
    const struct json *type = json_member(object, "type");
    const struct json *spp = json_member(object, "spp");
    double n;
    if (!number_of(object, "spp", &n))
        return;
    if (n > r->limits.max_spp && n <= 65536) {
        fault(r, ERROR_NUMBER_TOO_LARGE, spp, "a limit of this service",
              fix_number(r, spp, r->limits.max_spp),
              "must be at most %u, got %s", r->limits.max_spp,
              number_said(r, n));
        return;
    }
    bool center = type != NULL ? is_text(type, "center")
                               : scene->sampler.kind == SAMPLER_CENTER;
    if (center && n != 1 && n >= 1 && n <= 65536 && is_whole(n))
        fault(r, ERROR_SAMPLER_CENTER_SPP, first_of(type, spp),
              "`stratified` and `sobol` take more", fix_number(r, spp, 1),
              "`center` takes one sample per pixel, got %s", number_said(r, n));
}

/* --- background and integrator -------------------------------------------------------- */

void
finish_background(struct reader *r, const struct json *object,
                  const struct kind *kind, void *to)
{
    (void)object;
    if (!kind->ready)
        return;
    r->scene->background = *(const struct scene_background *)to;
    r->scene->background.kind = (enum background_kind)kind->value;
}

void
check_whitted(struct reader *r, const struct json *object, void *to)
{
    const struct json *fresnel = json_member(object, "fresnel");
    const struct json *accumulation = json_member(object, "accumulation");
    (void)to;
    if (fresnel == NULL || is_text(accumulation, "fresnel_weighted"))
        return;
    fault(r, ERROR_PROPERTY_CONFLICT, fresnel,
          "set `accumulation` to `fresnel_weighted`, or leave `fresnel` out",
          fix_remove(r, fresnel),
          "`fresnel` has no effect without `accumulation` `fresnel_weighted`");
}

void
finish_integrator(struct reader *r, const struct json *object,
                  const struct kind *kind, void *to)
{
    const struct json *bounces = json_member(object, "max_bounces");
    double n;
    if (number_of(object, "max_bounces", &n) && n > r->limits.max_bounces &&
        n <= 64)
        fault(r, ERROR_NUMBER_TOO_LARGE, bounces, "a limit of this service",
              fix_number(r, bounces, r->limits.max_bounces),
              "must be at most %u, got %s", r->limits.max_bounces,
              number_said(r, n));
    if (!kind->ready)
        return;
    r->scene->integrator = *(const struct scene_integrator *)to;
    r->scene->integrator.kind = (enum integrator_kind)kind->value;
}
