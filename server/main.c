/* main.c - introduces the rooms to each other, waits for the signal to stop,
 * and takes them apart in order. */
#include <errno.h>
#include <malloc.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/base/isa.h"
#include "core/base/log.h"
#include "core/base/ulid.h"
#include "server/api/api.h"
#include "server/blobs/blobs.h"
#include "server/config.h"
#include "server/http/http.h"
#include "server/pool/pool.h"
#include "server/store/store.h"

enum {
    GRACE_MS = 25 * 1000,    /* running jobs after the first signal */
    SPARE_DESCRIPTORS = 256, /* database, blobs being read, libraries */
    WORKER_DESCRIPTORS = 16, /* socket, process, memory files on their way */
    BODIES_BYTES = 64 << 20  /* request bodies in flight, together */
};

struct house {
    struct config config;
    struct api *api;
    struct store *store;
    struct blobs *blobs;
    _Atomic(struct pool *) pool; /* the store may speak before it is there */
    struct http *http;
};

/* store_change_fn. The blob of a deleted job goes with it; the pool decides,
 * for it alone knows which results are on their way to be published. */
static void
on_change(void *user, const struct job *job, bool deleted)
{
    struct house *house = user;
    api_on_change(house->api, job, deleted);
    struct pool *pool = atomic_load(&house->pool);
    if (deleted && job->result[0] != '\0' && pool != NULL)
        pool_forget_blob(pool, job->result);
}

/* --- before the rooms --- */

/* SIGTERM, SIGINT and SIGHUP are waited for, in main; no thread that starts
 * later is interrupted by them. */
static void
block_signals(sigset_t *stop)
{
    struct sigaction hup;
    sigemptyset(stop);
    sigaddset(stop, SIGTERM);
    sigaddset(stop, SIGINT);
    /* nohup means it. */
    if (sigaction(SIGHUP, NULL, &hup) == 0 && hup.sa_handler != SIG_IGN)
        sigaddset(stop, SIGHUP);
    sigprocmask(SIG_BLOCK, stop, NULL);
    signal(SIGPIPE, SIG_IGN);
}

/* Room for max_connections, or fewer connections. */
static void
fit_descriptors(struct config *config)
{
    struct rlimit limit;
    if (getrlimit(RLIMIT_NOFILE, &limit) != 0)
        return;
    rlim_t spare =
        SPARE_DESCRIPTORS + (rlim_t)config->workers * WORKER_DESCRIPTORS;
    rlim_t needed = config->max_connections + spare;
    if (limit.rlim_cur < needed) {
        limit.rlim_cur = needed < limit.rlim_max ? needed : limit.rlim_max;
        if (setrlimit(RLIMIT_NOFILE, &limit) != 0)
            getrlimit(RLIMIT_NOFILE, &limit);
    }
    if (limit.rlim_cur >= needed)
        return;
    unsigned fits =
        limit.rlim_cur > spare + 16 ? (unsigned)(limit.rlim_cur - spare) : 16;
    log_write(LOG_WARN, "main",
              "max_connections lowered from %u to %u: this process may open "
              "%llu descriptors",
              config->max_connections, fits,
              (unsigned long long)limit.rlim_cur);
    config->max_connections = fits;
}

/* The folder and those above it. */
static bool
make_folder(const char *path, struct error *err)
{
    char part[1024];
    snprintf(part, sizeof part, "%s", path);
    for (char *c = part + 1; *c != '\0'; c++) {
        if (*c != '/')
            continue;
        *c = '\0';
        mkdir(part, 0700); /* what matters is whether the last one works */
        *c = '/';
    }
    struct stat about;
    if (mkdir(part, 0700) != 0 &&
        (errno != EEXIST || stat(part, &about) != 0 || !S_ISDIR(about.st_mode)))
        return error_errno(err, ERROR_IO, errno,
                           "cannot make the data folder %s", path);
    return true;
}

/* --- start --- */

static bool
open_store(struct house *house, struct error *err)
{
    const struct config *config = &house->config;
    char path[1100];
    if (!make_folder(config->data, err))
        return false;
    snprintf(path, sizeof path, "%s/glint.db", config->data);
    struct store_options options = {
        .path = path, .on_change = on_change, .user = house};
    house->store = store_open_sqlite(&options, err);
    if (house->store == NULL)
        return false;
    snprintf(path, sizeof path, "%s/blobs", config->data);
    house->blobs = blobs_open_dir(path, err);
    return house->blobs != NULL;
}

static bool
start_api(struct house *house, struct error *err)
{
    const struct config *config = &house->config;
    struct api_options options = {
        .host = config->host,
        .open = config->insecure_open,
        .max_scene_bytes = config->max_scene_bytes,
        .scene_limits = config->scene_limits,
        .default_wait = config->default_wait,
        .max_wait = config->max_wait,
        .max_queued = config->max_queued,
        .max_render_seconds = config->max_render_seconds,
        .max_render_bytes = config->max_render_bytes,
    };
    house->api = api_new(&options, err);
    return house->api != NULL;
}

static bool
start_pool(struct house *house, struct error *err)
{
    const struct config *config = &house->config;
    struct pool_options options = {
        .workers = config->workers,
        .threads = config->threads,
        .max_render_seconds = config->max_render_seconds,
        .max_render_bytes = config->max_render_bytes,
        .stall_ms = (int64_t)(config->stall_seconds * 1000),
        .store = house->store,
        .blobs = house->blobs,
    };
    atomic_store(&house->pool, pool_start(&options, err));
    return atomic_load(&house->pool) != NULL;
}

static bool
start_http(struct house *house, struct error *err)
{
    const struct config *config = &house->config;
    struct http_options options = {
        .host = config->host,
        .port = config->port,
        .max_connections = config->max_connections,
        .max_bodies_bytes = config->max_scene_bytes > BODIES_BYTES / 4
                                ? 4 * config->max_scene_bytes
                                : BODIES_BYTES,
    };
    struct http_handler handler = api_handler(house->api);
    api_connect(house->api, house->store, house->blobs,
                atomic_load(&house->pool));
    house->http = http_start(&options, &handler, err);
    if (house->http == NULL)
        return false;
    api_connect_http(house->api, house->http);
    return true;
}

/* One screen. The address is the first thing an eye or a script looks for, and
 * it is true: the socket listens. */
static void
print_banner(const struct house *house)
{
    const struct config *c = &house->config;
    bool six = strchr(c->host, ':') != NULL;
    char isa[ISA_SIZE];
    isa_class(isa);
    printf("glintd %s  core build %.12s  %s\n"
           "  address  http://%s%s%s:%u\n"
           "  access   %s\n"
           "  workers  %u, %u threads shared out among running jobs\n"
           "  data     %s (%s)\n"
           "  limits   scene %llu bytes, %llu pixels, %u spp, %u bounces, "
           "%.3g rays\n"
           "           render %g s and %llu MiB; wait %g s, at most %g s\n"
           "           %u connections, %u jobs waiting\n"
           "  stop     Ctrl-C or SIGTERM; accepted jobs are kept\n",
           glint_version, glint_build, isa, six ? "[" : "", c->host,
           six ? "]" : "", http_port(house->http),
           c->insecure_open ? "open: everyone who reaches this address"
                            : "without keys, from this machine only",
           c->workers, c->threads, c->data, store_describe(house->store),
           (unsigned long long)c->max_scene_bytes,
           (unsigned long long)c->scene_limits.max_pixels,
           c->scene_limits.max_spp, c->scene_limits.max_bounces,
           (double)c->scene_limits.max_rays, c->max_render_seconds,
           (unsigned long long)(c->max_render_bytes >> 20), c->default_wait,
           c->max_wait, c->max_connections, c->max_queued);
    fflush(stdout);
}

/* --- stop --- */

static void
leave_at_once(int signal_number)
{
    (void)signal_number;
    /* What was acknowledged is on the disk; what runs is queued again at the
     * next start. */
    _exit(EXIT_SUCCESS);
}

static void
let_second_signal_kill(const sigset_t *stop)
{
    struct sigaction action = {.sa_handler = leave_at_once};
    for (int i = 1; i < NSIG; i++) {
        if (sigismember(stop, i) == 1)
            sigaction(i, &action, NULL);
    }
    sigprocmask(SIG_UNBLOCK, stop, NULL);
}

/* While running jobs finish, HTTP still answers: whoever waits for one of them
 * gets it. Then the order of building, backwards. */
static void
close_house(struct house *house)
{
    struct pool *pool = atomic_load(&house->pool);
    if (house->http != NULL)
        api_drain(house->api);
    if (pool != NULL)
        pool_drain(pool, GRACE_MS);
    if (house->http != NULL) {
        http_quiesce(house->http);
        http_stop(house->http);
    }
    if (house->store != NULL)
        store_close(house->store);
    if (house->blobs != NULL)
        blobs_close(house->blobs);
    pool_stop(pool, 0);
    if (house->api != NULL)
        api_free(house->api);
}

int
main(int argc, char **argv)
{
    static struct house house;
    int status;
    if (config_read(argc, argv, &house.config, &status) != CONFIG_RUN)
        return status;

    sigset_t stop;
    block_signals(&stop);
    /* Four threads need no arena each: a daemon at rest stays small. */
    mallopt(M_ARENA_MAX, 2);
    umask(077);
    log_setup(house.config.log_level, house.config.log_format);
    fit_descriptors(&house.config);
    /* The random numbers of ids are set up by their first use: here, where
     * there is one thread. */
    char id[ID_SIZE];
    ulid_id("req", id);

    struct error err = {0};
    status = EXIT_FAILURE;
    if (!start_api(&house, &err) || !open_store(&house, &err) ||
        !start_pool(&house, &err) || !start_http(&house, &err)) {
        fprintf(stderr, "glintd: %s\n", err.text);
        goto out;
    }
    print_banner(&house);

    int caught;
    while ((caught = sigwaitinfo(&stop, NULL)) < 0 && errno == EINTR)
        continue;
    let_second_signal_kill(&stop);
    log_write(LOG_INFO, "main", "%s: finishing what runs, for up to %d s",
              strsignal(caught), GRACE_MS / 1000);
    status = EXIT_SUCCESS;
out:
    close_house(&house);
    if (status == EXIT_SUCCESS)
        log_write(LOG_INFO, "main", "stopped");
    return status;
}
