#include "core/trace/render.h"

#include <errno.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#if defined(__SSE__)
#include <xmmintrin.h>
#endif

#include "core/base/clock.h"
#include "core/base/must.h"
#include "core/trace/kernel.h"

enum { CREW_MAX = 256, INTERVAL_MS = 50 };

struct crew;

struct member {
    struct crew *crew;
    unsigned index;
    pthread_t thread;
    struct tile *tile;
    uint64_t counted[RAY_KIND_COUNT]; /* of tile->rays_traced, added to crew */
};

/* What the crew shares. Everything but the two counters is either read-only
 * while it works or guarded by `lock`. */
struct crew {
    const struct kernel *kernel;
    const struct plan *plan;
    struct film *film;
    uint32_t tiles_total;
    unsigned size;
    atomic_uint next_tile; /* the one counter */
    atomic_uint tiles_done;
    atomic_bool stop;
    atomic_uint allowed; /* members that may take a tile, >= 1 */
    _Atomic uint64_t rays[RAY_KIND_COUNT];
    pthread_mutex_t lock; /* working, and sleeping on the conditions */
    unsigned working;     /* members that have not left */
    pthread_cond_t left;  /* working became 0 */
    pthread_cond_t turn;  /* allowed or stop changed */
};

/* Denormals would slow single pixels a hundredfold, and they show nowhere. */
static void
flush_denormals(void)
{
#if defined(__SSE__)
    _mm_setcsr(_mm_getcsr() | 0x8040u); /* flush to zero, denormals are zero */
#endif
}

/* Members beyond `allowed` wait for their turn; true: go on. */
static bool
wait_turn(struct crew *crew, unsigned index)
{
    if (index < atomic_load(&crew->allowed))
        return !atomic_load(&crew->stop);
    pthread_mutex_lock(&crew->lock);
    while (index >= atomic_load(&crew->allowed) && !atomic_load(&crew->stop) &&
           atomic_load(&crew->next_tile) < crew->tiles_total)
        pthread_cond_wait(&crew->turn, &crew->lock);
    pthread_mutex_unlock(&crew->lock);
    return !atomic_load(&crew->stop);
}

static void *
member_run(void *arg)
{
    struct member *member = arg;
    struct crew *crew = member->crew;
    flush_denormals();
    while (wait_turn(crew, member->index)) {
        uint32_t tile = atomic_fetch_add(&crew->next_tile, 1);
        if (tile >= crew->tiles_total)
            break;
        bool whole =
            crew->kernel->tile_run(crew->plan, tile, member->tile, crew->film);
        for (int k = 0; k < RAY_KIND_COUNT; k++) {
            uint64_t now = member->tile->rays_traced[k];
            atomic_fetch_add(&crew->rays[k], now - member->counted[k]);
            member->counted[k] = now;
        }
        if (whole)
            atomic_fetch_add(&crew->tiles_done, 1);
    }
    pthread_mutex_lock(&crew->lock);
    crew->working--;
    if (crew->working == 0)
        pthread_cond_signal(&crew->left);
    pthread_cond_broadcast(&crew->turn); /* no tile is left: nobody waits */
    pthread_mutex_unlock(&crew->lock);
    return NULL;
}

/* The render as its caller's thread sees it. */
struct run {
    const struct render_options *options;
    struct crew crew;
    enum render_phase phase;
    pthread_t caller;
    int64_t last_us;
    int64_t interval_us;
};

static bool
report(struct run *run)
{
    struct render_progress progress = {
        .phase = run->phase,
        .tiles_done = atomic_load(&run->crew.tiles_done),
        .tiles_total = run->crew.tiles_total,
    };
    for (int k = 0; k < RAY_KIND_COUNT; k++)
        progress.rays += atomic_load(&run->crew.rays[k]);
    run->last_us = clock_monotonic_us();
    if (run->options->on_progress == NULL)
        return true;
    return run->options->on_progress(run->options->user, &progress) ==
           RENDER_GO;
}

/* While building. Embree asks from its own threads too; only the caller's may
 * report. */
static bool
build_go_on(void *user)
{
    struct run *run = user;
    if (!pthread_equal(pthread_self(), run->caller) ||
        clock_monotonic_us() - run->last_us < run->interval_us)
        return !atomic_load(&run->crew.stop);
    if (!report(run))
        atomic_store(&run->crew.stop, true);
    return !atomic_load(&run->crew.stop);
}

static unsigned
allowed_now(const struct run *run)
{
    unsigned allowed = run->crew.size;
    if (run->options->threads_now != NULL)
        allowed = atomic_load(run->options->threads_now);
    return allowed > 0 ? allowed : 1;
}

static void
sleep_until(struct run *run, int64_t wake_us)
{
    struct timespec at = {.tv_sec = wake_us / 1000000,
                          .tv_nsec = wake_us % 1000000 * 1000};
    pthread_cond_timedwait(&run->crew.left, &run->crew.lock, &at);
}

/* The caller's thread, until the crew has left. */
static void
watch(struct run *run)
{
    struct crew *crew = &run->crew;
    pthread_mutex_lock(&crew->lock);
    while (crew->working > 0) {
        sleep_until(run, run->last_us + run->interval_us);
        if (crew->working == 0)
            break;
        pthread_mutex_unlock(&crew->lock);
        if (clock_monotonic_us() - run->last_us >= run->interval_us &&
            !report(run))
            atomic_store(&crew->stop, true);
        pthread_mutex_lock(&crew->lock);
        unsigned allowed = allowed_now(run);
        if (allowed != atomic_load(&crew->allowed) ||
            atomic_load(&crew->stop)) {
            atomic_store(&crew->allowed, allowed);
            pthread_cond_broadcast(&crew->turn);
        }
    }
    pthread_mutex_unlock(&crew->lock);
}

static unsigned
crew_size(const struct render_options *options, uint32_t tiles)
{
    unsigned size = options->threads;
    if (size == 0) {
        long cores = sysconf(_SC_NPROCESSORS_ONLN);
        size = cores > 0 ? (unsigned)cores : 1;
    }
    size = size < CREW_MAX ? size : CREW_MAX;
    return size < tiles ? size : tiles;
}

static bool
crew_trace(struct run *run, struct error *err)
{
    struct crew *crew = &run->crew;
    struct member *members = calloc(crew->size, sizeof *members);
    unsigned started = 0;
    bool ok = false;
    if (members == NULL)
        goto out;
    for (unsigned i = 0; i < crew->size; i++) {
        size_t size = (sizeof *members[i].tile + 63) / 64 * 64;
        members[i].crew = crew;
        members[i].index = i;
        members[i].tile = aligned_alloc(64, size);
        if (members[i].tile == NULL)
            goto out;
        memset(members[i].tile, 0, sizeof *members[i].tile);
        members[i].tile->stop = &crew->stop;
    }
    crew->working = crew->size;
    for (; started < crew->size; started++)
        if (pthread_create(&members[started].thread, NULL, member_run,
                           &members[started]) != 0)
            break;
    pthread_mutex_lock(&crew->lock);
    crew->working -= crew->size - started; /* fewer hands do it too */
    pthread_mutex_unlock(&crew->lock);
    ok = started > 0;
    watch(run);
    for (unsigned i = 0; i < started; i++)
        pthread_join(members[i].thread, NULL);
out:
    if (!ok)
        error_set(err, ERROR_MEMORY, "no memory for a crew of %u", crew->size);
    for (unsigned i = 0; members != NULL && i < crew->size; i++)
        free(members[i].tile);
    free(members);
    return ok;
}

static bool
crew_init(struct crew *crew)
{
    pthread_condattr_t attr;
    bool ok = pthread_condattr_init(&attr) == 0;
    ok = ok && pthread_condattr_setclock(&attr, CLOCK_MONOTONIC) == 0 &&
         pthread_mutex_init(&crew->lock, NULL) == 0 &&
         pthread_cond_init(&crew->left, &attr) == 0 &&
         pthread_cond_init(&crew->turn, &attr) == 0;
    pthread_condattr_destroy(&attr);
    return ok;
}

bool
render_run(const struct scene *scene, const struct render_options *options,
           struct film *film, struct render_stats *stats, struct error *err)
{
    static const struct render_options defaults;
    struct run run;
    struct plan *plan = NULL;
    bool ok = false;
    memset(&run, 0, sizeof run);
    run.options = options != NULL ? options : &defaults;
    run.caller = pthread_self();
    run.last_us = clock_monotonic_us();
    run.interval_us =
        1000 * (run.options->interval_ms > 0 ? (int64_t)run.options->interval_ms
                                             : INTERVAL_MS);
    MUST(film->width == scene->width && film->height == scene->height);
    MUST(crew_init(&run.crew));

    /* Build. */
    int64_t start_us = run.last_us;
    run.crew.kernel = kernel_choose(
        run.options->isa != ISA_OTHER ? run.options->isa : isa_level());
    run.crew.tiles_total = ((scene->width + TILE_SIZE - 1) / TILE_SIZE) *
                           ((scene->height + TILE_SIZE - 1) / TILE_SIZE);
    run.crew.size = crew_size(run.options, run.crew.tiles_total);
    struct accel_options accel = {
        .threads = run.crew.size,
        .memory_max = run.options->memory_max,
        .rays = (uint64_t)scene->width * scene->height * scene->sampler.spp,
        .go_on = build_go_on,
        .user = &run,
    };
    plan = run.crew.kernel->plan_build(scene, &accel, err);
    if (plan == NULL)
        goto out;
    int64_t built_us = clock_monotonic_us();
    if (!report(&run)) {
        error_set(err, ERROR_CANCELED, "canceled while building");
        goto out;
    }

    /* Trace. */
    run.phase = RENDER_TRACING;
    run.crew.plan = plan;
    run.crew.film = film;
    atomic_store(&run.crew.allowed, allowed_now(&run));
    ok = crew_trace(&run, err);
    int64_t traced_us = clock_monotonic_us();
    if (ok && atomic_load(&run.crew.tiles_done) < run.crew.tiles_total)
        ok = error_set(err, ERROR_CANCELED, "canceled after %u of %u tiles",
                       atomic_load(&run.crew.tiles_done), run.crew.tiles_total);
    if (ok)
        report(&run); /* too late to stop */
    if (stats != NULL) {
        stats->build_ms = (double)(built_us - start_us) / 1000.0;
        stats->trace_ms = (double)(traced_us - built_us) / 1000.0;
        for (int k = 0; k < RAY_KIND_COUNT; k++)
            stats->rays[k] = atomic_load(&run.crew.rays[k]);
    }
out:
    if (plan != NULL)
        run.crew.kernel->plan_free(plan);
    pthread_cond_destroy(&run.crew.turn);
    pthread_cond_destroy(&run.crew.left);
    pthread_mutex_destroy(&run.crew.lock);
    return ok;
}
