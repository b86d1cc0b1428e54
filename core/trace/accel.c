#include "core/trace/accel.h"

#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/must.h"
#include "core/trace/embree.h"

/* The native packet of the level: a wider one would be cut up by Embree, which
 * also reorders it. */
#if defined(__AVX512F__)
enum { WIDTH = 16, SHADOW_ALL_MAX = 32, BOUNCE_ALL_MAX = 64 };
#elif defined(__AVX2__)
enum { WIDTH = 8, SHADOW_ALL_MAX = 24, BOUNCE_ALL_MAX = 48 };
#else
enum { WIDTH = 4, SHADOW_ALL_MAX = 10, BOUNCE_ALL_MAX = 10 };
#endif

struct tracing {
    unsigned width;
    bool coherent;
    unsigned visible; /* enum visible */
    uint32_t all_max; /* up to so many analytic shapes all are tested */
    bool embree;      /* this accel traces the kind through Embree */
};

/* How each kind of ray travels; by kind, never by load. all_max is where
 * `bench_trace small` sees a BVH begin to pay: rays that agree gain early, rays
 * that do not late, and the more so the wider the vectors. */
static const struct tracing tracing_table[RAY_KIND_COUNT] = {
    [RAYS_CAMERA] = {WIDTH, true, VISIBLE_CAMERA, 10, false},
    [RAYS_SHADOW] = {WIDTH, false, VISIBLE_SHADOW, SHADOW_ALL_MAX, false},
    [RAYS_BOUNCE] = {WIDTH, false, VISIBLE_REFLECTION, BOUNCE_ALL_MAX, false},
};

enum {
    UNBOUNDED = 1u << SHAPE_PLANE,
    BOUNDED =
        (1u << SHAPE_KIND_COUNT) - 1u - (1u << SHAPE_PLANE) - (1u << SHAPE_MESH)
};

struct accel {
    struct geometry geometry;
    struct tracing tracing[RAY_KIND_COUNT];
    RTCDevice device;
    RTCScene scene;
    /* While building: */
    bool (*go_on)(void *user);
    void *user;
    atomic_bool stopped;
    atomic_size_t bytes;
    size_t memory_max;
    atomic_bool memory_refused;
};

/* One packet on its way: Embree gives the context to every callback. t, object
 * and primitive are the nearest hit so far. */
struct packet_context {
    embree_context context; /* first: callbacks get its address */
    unsigned visible;
    unsigned width;
    _Alignas(64) float t[16];
    _Alignas(64) uint32_t object[16];
    _Alignas(64) uint32_t primitive[16];
};

/* The packets' fields, which Embree lays out as arrays of n. */
enum { RAY_O = 0, RAY_D = 4, RAY_FAR = 8, RAY_ID = 10 };

static void
packet_lanes(const int *valid, float *ray, unsigned n, struct lanes *lanes)
{
    for (unsigned k = 0; k < 3; k++) {
        lanes->o[k] = ray + (RAY_O + k) * n;
        lanes->d[k] = ray + (RAY_D + k) * n;
        lanes->inv_d[k] = NULL;
    }
    lanes->valid = valid;
    lanes->t = ray + RAY_FAR * n;
}

/* What Embree is told of a distance: a little more, so that it does not cut off
 * another surface at the same one. The callbacks compare the true distance. */
static inline float
slack(float t)
{
    return t * 1.000001f;
}

/* Embree hands rays over lane by lane as they were sent, or single ones of
 * them: then id says which lane they were. */
static void
user_intersect(const struct RTCIntersectFunctionNArguments *args)
{
    struct packet_context *packet = (struct packet_context *)args->context;
    const struct shape_set *set = args->geometryUserPtr;
    const struct shape_ops *ops = shape_table[set->kind];
    if ((set->visible[args->primID] & packet->visible) == 0)
        return;
    struct lanes lanes;
    float *ray = (float *)args->rayhit;
    unsigned n = args->N;
    packet_lanes(args->valid, ray, n, &lanes);
    if (n == packet->width) {
        float *restrict far = lanes.t;
        lanes.t = packet->t;
        lanes.object = packet->object;
        ops->nearest(set, args->primID, 1, &lanes, n);
        for (unsigned i = 0; i < n; i++)
            far[i] = slack(packet->t[i]);
        return;
    }
    /* Embree's packets are 32-bit words of either kind. */
    /* cppcheck-suppress invalidPointerCast */
    const uint32_t *id = (const uint32_t *)ray + RAY_ID * n;
    float *far = lanes.t, t[16];
    uint32_t object[16];
    MUST(n <= 16);
    for (unsigned i = 0; i < n; i++) {
        object[i] = args->valid[i] != 0 ? packet->object[id[i]] : 0;
        t[i] = args->valid[i] != 0 ? packet->t[id[i]] : 0.0f;
    }
    lanes.object = object;
    lanes.t = t;
    ops->nearest(set, args->primID, 1, &lanes, n);
    for (unsigned i = 0; i < n; i++)
        if (args->valid[i] != 0) {
            packet->object[id[i]] = object[i];
            packet->t[id[i]] = t[i];
            far[i] = slack(t[i]);
        }
}

static void
user_occluded(const struct RTCOccludedFunctionNArguments *args)
{
    const struct packet_context *packet =
        (const struct packet_context *)args->context;
    const struct shape_set *set = args->geometryUserPtr;
    if ((set->visible[args->primID] & packet->visible) == 0)
        return;
    struct lanes lanes;
    packet_lanes(args->valid, (float *)args->ray, args->N, &lanes);
    lanes.object = NULL;
    shape_table[set->kind]->any(set, args->primID, 1, &lanes, args->N);
}

static void
user_bounds(const struct RTCBoundsFunctionArguments *args)
{
    const struct shape_set *set = args->geometryUserPtr;
    float lo[3], hi[3];
    shape_world_bounds(set, args->primID, lo, hi);
    args->bounds_o->lower_x = lo[0];
    args->bounds_o->lower_y = lo[1];
    args->bounds_o->lower_z = lo[2];
    args->bounds_o->upper_x = hi[0];
    args->bounds_o->upper_y = hi[1];
    args->bounds_o->upper_z = hi[2];
}

/* Embree found a triangle no farther than what it knows. Equal distances are
 * decided here: the lower object, then the lower triangle. */
static void
mesh_filter(const struct RTCFilterFunctionNArguments *args)
{
    struct packet_context *packet = (struct packet_context *)args->context;
    const struct mesh_geometry *mesh = args->geometryUserPtr;
    unsigned n = args->N;
    float *far = (float *)args->ray + RAY_FAR * n;
    const uint32_t *id = (const uint32_t *)args->ray + RAY_ID * n;
    /* hit: Ng x y z, u, v, primID, geomID, instID */
    const uint32_t *primitive = (const uint32_t *)args->hit + 5 * n;
    for (unsigned i = 0; i < n; i++) {
        if (args->valid[i] == 0)
            continue;
        unsigned lane = id[i];
        bool nearer = far[i] < packet->t[lane] ||
                      (far[i] == packet->t[lane] &&
                       (mesh->object < packet->object[lane] ||
                        (mesh->object == packet->object[lane] &&
                         primitive[i] < packet->primitive[lane])));
        if (!nearer) {
            args->valid[i] = 0;
            continue;
        }
        packet->t[lane] = far[i];
        packet->object[lane] = mesh->object;
        packet->primitive[lane] = primitive[i];
        far[i] = slack(far[i]);
    }
}

/* One packet of N rays from `first` on; lanes past the batch are not valid. */
#define DEFINE_PACKET(N)                                                       \
    static void packet_intersect##N(                                           \
        const struct accel *accel, const struct tracing *how,                  \
        const struct rays *restrict rays, uint32_t first,                      \
        struct hits *restrict hits)                                            \
    {                                                                          \
        struct packet_context packet;                                          \
        struct RTCRayHit##N query;                                             \
        _Alignas(64) int valid[N];                                             \
        embree_context_init(&packet.context);                                  \
        packet.visible = how->visible;                                         \
        packet.width = N;                                                      \
        for (uint32_t i = 0; i < N; i++) {                                     \
            float t = hits->t[first + i];                                      \
            valid[i] = first + i < rays->count && t > 0.0f ? -1 : 0;           \
            query.ray.org_x[i] = rays->o[0][first + i];                        \
            query.ray.org_y[i] = rays->o[1][first + i];                        \
            query.ray.org_z[i] = rays->o[2][first + i];                        \
            query.ray.dir_x[i] = rays->d[0][first + i];                        \
            query.ray.dir_y[i] = rays->d[1][first + i];                        \
            query.ray.dir_z[i] = rays->d[2][first + i];                        \
            query.ray.tnear[i] = 0.0f;                                         \
            query.ray.time[i] = 0.0f;                                          \
            query.ray.tfar[i] = slack(t);                                      \
            query.ray.mask[i] = how->visible;                                  \
            query.ray.id[i] = i;                                               \
            query.ray.flags[i] = 0;                                            \
            query.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;                     \
            query.hit.primID[i] = RTC_INVALID_GEOMETRY_ID;                     \
            query.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;                  \
            packet.t[i] = t;                                                   \
            packet.object[i] = hits->object[first + i];                        \
            packet.primitive[i] = 0;                                           \
        }                                                                      \
        EMBREE_INTERSECT(N, valid, accel->scene, &packet.context,              \
                         how->coherent, &query);                               \
        for (uint32_t i = 0; i < N; i++) {                                     \
            hits->t[first + i] = packet.t[i];                                  \
            hits->object[first + i] = packet.object[i];                        \
            hits->primitive[first + i] = packet.primitive[i];                  \
        }                                                                      \
    }                                                                          \
    static void packet_occluded##N(const struct accel *accel,                  \
                                   const struct tracing *how,                  \
                                   struct rays *rays, uint32_t first)          \
    {                                                                          \
        struct packet_context packet;                                          \
        struct RTCRay##N query;                                                \
        _Alignas(64) int valid[N];                                             \
        int any = 0;                                                           \
        embree_context_init(&packet.context);                                  \
        packet.visible = how->visible;                                         \
        packet.width = N;                                                      \
        for (uint32_t i = 0; i < N; i++) {                                     \
            float t = rays->far[first + i];                                    \
            valid[i] = first + i < rays->count && t > 0.0f ? -1 : 0;           \
            any |= valid[i];                                                   \
            query.org_x[i] = rays->o[0][first + i];                            \
            query.org_y[i] = rays->o[1][first + i];                            \
            query.org_z[i] = rays->o[2][first + i];                            \
            query.dir_x[i] = rays->d[0][first + i];                            \
            query.dir_y[i] = rays->d[1][first + i];                            \
            query.dir_z[i] = rays->d[2][first + i];                            \
            query.tnear[i] = 0.0f;                                             \
            query.time[i] = 0.0f;                                              \
            query.tfar[i] = t;                                                 \
            query.mask[i] = how->visible;                                      \
            query.id[i] = i;                                                   \
            query.flags[i] = 0;                                                \
        }                                                                      \
        if (any == 0)                                                          \
            return;                                                            \
        EMBREE_OCCLUDED(N, valid, accel->scene, &packet.context,               \
                        how->coherent, &query);                                \
        for (uint32_t i = 0; i < N; i++)                                       \
            rays->far[first + i] =                                             \
                valid[i] != 0 ? query.tfar[i] : rays->far[first + i];          \
    }

DEFINE_PACKET(4)
DEFINE_PACKET(8)
DEFINE_PACKET(16)

static void
single_intersect(const struct accel *accel, const struct tracing *how,
                 const struct rays *rays, uint32_t i, struct hits *hits)
{
    struct packet_context packet;
    struct RTCRayHit query;
    if (!(hits->t[i] > 0.0f))
        return;
    embree_context_init(&packet.context);
    packet.visible = how->visible;
    packet.width = 1;
    packet.t[0] = hits->t[i];
    packet.object[0] = hits->object[i];
    packet.primitive[0] = 0;
    memset(&query, 0, sizeof query);
    query.ray.org_x = rays->o[0][i];
    query.ray.org_y = rays->o[1][i];
    query.ray.org_z = rays->o[2][i];
    query.ray.dir_x = rays->d[0][i];
    query.ray.dir_y = rays->d[1][i];
    query.ray.dir_z = rays->d[2][i];
    query.ray.tfar = slack(hits->t[i]);
    query.ray.mask = how->visible;
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    EMBREE_INTERSECT1(accel->scene, &packet.context, how->coherent, &query);
    hits->t[i] = packet.t[0];
    hits->object[i] = packet.object[0];
    hits->primitive[i] = packet.primitive[0];
}

static void
single_occluded(const struct accel *accel, const struct tracing *how,
                struct rays *rays, uint32_t i)
{
    struct packet_context packet;
    struct RTCRay query;
    if (!(rays->far[i] > 0.0f))
        return;
    embree_context_init(&packet.context);
    packet.visible = how->visible;
    packet.width = 1;
    memset(&query, 0, sizeof query);
    query.org_x = rays->o[0][i];
    query.org_y = rays->o[1][i];
    query.org_z = rays->o[2][i];
    query.dir_x = rays->d[0][i];
    query.dir_y = rays->d[1][i];
    query.dir_z = rays->d[2][i];
    query.tfar = rays->far[i];
    query.mask = how->visible;
    EMBREE_OCCLUDED1(accel->scene, &packet.context, how->coherent, &query);
    rays->far[i] = query.tfar;
}

/* A ray that may be traced: finite and of a size Embree can compute with. The
 * comparison is false for NaN. This is the one place that keeps such rays from
 * Embree, which aborts on them. */
static inline bool
lane_sound(const struct rays *rays, uint32_t i)
{
    float sum = 0.0f;
    for (int k = 0; k < 3; k++) {
        float o = rays->o[k][i], d = rays->d[k][i];
        sum += (o < 0.0f ? -o : o) + (d < 0.0f ? -d : d);
    }
    return sum < 1e18f;
}

void
accel_intersect(const struct accel *accel, enum ray_kind kind,
                const struct rays *rays, struct hits *hits)
{
    const struct tracing *how = &accel->tracing[kind];
    uint32_t n = lanes_up(rays->count);
    /* A sound ray may hit up to infinity, another one nothing. */
    for (uint32_t i = 0; i < n; i++) {
        hits->t[i] = lane_sound(rays, i) ? __builtin_inff() : -__builtin_inff();
        hits->object[i] = OBJECT_NONE;
        hits->primitive[i] = 0;
    }
    accel_small_nearest(&accel->geometry,
                        how->embree ? UNBOUNDED : UNBOUNDED | BOUNDED,
                        how->visible, rays, hits);
    if (how->embree) {
        uint32_t i;
        switch (how->width) {
        case 16:
            for (i = 0; i < rays->count; i += 16)
                packet_intersect16(accel, how, rays, i, hits);
            break;
        case 8:
            for (i = 0; i < rays->count; i += 8)
                packet_intersect8(accel, how, rays, i, hits);
            break;
        case 4:
            for (i = 0; i < rays->count; i += 4)
                packet_intersect4(accel, how, rays, i, hits);
            break;
        default:
            for (i = 0; i < rays->count; i++)
                single_intersect(accel, how, rays, i, hits);
        }
    }
    for (uint32_t i = 0; i < n; i++)
        hits->t[i] =
            hits->object[i] == OBJECT_NONE ? __builtin_inff() : hits->t[i];
}

void
accel_occluded(const struct accel *accel, struct rays *rays)
{
    const struct tracing *how = &accel->tracing[RAYS_SHADOW];
    uint32_t n = lanes_up(rays->count);
    /* 0: no hit is nearer; and not negative, as nothing is in the way. */
    for (uint32_t i = 0; i < n; i++)
        rays->far[i] = lane_sound(rays, i) ? rays->far[i] : 0.0f;
    accel_small_any(&accel->geometry,
                    how->embree ? UNBOUNDED : UNBOUNDED | BOUNDED, how->visible,
                    rays);
    if (!how->embree)
        return;
    uint32_t i;
    switch (how->width) {
    case 16:
        for (i = 0; i < rays->count; i += 16)
            packet_occluded16(accel, how, rays, i);
        break;
    case 8:
        for (i = 0; i < rays->count; i += 8)
            packet_occluded8(accel, how, rays, i);
        break;
    case 4:
        for (i = 0; i < rays->count; i += 4)
            packet_occluded4(accel, how, rays, i);
        break;
    default:
        for (i = 0; i < rays->count; i++)
            single_occluded(accel, how, rays, i);
    }
}

/* ---- Building ---- */

static bool
on_memory(void *user, ssize_t bytes, bool post)
{
    struct accel *accel = user;
    (void)post;
    size_t now = atomic_fetch_add(&accel->bytes, (size_t)bytes) + (size_t)bytes;
    if (bytes > 0 && accel->memory_max != 0 && now > accel->memory_max) {
        atomic_store(&accel->memory_refused, true);
        return false;
    }
    return true;
}

static bool
on_build(void *user, double share)
{
    struct accel *accel = user;
    (void)share;
    if (accel->go_on != NULL && !accel->go_on(accel->user))
        atomic_store(&accel->stopped, true);
    return !atomic_load(&accel->stopped);
}

static void
set_attach(struct accel *accel, struct shape_set *set)
{
    RTCGeometry g = rtcNewGeometry(accel->device, RTC_GEOMETRY_TYPE_USER);
    unsigned mask = 0;
    for (uint32_t i = 0; i < set->count; i++)
        mask |= set->visible[i];
    rtcSetGeometryUserPrimitiveCount(g, set->count);
    rtcSetGeometryUserData(g, set);
    rtcSetGeometryBoundsFunction(g, user_bounds, NULL);
    rtcSetGeometryIntersectFunction(g, user_intersect);
    rtcSetGeometryOccludedFunction(g, user_occluded);
    rtcSetGeometryMask(g, mask);
    rtcCommitGeometry(g);
    rtcAttachGeometry(accel->scene, g);
    rtcReleaseGeometry(g);
}

static void
mesh_attach(struct accel *accel, struct mesh_geometry *mesh, unsigned visible)
{
    RTCGeometry g = rtcNewGeometry(accel->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               mesh->positions, 0, 3 * sizeof(float),
                               mesh->position_count);
    rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               mesh->indices, 0, 3 * sizeof(uint32_t),
                               mesh->triangle_count);
    rtcSetGeometryUserData(g, mesh);
    rtcSetGeometryIntersectFilterFunction(g, mesh_filter);
    rtcSetGeometryMask(g, visible);
    rtcCommitGeometry(g);
    rtcAttachGeometry(accel->scene, g);
    rtcReleaseGeometry(g);
}

static bool
embree_build(struct accel *accel, const struct scene *scene,
             const struct accel_options *options, struct error *err)
{
    char config[64];
    struct geometry *g = &accel->geometry;
    snprintf(config, sizeof config, "threads=%u,set_affinity=0",
             options->threads > 0 ? options->threads : 1);
    accel->device = rtcNewDevice(config);
    if (accel->device == NULL)
        return error_set(err, ERROR_INTERNAL, "Embree gives no device (%d)",
                         (int)rtcGetDeviceError(NULL));
    rtcSetDeviceMemoryMonitorFunction(accel->device, on_memory, accel);
    accel->scene = rtcNewScene(accel->device);
    rtcSetSceneFlags(accel->scene, RTC_SCENE_FLAG_ROBUST);
    bool hurry = options->rays > 0 && scene->triangle_count > 100000 &&
                 options->rays < 2 * scene->triangle_count;
    rtcSetSceneBuildQuality(accel->scene, hurry ? RTC_BUILD_QUALITY_LOW
                                                : RTC_BUILD_QUALITY_MEDIUM);
    rtcSetSceneProgressMonitorFunction(accel->scene, on_build, accel);
    for (uint32_t kind = 0; kind < SHAPE_KIND_COUNT; kind++)
        if ((BOUNDED >> kind & 1) != 0 && g->sets[kind].count > 0)
            set_attach(accel, &g->sets[kind]);
    for (uint32_t i = 0; i < g->mesh_count; i++)
        mesh_attach(accel, &g->meshes[i],
                    scene->objects[g->meshes[i].object].visible);
    rtcCommitScene(accel->scene);
    enum RTCError code = rtcGetDeviceError(accel->device);
    if (atomic_load(&accel->stopped) || code == RTC_ERROR_CANCELLED)
        return error_set(err, ERROR_CANCELED, "canceled while building");
    if (atomic_load(&accel->memory_refused) || code == RTC_ERROR_OUT_OF_MEMORY)
        return error_set(err, ERROR_MEMORY,
                         "no memory for the acceleration structure");
    if (code != RTC_ERROR_NONE)
        return error_set(err, ERROR_INTERNAL, "Embree refuses the scene (%d)",
                         (int)code);
    return true;
}

struct accel *
accel_build(const struct scene *scene, const struct accel_options *options,
            struct error *err)
{
    struct accel *accel = calloc(1, sizeof *accel);
    if (accel == NULL) {
        error_set(err, ERROR_MEMORY, "no memory for an accel");
        return NULL;
    }
    accel->go_on = options->go_on;
    accel->user = options->user;
    accel->memory_max = options->memory_max;
    memcpy(accel->tracing, tracing_table, sizeof accel->tracing);
    if (options->width != 0)
        for (int kind = 0; kind < RAY_KIND_COUNT; kind++)
            accel->tracing[kind].width = options->width;
    if (!geometry_build(scene, options->memory_max, &accel->geometry, err))
        goto fail;
    uint32_t bounded =
        scene->object_count - accel->geometry.sets[SHAPE_PLANE].count;
    bool embree = false;
    for (int kind = 0; kind < RAY_KIND_COUNT; kind++) {
        struct tracing *how = &accel->tracing[kind];
        how->embree = accel->geometry.mesh_count > 0 ||
                      (options->way == ACCEL_AUTO && bounded > how->all_max) ||
                      (options->way == ACCEL_EMBREE && bounded > 0);
        embree |= how->embree;
    }
    if (embree && !embree_build(accel, scene, options, err))
        goto fail;
    return accel;
fail:
    accel_free(accel);
    return NULL;
}

void
accel_free(struct accel *accel)
{
    if (accel == NULL)
        return;
    if (accel->scene != NULL)
        rtcReleaseScene(accel->scene);
    if (accel->device != NULL)
        rtcReleaseDevice(accel->device);
    geometry_clear(&accel->geometry);
    free(accel);
}

const struct geometry *
accel_geometry(const struct accel *accel)
{
    return &accel->geometry;
}
