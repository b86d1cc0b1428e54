#include "server/worker/run.h"

#include <sched.h>
#include <sys/resource.h>

#include "core/base/arena.h"
#include "core/base/clock.h"
#include "core/base/json.h"
#include "core/image/develop.h"
#include "core/image/image.h"
#include "core/scene/output.h"
#include "core/scene/scene_json.h"
#include "core/trace/film.h"
#include "core/trace/render.h"

/* What an asker may send; over it is budget.bytes long before any memory is
 * spent. A canonical scene is at most some times its document. */
static const size_t scene_bytes_max = (size_t)64 << 20;
static const size_t output_bytes_max = (size_t)64 << 10;
static const size_t scene_memory_max = (size_t)1 << 30;
enum {
    CREW_MAX = 256,
    LISTEN_MS = 10 /* how soon CANCEL and THREADS are heard */
};

/* Everything one render holds, in the order in which it comes to be. */
struct render {
    struct turn *turn;
    struct arena arena; /* scene and output live here */
    struct scene scene;
    struct output output;
    struct film film;
    struct image image;
    struct bytes file;
    struct message_done done;
};

static void
render_clear(struct render *render)
{
    bytes_clear(&render->file);
    image_clear(&render->image);
    film_clear(&render->film);
    arena_clear(&render->arena);
}

static double
ms_since(int64_t start_us)
{
    return (double)(clock_monotonic_us() - start_us) / 1000;
}

static void
tell_stage(struct render *render, enum render_stage stage)
{
    struct message_progress progress = {.stage = stage};
    turn_progress(render->turn, &progress);
}

/* The first thing wrong with a document, with its place, as one error. */
static bool
first_error(const char *what, struct error_list *errors, struct error *err)
{
    error_list_sort(errors);
    if (errors->count == 0)
        return error_set(err, ERROR_INTERNAL, "the %s was refused silently",
                         what);
    const struct error_item *item = &errors->items[0];
    if (item->pointer != NULL && item->pointer[0] != '\0')
        return error_set(err, item->code, "%s: %s", item->pointer,
                         item->detail);
    if (item->line > 0)
        return error_set(err, item->code, "line %u, column %u: %s", item->line,
                         item->column, item->detail);
    return error_set(err, item->code, "%s", item->detail);
}

static bool
read_scene(struct render *render, int fd, struct error *err)
{
    const void *text;
    size_t len;
    if (!wire_map(fd, scene_bytes_max, &text, &len, err))
        return false;
    struct error_list errors = {.arena = &render->arena};
    bool ok = scene_read_text(text, len, NULL, &render->arena, &render->scene,
                              &errors);
    wire_unmap(text, len);
    return ok || first_error("scene", &errors, err);
}

static bool
read_output(struct render *render, int fd, struct error *err)
{
    const void *text;
    size_t len;
    if (!wire_map(fd, output_bytes_max, &text, &len, err))
        return false;
    struct error_list errors = {.arena = &render->arena};
    const struct json *root =
        json_read(text, len, NULL, &render->arena, &errors);
    bool ok = root != NULL && output_read(root, &render->output, &errors);
    wire_unmap(text, len);
    return ok || first_error("output", &errors, err);
}

/* bytes -> scene, and an empty film of its size. */
static bool
load(struct render *render, const struct message *ask, struct error *err)
{
    int64_t start = clock_monotonic_us();
    tell_stage(render, STAGE_LOADING);
    if (!read_scene(render, ask->fds[0], err) ||
        !read_output(render, ask->fds[1], err))
        return false;
    unsigned mask = 0;
    for (uint32_t i = 0; i < render->output.layer_count; i++)
        mask |= 1U << render->output.layers[i];
    bool ok = film_init(&render->film, render->scene.width,
                        render->scene.height, mask, err);
    render->done.load_ms = ms_since(start);
    return ok;
}

static enum render_verdict
on_progress(void *user, const struct render_progress *now)
{
    struct render *render = user;
    /* The crew is at work: now the library can load beside it. */
    if (now->phase == RENDER_TRACING)
        image_codec_load();
    struct message_progress progress = {
        .stage = now->phase == RENDER_BUILDING ? STAGE_BUILDING : STAGE_TRACING,
        .done = now->tiles_done,
        .total = now->tiles_total,
        .rays = now->rays,
    };
    turn_progress(render->turn, &progress);
    return turn_listen(render->turn) ? RENDER_GO : RENDER_STOP;
}

/* As many crew members as cores, so that THREADS can let more of them work
 * later; or as many as were asked for, where that is more. */
static unsigned
crew_size(unsigned asked)
{
    cpu_set_t cores;
    unsigned size = 1;
    if (sched_getaffinity(0, sizeof cores, &cores) == 0)
        size = (unsigned)CPU_COUNT(&cores);
    if (size < asked)
        size = asked;
    return size < CREW_MAX ? size : CREW_MAX;
}

/* A quarter of the memory we may use for geometry, and as much again for what
 * is built of it: the rest is for film, image and libraries. The tighter of the
 * two limits that an asker may set counts; 0, no limit, without one. */
static size_t
geometry_memory_max(void)
{
    static const __rlimit_resource_t kinds[] = {RLIMIT_AS, RLIMIT_DATA};
    rlim_t least = RLIM_INFINITY;
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        struct rlimit limit;
        if (getrlimit(kinds[i], &limit) == 0 && limit.rlim_cur < least)
            least = limit.rlim_cur;
    }
    return least == RLIM_INFINITY ? 0 : (size_t)least / 4;
}

/* scene -> film. */
static bool
trace(struct render *render, const struct message *ask, struct error *err)
{
    unsigned threads = ask->body.threads.threads;
    atomic_store(&render->turn->threads, threads);
    struct render_options options = {
        .threads = crew_size(threads),
        .threads_now = &render->turn->threads,
        .on_progress = on_progress,
        .user = render,
        .interval_ms = LISTEN_MS,
        .memory_max = geometry_memory_max(),
    };
    struct render_stats stats = {0};
    if (!render_run(&render->scene, &options, &render->film, &stats, err))
        return false;
    render->done.build_ms = stats.build_ms;
    render->done.trace_ms = stats.trace_ms;
    for (int kind = 0; kind < RAY_KIND_COUNT; kind++)
        render->done.rays[kind] = stats.rays[kind];
    return true;
}

/* film -> bytes. The film is let go before the image is encoded: for a big
 * picture the two together would be the worker's peak. */
static bool
encode(struct render *render, struct error *err)
{
    int64_t start = clock_monotonic_us();
    tell_stage(render, STAGE_ENCODING);
    if (!turn_listen(render->turn))
        return error_set(err, ERROR_CANCELED, "the render was canceled");
    if (!develop(&render->film, &render->output, &render->image, err))
        return false;
    film_clear(&render->film);
    bool ok = image_encode(&render->image, develop_format(&render->output),
                           &render->file, err);
    render->done.encode_ms = ms_since(start);
    return ok;
}

static uint64_t
peak_bytes(void)
{
    struct rusage usage;
    if (getrusage(RUSAGE_SELF, &usage) != 0)
        return 0;
    return (uint64_t)usage.ru_maxrss * 1024;
}

bool
run_render(struct turn *turn, const struct message *ask, struct message *answer,
           struct error *err)
{
    struct render render = {.turn = turn};
    arena_init(&render.arena, scene_memory_max);
    bool ok = false;

    if (!load(&render, ask, err) || !trace(&render, ask, err) ||
        !encode(&render, err))
        goto out;
    int fd = wire_memfd("glint-image", render.file.data, render.file.len, err);
    if (fd < 0)
        goto out;
    answer->fds[0] = fd;
    answer->fd_count = 1;
    render.done.width = render.scene.width;
    render.done.height = render.scene.height;
    render.done.peak_bytes = peak_bytes();
    answer->body.done = render.done;
    ok = true;
out:
    render_clear(&render);
    return ok;
}
