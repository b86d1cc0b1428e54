/* whitted.c - local light, shadows and one mirrored ray per hit (SCENE 6.1,
 * 6.2). A batch is followed bounce by bounce; every contribution is a forward
 * product, so nothing has to come back:
 *
 *   recursive         color += weight * local, weight *= mirror
 *   mean              c += local, H += 1
 *   fresnel_weighted  w = (1 - F)(1 - H), c += w * local, H += w
 */
#include <string.h>

#include "core/base/math.h"
#include "core/scene/vec.h"
#include "core/trace/tile.h"

static inline float
at_least_0(float x)
{
    return x > 0.0f ? x : 0.0f;
}

static inline float
absolute(float x)
{
    return __builtin_fabsf(x);
}

static bool
is_course(const struct plan *plan)
{
    return plan->scene->integrator.accumulation != ACCUMULATION_RECURSIVE;
}

/* list = the entries of which some channel is not zero, ascending. */
static uint32_t
list_nonzero(uint32_t n, float color[3][BATCH_MAX], uint32_t *restrict flag,
             uint32_t *restrict list)
{
    const float *restrict r = color[0], *restrict g = color[1],
                          *restrict b = color[2];
    for (uint32_t j = 0; j < lanes_up(n); j++) {
        float sum = absolute(r[j]) + absolute(g[j]) + absolute(b[j]);
        flag[j] = sum > 0.0f ? 1 : 0;
    }
    uint32_t count = 0;
    for (uint32_t j = 0; j < n; j++) {
        list[count] = j;
        count += flag[j];
    }
    return count;
}

/* ---- Misses ---- */

static void
background_color(const struct scene_background *b, float dy, float out[3])
{
    float w = b->kind == BACKGROUND_GRADIENT ? 0.5f * (dy + 1.0f) : 0.0f;
    for (int k = 0; k < 3; k++) {
        float low = (float)b->color[k], high = (float)b->top[k];
        out[k] = b->kind == BACKGROUND_GRADIENT ? low + w * (high - low) : low;
    }
}

/* Rays that left the scene: the background, times their weight. In the course
 * only camera rays see it. */
static void
shade_misses(const struct plan *plan, struct tile *t, uint32_t depth)
{
    const struct scene_background *b = &plan->scene->background;
    bool course = is_course(plan);
    if (course && depth > 0)
        return;
    for (uint32_t i = 0; i < t->rays.count; i++) {
        if (t->hits.object[i] != OBJECT_NONE)
            continue;
        float color[3];
        uint32_t slot = t->slot[i];
        background_color(b, t->rays.d[1][i], color);
        for (int k = 0; k < 3; k++)
            t->color[k][slot] += course ? color[k] : t->weight[k][i] * color[k];
    }
}

/* ---- Data layers ---- */

static void
film_data(const struct tile *t, struct film *film)
{
    const struct surfaces *s = &t->surfaces;
    float *depth = film->layers[LAYER_DEPTH];
    float *normal = film->layers[LAYER_NORMAL];
    float *id = film->layers[LAYER_OBJECT_ID];
    if (depth == NULL && normal == NULL && id == NULL)
        return;
    for (uint32_t j = 0; j < s->count; j++) {
        size_t p = t->pixel[t->live[j]];
        if (depth != NULL)
            depth[p] = s->t[j];
        for (size_t k = 0; normal != NULL && k < 3; k++)
            normal[3 * p + k] = s->n[k][j];
        if (id != NULL)
            id[p] = (float)(s->object[j] + 1);
    }
}

static void
film_albedo(struct tile *t, const struct film *film)
{
    if (film->layers[LAYER_ALBEDO] == NULL)
        return;
    for (int k = 0; k < 3; k++)
        for (uint32_t j = 0; j < t->surfaces.count; j++)
            t->albedo[k][t->live[j]] += t->paints.color[PAINT_DIFFUSE][k][j];
}

/* ---- Local light ---- */

/* recursive: geometric normal against the ray, shading normal with it. */
static void
turn_normals(struct surfaces *s)
{
    uint32_t n = lanes_up(s->count);
    for (uint32_t j = 0; j < n; j++) {
        float across = dot3(s->g[0][j], s->g[1][j], s->g[2][j], s->d[0][j],
                            s->d[1][j], s->d[2][j]);
        float sign = across > 0.0f ? -1.0f : 1.0f;
        s->g[0][j] *= sign;
        s->g[1][j] *= sign;
        s->g[2][j] *= sign;
        s->n[0][j] *= sign;
        s->n[1][j] *= sign;
        s->n[2][j] *= sign;
    }
    /* A shading normal on the other side than the geometric one stays there:
     * turning them together is what SCENE 5 asks. */
}

/* What one light sample adds when nothing is in between: min(A + I falloff (k_d
 * n.l + k_s n.h^p), clamp) - A; without a clamp the middle part alone. */
static void
light_terms(const struct plan *plan, const struct scene_light *light,
            struct tile *t)
{
    const struct surfaces *restrict s = &t->surfaces;
    const struct light_batch *restrict b = &t->light;
    const struct scene_integrator *g = &plan->scene->integrator;
    uint32_t n = lanes_up(s->count);
    float clamp = g->clamp_local > 0.0 ? (float)g->clamp_local : 0.0f;
    bool guarded = !is_course(plan);
    bool shiny = (plan->materials.used >> PAINT_SPECULAR & 1) != 0;
    float *restrict lambert = t->scratch;
    float *restrict highlight = t->sample_x;
    for (uint32_t j = 0; j < n; j++) {
        float lx = b->l[0][j], ly = b->l[1][j], lz = b->l[2][j];
        lambert[j] = dot3(s->n[0][j], s->n[1][j], s->n[2][j], lx, ly, lz);
    }
    for (uint32_t j = 0; shiny && j < n; j++) {
        float hx = b->l[0][j] - s->d[0][j];
        float hy = b->l[1][j] - s->d[1][j];
        float hz = b->l[2][j] - s->d[2][j];
        float squared = dot3(hx, hy, hz, hx, hy, hz);
        float inv = 1.0f / __builtin_sqrtf(squared > 0.0f ? squared : 1.0f);
        float cos_h =
            dot3(s->n[0][j], s->n[1][j], s->n[2][j], hx, hy, hz) * inv;
        float lit = math_powf(at_least_0(cos_h), t->paints.shininess[j]);
        highlight[j] = guarded && lambert[j] <= 0.0f ? 0.0f : lit;
    }
    for (int k = 0; k < 3; k++) {
        float intensity = (float)light->intensity[k];
        const float *restrict kd = t->paints.color[PAINT_DIFFUSE][k];
        const float *restrict ks = t->paints.color[PAINT_SPECULAR][k];
        const float *restrict base = t->base[k];
        float *restrict term = t->term[k];
        for (uint32_t j = 0; j < n; j++) {
            float lit = kd[j] * at_least_0(lambert[j]);
            if (shiny)
                lit = lit + ks[j] * highlight[j];
            lit = intensity * b->falloff[j] * lit;
            float sum = base[j] + lit;
            float clamped = (sum < clamp ? sum : clamp) - base[j];
            term[j] = clamp > 0.0f ? clamped : lit;
        }
    }
}

/* Shadow rays for the surfaces in t->list; a blocked one loses its term. */
static void
shadow_terms(const struct plan *plan, uint32_t count, struct tile *t)
{
    const struct surfaces *restrict s = &t->surfaces;
    const struct light_batch *restrict b = &t->light;
    struct rays *restrict r = &t->shadow;
    float offset = (float)plan->scene->integrator.ray_offset;
    bool course = is_course(plan);
    uint32_t n = lanes_up(count);
    for (uint32_t i = count; i < n; i++)
        t->list[i] = 0;
    LANE_LOOP
    for (uint32_t i = 0; i < n; i++) {
        uint32_t j = t->list[i];
        float lx = b->l[0][j], ly = b->l[1][j], lz = b->l[2][j];
        float px = s->p[0][j], py = s->p[1][j], pz = s->p[2][j];
        float gx = s->g[0][j], gy = s->g[1][j], gz = s->g[2][j];
        float side = dot3(gx, gy, gz, lx, ly, lz) < 0.0f ? -1.0f : 1.0f;
        float big = absolute(px) > absolute(py) ? absolute(px) : absolute(py);
        big = big > absolute(pz) ? big : absolute(pz);
        big = big > 1.0f ? big : 1.0f;
        float by = course ? offset : offset * big * side;
        r->o[0][i] = madd(by, course ? lx : gx, px);
        r->o[1][i] = madd(by, course ? ly : gy, py);
        r->o[2][i] = madd(by, course ? lz : gz, pz);
        r->d[0][i] = lx;
        r->d[1][i] = ly;
        r->d[2][i] = lz;
        r->far[i] = b->distance[j];
    }
    r->count = count;
    accel_occluded(plan->accel, r);
    t->rays_traced[RAYS_SHADOW] += count;
    for (uint32_t i = 0; i < count; i++)
        if (r->far[i] < 0.0f)
            for (int k = 0; k < 3; k++)
                t->term[k][t->list[i]] = 0.0f;
}

static void
add_light(const struct plan *plan, uint32_t index, struct tile *t)
{
    const struct scene_light *light = &plan->lights[index];
    uint32_t positions = plan->light_positions[index];
    uint32_t n = lanes_up(t->surfaces.count);
    for (int k = 0; k < 3; k++)
        memset(t->light_sum[k], 0, n * sizeof(float));
    for (uint32_t position = 0; position < positions; position++) {
        light_table[light->kind](light, position, &t->surfaces, &t->light);
        light_terms(plan, light, t);
        if (plan->scene->integrator.shadows != SHADOWS_NONE) {
            uint32_t count =
                list_nonzero(t->surfaces.count, t->term, t->flag, t->list);
            if (count > 0)
                shadow_terms(plan, count, t);
        }
        for (int k = 0; k < 3; k++)
            for (uint32_t j = 0; j < n; j++)
                t->light_sum[k][j] += t->term[k][j];
    }
    float share = 1.0f / (float)positions;
    for (int k = 0; k < 3; k++)
        for (uint32_t j = 0; j < n; j++)
            t->local[k][j] += share * t->light_sum[k][j];
}

/* t->local = everything a surface sends by itself. */
static void
local_light(const struct plan *plan, struct tile *t)
{
    const struct scene_integrator *g = &plan->scene->integrator;
    uint32_t n = lanes_up(t->surfaces.count);
    bool course = is_course(plan);
    int field = course ? PAINT_DIFFUSE : PAINT_AMBIENT;
    bool glows = !course && (plan->materials.used >> PAINT_EMISSION & 1) != 0;
    for (int k = 0; k < 3; k++) {
        float ambient = (float)g->ambient[k];
        for (uint32_t j = 0; j < n; j++) {
            float base = ambient * t->paints.color[field][k][j];
            t->base[k][j] = base;
            t->local[k][j] = base;
        }
        for (uint32_t j = 0; glows && j < n; j++)
            t->local[k][j] += t->paints.color[PAINT_EMISSION][k][j];
    }
    for (uint32_t i = 0; i < plan->scene->light_count; i++)
        add_light(plan, i, t);
}

/* ---- Accumulation ---- */

static void
accumulate_recursive(struct tile *t)
{
    for (int k = 0; k < 3; k++)
        for (uint32_t j = 0; j < t->surfaces.count; j++) {
            uint32_t i = t->live[j];
            t->color[k][t->slot[i]] += t->weight[k][i] * t->local[k][j];
        }
}

static void
accumulate_course(const struct plan *plan, struct tile *t)
{
    const struct scene_integrator *g = &plan->scene->integrator;
    const struct surfaces *s = &t->surfaces;
    bool fresnel = g->accumulation == ACCUMULATION_FRESNEL_WEIGHTED;
    float bias = (float)g->fresnel_bias, exponent = (float)g->fresnel_exponent;
    float *restrict mirrored = t->scratch;
    uint32_t n = lanes_up(s->count);
    for (uint32_t j = 0; fresnel && j < n; j++) {
        float cos_i = -dot3(s->n[0][j], s->n[1][j], s->n[2][j], s->d[0][j],
                            s->d[1][j], s->d[2][j]);
        cos_i = cos_i > 0.0f ? (cos_i < 1.0f ? cos_i : 1.0f) : 0.0f;
        float x = 1.0f - cos_i;
        float power = exponent == 2.0f ? x * x : math_powf(x, exponent);
        float f = bias + power;
        mirrored[j] = f > 0.0f ? (f < 1.0f ? f : 1.0f) : 0.0f;
    }
    for (uint32_t j = 0; j < s->count; j++) {
        uint32_t slot = t->slot[t->live[j]];
        float w = 1.0f;
        if (fresnel)
            w = (1.0f - mirrored[j]) * (1.0f - t->weight_sum[slot]);
        t->weight_sum[slot] += w;
        t->color[0][slot] += w * t->local[0][j];
        t->color[1][slot] += w * t->local[1][j];
        t->color[2][slot] += w * t->local[2][j];
    }
}

/* ---- The next bounce ---- */

/* Which surfaces send a ray on: in the course all, else those whose product of
 * mirrors is not zero. The weight of surface j goes to t->base. */
static uint32_t
choose_next(const struct plan *plan, struct tile *t)
{
    uint32_t count = 0, n = t->surfaces.count;
    if (is_course(plan)) {
        for (uint32_t j = 0; j < n; j++)
            t->keep[j] = j;
        return n;
    }
    if ((plan->materials.used >> PAINT_MIRROR & 1) == 0)
        return 0;
    for (int k = 0; k < 3; k++)
        for (uint32_t j = 0; j < n; j++)
            t->base[k][j] =
                t->weight[k][t->live[j]] * t->paints.color[PAINT_MIRROR][k][j];
    count = list_nonzero(n, t->base, t->flag, t->keep);
    return count;
}

static void
next_rays(const struct plan *plan, uint32_t count, struct tile *t)
{
    const struct surfaces *restrict s = &t->surfaces;
    struct rays *restrict r = &t->rays;
    float offset = (float)plan->scene->integrator.ray_offset;
    bool course = is_course(plan);
    uint32_t n = lanes_up(count);
    for (uint32_t i = count; i < n; i++)
        t->keep[i] = 0;
    LANE_LOOP
    for (uint32_t i = 0; i < n; i++) {
        uint32_t j = t->keep[i];
        float nx = s->n[0][j], ny = s->n[1][j], nz = s->n[2][j];
        float dx = s->d[0][j], dy = s->d[1][j], dz = s->d[2][j];
        float px = s->p[0][j], py = s->p[1][j], pz = s->p[2][j];
        float gx = s->g[0][j], gy = s->g[1][j], gz = s->g[2][j];
        float twice = -2.0f * dot3(dx, dy, dz, nx, ny, nz);
        float rx = madd(twice, nx, dx), ry = madd(twice, ny, dy),
              rz = madd(twice, nz, dz);
        float inv = 1.0f / __builtin_sqrtf(dot3(rx, ry, rz, rx, ry, rz));
        float side = dot3(gx, gy, gz, rx, ry, rz) < 0.0f ? -1.0f : 1.0f;
        float big = absolute(px) > absolute(py) ? absolute(px) : absolute(py);
        big = big > absolute(pz) ? big : absolute(pz);
        big = big > 1.0f ? big : 1.0f;
        float by = course ? offset : offset * big * side;
        r->o[0][i] = madd(by, course ? nx : gx, px);
        r->o[1][i] = madd(by, course ? ny : gy, py);
        r->o[2][i] = madd(by, course ? nz : gz, pz);
        r->d[0][i] = rx * inv;
        r->d[1][i] = ry * inv;
        r->d[2][i] = rz * inv;
    }
    r->count = count;
    /* keep is ascending and live too, so slots move down in place. */
    for (uint32_t i = 0; i < count; i++)
        t->slot[i] = t->slot[t->live[t->keep[i]]];
    for (int k = 0; !course && k < 3; k++)
        for (uint32_t i = 0; i < count; i++)
            t->weight[k][i] = t->base[k][t->keep[i]];
}

static void
start_sample(const struct plan *plan, struct tile *t)
{
    uint32_t n = lanes_up(t->count);
    for (int k = 0; k < 3; k++)
        memset(t->color[k], 0, n * sizeof(float));
    memset(t->weight_sum, 0, n * sizeof(float));
    if (is_course(plan))
        return;
    for (int k = 0; k < 3; k++)
        for (uint32_t i = 0; i < n; i++)
            t->weight[k][i] = 1.0f;
}

static void
end_course(struct tile *t)
{
    uint32_t n = lanes_up(t->count);
    for (uint32_t i = 0; i < n; i++) {
        float h = t->weight_sum[i];
        float divisor = h > 0.0f ? h : 1.0f;
        t->color[0][i] /= divisor;
        t->color[1][i] /= divisor;
        t->color[2][i] /= divisor;
    }
}

void
whitted_shade(const struct plan *plan, struct tile *t, bool first,
              struct film *film)
{
    const struct scene *scene = plan->scene;
    const struct geometry *geometry = accel_geometry(plan->accel);
    bool course = is_course(plan);
    unsigned wanted = 1u << PAINT_DIFFUSE | 1u << PAINT_SPECULAR;
    if (!course)
        wanted |=
            1u << PAINT_AMBIENT | 1u << PAINT_MIRROR | 1u << PAINT_EMISSION;
    start_sample(plan, t);
    for (uint32_t depth = 0; t->rays.count > 0; depth++) {
        enum ray_kind kind = depth == 0 ? RAYS_CAMERA : RAYS_BOUNCE;
        accel_intersect(plan->accel, kind, &t->rays, &t->hits);
        t->rays_traced[kind] += t->rays.count;
        shade_misses(plan, t, depth);
        surfaces_fill(geometry, &t->rays, &t->hits, &t->surfaces, t->live);
        if (t->surfaces.count == 0)
            break;
        if (depth == 0 && first)
            film_data(t, film);
        materials_fetch(&plan->materials, scene, geometry, &t->surfaces, wanted,
                        &t->paints);
        if (depth == 0)
            film_albedo(t, film);
        if (!course)
            turn_normals(&t->surfaces);
        local_light(plan, t);
        if (course)
            accumulate_course(plan, t);
        else
            accumulate_recursive(t);
        if (depth == scene->integrator.max_bounces)
            break;
        next_rays(plan, choose_next(plan, t), t);
    }
    if (course)
        end_course(t);
}
