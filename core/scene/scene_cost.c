#include "core/scene/scene_cost.h"

/* Until finished jobs tell better: two cores, shadowed lecture scenes. */
#define RAYS_PER_SECOND 20e6

/* Rays toward the lights from one point, as API section 7 counts them: with
 * `none` and `hard` fewer are sent. */
static double
shadow_rays(const struct scene *scene)
{
    double rays = 0;
    for (uint32_t i = 0; i < scene->light_count; i++) {
        const struct scene_light *light = &scene->lights[i];
        rays += light->kind == LIGHT_AREA_GRID
                    ? (double)light->samples * light->samples
                    : 1;
    }
    return rays;
}

static double
mesh_bytes(const struct scene *scene)
{
    double bytes = 0;
    for (uint32_t i = 0; i < scene->mesh_count; i++) {
        const struct scene_mesh *mesh = &scene->meshes[i];
        double per_position = 12.0 + (mesh->normals != NULL ? 12 : 0) +
                              (mesh->uvs != NULL ? 8 : 0);
        /* The indices, and about 60 bytes of tree per triangle. */
        bytes += mesh->position_count * per_position +
                 mesh->triangle_count * (12.0 + 60.0);
    }
    return bytes;
}

struct scene_cost
scene_cost(const struct scene *scene, const struct output *output,
           double rays_per_second)
{
    struct scene_cost cost;
    double pixels = (double)scene->width * scene->height;
    double segments = 1.0 + scene->integrator.max_bounces;
    if (rays_per_second <= 0)
        rays_per_second = RAYS_PER_SECOND;
    cost.rays =
        pixels * scene->sampler.spp * segments * (1 + shadow_rays(scene));
    cost.seconds = cost.rays / rays_per_second;
    /* A worker's base is not counted: it is there before the job. */
    cost.memory_bytes =
        16 * pixels * output->layer_count * 2 + mesh_bytes(scene);
    return cost;
}
