#include "core/trace/camera.h"

#include "core/scene/vec.h"

void
camera_prepare(const struct scene *scene, struct camera *camera)
{
    const struct scene_camera *c = &scene->camera;
    double wide = (c->right - c->left) / (double)scene->width;
    double high = (c->top - c->bottom) / (double)scene->height;
    double ahead = c->kind == CAMERA_PERSPECTIVE ? c->distance : 0.0;
    camera->kind = c->kind;
    for (int k = 0; k < 3; k++) {
        camera->eye[k] = (float)c->eye[k];
        camera->corner[k] =
            (float)(c->left * c->u[k] + c->top * c->v[k] - ahead * c->w[k]);
        camera->right[k] = (float)(wide * c->u[k]);
        camera->down[k] = (float)(-high * c->v[k]);
        camera->forward[k] = (float)-c->w[k];
    }
}

void
camera_rays(const struct camera *camera, uint32_t n, const float *restrict x,
            const float *restrict y, struct rays *restrict rays)
{
    struct camera c = *camera;
    uint32_t padded = lanes_up(n);
    rays->count = n;
    if (c.kind == CAMERA_ORTHOGRAPHIC) {
        for (int k = 0; k < 3; k++)
            for (uint32_t i = 0; i < padded; i++) {
                rays->o[k][i] =
                    c.eye[k] +
                    madd(y[i], c.down[k], madd(x[i], c.right[k], c.corner[k]));
                rays->d[k][i] = c.forward[k];
            }
        return;
    }
    for (uint32_t i = 0; i < padded; i++) {
        float a = madd(y[i], c.down[0], madd(x[i], c.right[0], c.corner[0]));
        float b = madd(y[i], c.down[1], madd(x[i], c.right[1], c.corner[1]));
        float e = madd(y[i], c.down[2], madd(x[i], c.right[2], c.corner[2]));
        float s = 1.0f / __builtin_sqrtf(dot3(a, b, e, a, b, e));
        rays->o[0][i] = c.eye[0];
        rays->o[1][i] = c.eye[1];
        rays->o[2][i] = c.eye[2];
        rays->d[0][i] = a * s;
        rays->d[1][i] = b * s;
        rays->d[2][i] = e * s;
    }
}
