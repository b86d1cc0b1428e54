/* bench_trace.c - how fast the tracer is, without server, worker and encoder.
 *
 *   bench_trace [--threads N] [--repeat N] [--isa 1|3|4] [--ppm FILE] [SCENE...]
 *
 * One JSON line per scene: medians of the repeats. Scenes: table (1280 x 720,
 * max_bounces 4, fresnel_weighted), table_phong (its twin for POV-Ray:
 * recursive, mirrors), soft, sphereflake, mesh (1.0 M triangles); `small`
 * prints where a BVH begins to pay instead. Compare only
 * runs of one machine and one minute. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "core/base/isa.h"
#include "core/trace/kernel.h"
#include "core/trace/render.h"
#include "scenes.h"

static int
compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Of this process, all threads: what other processes do shows less. */
static double
cpu_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec / 1e6;
}

static double
median(double *v, size_t n)
{
    qsort(v, n, sizeof *v, compare);
    return n % 2 == 1 ? v[n / 2] : 0.5 * (v[n / 2 - 1] + v[n / 2]);
}

static void
table(struct built *b)
{
    built_table(b, ACCUMULATION_FRESNEL_WEIGHTED, 1280, 720, 4);
}

/* What POV-Ray can express: the same geometry, light and camera; mirrors of 0.3
 * everywhere instead of the lecture's mean of hits. */
static void
table_phong(struct built *b)
{
    const double mirror[3] = {0.3, 0.3, 0.3};
    built_table(b, ACCUMULATION_RECURSIVE, 1280, 720, 4);
    for (uint32_t i = 1; i < b->scene.material_count; i++)
        memcpy(b->scene.materials[i].mirror.color, mirror, sizeof mirror);
    b->scene.integrator.clamp_local = 0;
    b->scene.integrator.inside_hits = true;
}

static void
soft(struct built *b)
{
    built_table(b, ACCUMULATION_FRESNEL_WEIGHTED, 1280, 720, 2);
    b->scene.lights[0].kind = LIGHT_AREA_GRID;
}

static void
sphereflake(struct built *b)
{
    built_sphereflake(b, 4, 1024);
}

/* 12 n^2 triangles: a cube's faces on a wavy sphere. */
static void
mesh(struct built *b)
{
    enum { N = 289 };
    const double eye[3] = {0, -3.4, 1.2}, target[3] = {0, 0, 0},
                 up[3] = {0, 0, 1};
    const uint32_t side = N + 1, count = 6 * (N + 1) * (N + 1);
    float *p = calloc((size_t)count * 3, sizeof *p);
    uint32_t *index = calloc((size_t)36 * N * N, sizeof *index);
    uint32_t at = 0, used = 0;
    built_start(b, 2);
    b->scene.width = b->scene.height = 1024;
    built_look(b, eye, target, up, 45);
    for (uint32_t f = 0; p != NULL && index != NULL && f < 6; f++)
        for (uint32_t i = 0; i < side; i++)
            for (uint32_t j = 0; j < side; j++) {
                double s = tan(-0.78539816 + 1.57079633 * i / N);
                double t = tan(-0.78539816 + 1.57079633 * j / N);
                double v[3], sign = f % 2 == 0 ? 1 : -1;
                v[f / 2] = sign;
                v[(f / 2 + 1) % 3] = sign > 0 ? s : t;
                v[(f / 2 + 2) % 3] = sign > 0 ? t : s;
                double r = 1 / sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
                double h = 0;
                for (int o = 0; o < 7; o++)
                    h += 0.06 / (1 << o) * sin(r * v[0] * (3 << o) + o) *
                         sin(r * v[1] * (3 << o) + 2 * o) *
                         sin(r * v[2] * (3 << o) + 3 * o);
                for (int k = 0; k < 3; k++)
                    p[3 * at + (uint32_t)k] = (float)(v[k] * r * (1 + h));
                if (i < N && j < N) {
                    const uint32_t q[6] = {at, at + side,     at + side + 1,
                                           at, at + side + 1, at + 1};
                    memcpy(index + used, q, sizeof q);
                    used += 6;
                }
                at++;
            }
    built_mesh(b, 0, p, NULL, count, index, used / 3);
    const double corner[3] = {-12, -12, -1.4}, u[3] = {24, 0, 0},
                 v[3] = {0, 24, 0};
    built_quad(b, 0, corner, u, v);
    built_light(b, LIGHT_POINT, 3, -4, 6, 1);
    free(p);
    free(index);
}

static const struct {
    const char *name;
    void (*build)(struct built *);
} scenes[] = {{"table", table},
              {"table_phong", table_phong},
              {"soft", soft},
              {"sphereflake", sphereflake},
              {"mesh", mesh}};

static void
write_ppm(const char *path, const struct film *film)
{
    FILE *f = fopen(path, "wb");
    if (f == NULL)
        return;
    fprintf(f, "P6\n%u %u\n255\n", film->width, film->height);
    size_t n = (size_t)film->width * film->height * 3;
    for (size_t i = 0; i < n; i++) {
        double v =
            pow(fmin(fmax(film->layers[LAYER_BEAUTY][i], 0), 1), 1 / 2.2);
        fputc((int)(255 * v + 0.5), f);
    }
    fclose(f);
}

static bool
run(const char *name, void (*build)(struct built *), unsigned threads,
    unsigned repeat, int isa, const char *ppm)
{
    enum { REPEAT_MAX = 99 };
    double trace[REPEAT_MAX], built_ms[REPEAT_MAX], cpu[REPEAT_MAX];
    struct render_options options = {.threads = threads,
                                     .isa = (enum isa_level)isa};
    struct render_stats stats = {0};
    struct built b;
    char class[ISA_SIZE];
    isa_class(class);
    build(&b);
    repeat = repeat < REPEAT_MAX ? repeat : REPEAT_MAX;
    for (unsigned i = 0; i < repeat; i++) {
        struct error err = {0};
        struct film film;
        double cpu_start = cpu_ms();
        if (!film_init(&film, b.scene.width, b.scene.height, 1u << LAYER_BEAUTY,
                       &err) ||
            !render_run(&b.scene, &options, &film, &stats, &err)) {
            fprintf(stderr, "%s: %s\n", name, err.text);
            built_clear(&b);
            return false;
        }
        cpu[i] = cpu_ms() - cpu_start;
        trace[i] = stats.trace_ms;
        built_ms[i] = stats.build_ms;
        if (ppm != NULL && i == 0)
            write_ppm(ppm, &film);
        film_clear(&film);
    }
    built_clear(&b);
    double rays = 0, ms = median(trace, repeat);
    for (int k = 0; k < RAY_KIND_COUNT; k++)
        rays += (double)stats.rays[k];
    printf("{\"scene\": \"%s\", \"threads\": %u, \"isa\": \"%s\", "
           "\"build_ms\": %.2f, \"trace_ms\": %.2f, \"cpu_ms\": %.2f, "
           "\"rays\": %.0f, "
           "\"camera\": %llu, \"shadow\": %llu, \"bounce\": %llu, "
           "\"mrays_per_s\": %.2f}\n",
           name, threads, class, median(built_ms, repeat), ms,
           median(cpu, repeat), rays,
           (unsigned long long)stats.rays[RAYS_CAMERA],
           (unsigned long long)stats.rays[RAYS_SHADOW],
           (unsigned long long)stats.rays[RAYS_BOUNCE], rays / ms / 1000);
    fflush(stdout);
    return true;
}

/* Rays of a batch: through neighbouring pixels, from scattered places to one
 * light, from scattered places in any direction. */
static void
small_rays(enum ray_kind kind, struct dice *d, struct rays *rays)
{
    rays->count = BATCH_MAX;
    for (uint32_t i = 0; i < BATCH_MAX; i++) {
        double o[3], v[3];
        const double pixel[3] = {0.01 * (i % 32), 0.01 * (i / 32), 1};
        const double light[3] = {0, 5, 0};
        for (int k = 0; k < 3; k++) {
            o[k] = kind == RAYS_CAMERA ? -5.0 * (k == 2) : dice_range(d, -2, 2);
            v[k] = kind == RAYS_CAMERA   ? pixel[k]
                   : kind == RAYS_SHADOW ? light[k] - o[k]
                                         : dice_range(d, -1, 1);
            rays->o[k][i] = (float)o[k];
            rays->d[k][i] = (float)v[k];
        }
    }
}

static double
small_rate(const struct kernel *kernel, const struct scene *scene,
           enum accel_way way, enum ray_kind kind, struct rays *rays)
{
    static struct hits hits;
    struct accel_options options = {.way = way};
    struct plan *plan = kernel->plan_build(scene, &options, NULL);
    double best = 1e9;
    for (int round = 0; plan != NULL && round < 400; round++) {
        for (uint32_t i = 0; i < BATCH_MAX; i++)
            rays->far[i] = 1.0f;
        double start = cpu_ms();
        if (kind == RAYS_SHADOW)
            kernel->occluded(plan->accel, rays);
        else
            kernel->intersect(plan->accel, kind, rays, &hits);
        best = fmin(best, cpu_ms() - start);
    }
    if (plan != NULL)
        kernel->plan_free(plan);
    return BATCH_MAX / best / 1000;
}

/* Where a BVH begins to pay, by kind of ray: n shapes at random, all primitives
 * over the batch against Embree, Mrays/s. */
static void
small(int isa)
{
    static const uint32_t counts[] = {4, 8, 12, 16, 24, 32, 48, 64};
    static const char *const kinds[] = {"camera", "shadow", "bounce"};
    static struct rays rays;
    const struct kernel *kernel =
        kernel_choose(isa != 0 ? (enum isa_level)isa : isa_level());
    for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
        struct built b;
        struct dice d = {5};
        built_start(&b, counts[c]);
        for (uint32_t i = 0; i < counts[c]; i++) {
            double p[3];
            for (int k = 0; k < 3; k++)
                p[k] = dice_range(&d, -2, 2);
            if (i % 2 == 0)
                built_sphere(&b, 0, p[0], p[1], p[2], 0.4);
            else
                built_box(&b, 0, p[0], p[1], p[2], p[0] + 0.6, p[1] + 0.6,
                          p[2] + 0.6);
        }
        printf("{\"shapes\": %u, \"level\": %d", counts[c], (int)kernel->level);
        for (int kind = 0; kind < RAY_KIND_COUNT; kind++) {
            enum ray_kind k = (enum ray_kind)kind;
            small_rays(k, &d, &rays);
            printf(", \"%s_all\": %.1f, \"%s_bvh\": %.1f", kinds[kind],
                   small_rate(kernel, &b.scene, ACCEL_SMALL, k, &rays),
                   kinds[kind],
                   small_rate(kernel, &b.scene, ACCEL_EMBREE, k, &rays));
        }
        printf("}\n");
        built_clear(&b);
    }
}

int
main(int argc, char **argv)
{
    unsigned threads = 1, repeat = 5;
    int isa = 0;
    const char *ppm = NULL;
    bool ok = true, named = false;
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--threads") == 0 && i + 1 < argc)
            threads = (unsigned)atoi(argv[++i]);
        else if (strcmp(argv[i], "--repeat") == 0 && i + 1 < argc)
            repeat = (unsigned)atoi(argv[++i]);
        else if (strcmp(argv[i], "--isa") == 0 && i + 1 < argc)
            isa = atoi(argv[++i]);
        else if (strcmp(argv[i], "--ppm") == 0 && i + 1 < argc)
            ppm = argv[++i];
        else
            named = true;
    }
    for (int i = 1; i < argc; i++)
        if (strcmp(argv[i], "small") == 0)
            small(isa);
    for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++) {
        bool wanted = !named;
        for (int i = 1; i < argc; i++)
            wanted |= strcmp(argv[i], scenes[s].name) == 0;
        if (wanted)
            ok &= run(scenes[s].name, scenes[s].build, threads,
                      repeat > 0 ? repeat : 1, isa, ppm);
    }
    return ok ? 0 : 1;
}
