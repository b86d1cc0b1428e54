#include "tests/contract/store/harness.h"

#include <dirent.h>
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#include "core/base/log.h"

const char *const backend_names[BACKEND_COUNT] = {"memory", "sqlite"};

/* cmocka's asserts are for the test's own thread; this one is for any. */
static void
need(bool ok, const char *what)
{
    if (ok)
        return;
    fprintf(stderr, "harness: %s\n", what);
    abort();
}

void
make_folder(char *path, size_t size)
{
    const char *build = getenv("GLINT_BUILD");
    snprintf(path, size, "%s/store-test-XXXXXX",
             build != NULL && build[0] == '/' ? build : "/tmp");
    need(mkdtemp(path) != NULL, "cannot make a temporary folder");
}

void
remove_folder(const char *path)
{
    DIR *folder = opendir(path);
    if (folder == NULL)
        return;
    struct dirent *entry;
    while ((entry = readdir(folder)) != NULL) {
        char name[PATH_MAX];
        if (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0)
            continue;
        snprintf(name, sizeof name, "%s/%s", path, entry->d_name);
        if (unlink(name) != 0)
            remove_folder(name);
    }
    closedir(folder);
    rmdir(path);
}

static void
open_store(struct harness *h)
{
    struct error err = {0};
    h->options.path = h->path;
    h->store = h->backend == BACKEND_MEMORY
                   ? store_open_memory(&h->options, &err)
                   : store_open_sqlite(&h->options, &err);
    need(h->store != NULL, err.text);
}

void
harness_open_with(struct harness *h, enum backend backend,
                  store_change_fn on_change, void *user)
{
    memset(h, 0, sizeof *h);
    log_setup(LOG_WARN, LOG_AUTO);
    h->backend = backend;
    h->options.on_change = on_change;
    h->options.user = user;
    make_folder(h->folder, sizeof h->folder);
    snprintf(h->path, sizeof h->path, "%s/glint.db", h->folder);
    open_store(h);
}

void
harness_open(struct harness *h, enum backend backend)
{
    harness_open_with(h, backend, NULL, NULL);
}

void
harness_reopen(struct harness *h)
{
    if (h->backend == BACKEND_MEMORY)
        return;
    store_close(h->store);
    open_store(h);
}

void
harness_close(struct harness *h)
{
    store_close(h->store);
    remove_folder(h->folder);
}

struct job
new_job(const char *owner, enum job_priority priority, double seconds)
{
    struct job job = {0};
    ulid_id("job", job.id);
    snprintf(job.owner, sizeof job.owner, "%s", owner);
    job.priority = priority;
    job.estimate_seconds = seconds;
    job.max_attempts = 3;
    snprintf(job.render_key, sizeof job.render_key, "%064d", 1);
    snprintf(job.media_type, sizeof job.media_type, "image/png");
    return job;
}

/* --- waiting --- */

static void
wait_until(pthread_cond_t *wake, pthread_mutex_t *lock, const bool *done)
{
    struct timespec deadline;
    clock_gettime(CLOCK_REALTIME, &deadline);
    deadline.tv_sec += 30;
    while (!*done)
        need(pthread_cond_timedwait(wake, lock, &deadline) != ETIMEDOUT,
             "no answer in 30 s");
}

void
waiter_init(struct waiter *w)
{
    memset(w, 0, sizeof *w);
    pthread_mutex_init(&w->lock, NULL);
    pthread_cond_init(&w->wake, NULL);
}

void
waiter_wait(struct waiter *w)
{
    pthread_mutex_lock(&w->lock);
    wait_until(&w->wake, &w->lock, &w->done);
    pthread_mutex_unlock(&w->lock);
}

void
waiter_clear(struct waiter *w)
{
    lease_free(w->lease);
    pthread_mutex_destroy(&w->lock);
    pthread_cond_destroy(&w->wake);
}

void
waiter_done(void *user, const struct job *job, const struct error *err)
{
    struct waiter *w = user;
    pthread_mutex_lock(&w->lock);
    need(!w->done, "one write was answered twice");
    if (job != NULL)
        w->job = *job;
    w->err = *err;
    w->done = true;
    pthread_cond_signal(&w->wake);
    pthread_mutex_unlock(&w->lock);
}

void
waiter_lease(void *user, struct lease *lease, const struct error *err)
{
    struct waiter *w = user;
    w->lease = lease;
    waiter_done(user, lease != NULL ? &lease->job : NULL, err);
}

void
gate_init(struct gate *g)
{
    memset(g, 0, sizeof *g);
    pthread_mutex_init(&g->lock, NULL);
    pthread_cond_init(&g->wake, NULL);
}

void
gate_hold(void *user, const struct job *job, const struct error *err)
{
    struct gate *g = user;
    (void)job;
    (void)err;
    pthread_mutex_lock(&g->lock);
    g->reached = true;
    pthread_cond_broadcast(&g->wake);
    wait_until(&g->wake, &g->lock, &g->open);
    pthread_mutex_unlock(&g->lock);
}

void
gate_wait_reached(struct gate *g)
{
    pthread_mutex_lock(&g->lock);
    wait_until(&g->wake, &g->lock, &g->reached);
    pthread_mutex_unlock(&g->lock);
}

void
gate_open(struct gate *g)
{
    pthread_mutex_lock(&g->lock);
    g->open = true;
    pthread_cond_broadcast(&g->wake);
    pthread_mutex_unlock(&g->lock);
}

/* --- calls that wait --- */

static enum error_code
finish_wait(struct waiter *w, bool queued, struct job *out)
{
    need(queued, "a write was not queued");
    waiter_wait(w);
    if (out != NULL)
        *out = w->job;
    enum error_code code = w->err.code;
    waiter_clear(w);
    return code;
}

enum error_code
do_submit(struct harness *h, const struct job *job, const char *scene,
          struct job *out)
{
    struct waiter w;
    waiter_init(&w);
    bool ok = store_submit(h->store, job, scene, strlen(scene), waiter_done, &w,
                           NULL);
    return finish_wait(&w, ok, out);
}

struct lease *
do_lease(struct harness *h, double max_seconds)
{
    struct waiter w;
    waiter_init(&w);
    need(store_lease(h->store, max_seconds, waiter_lease, &w, NULL),
         "a lease was not queued");
    waiter_wait(&w);
    need(w.err.code == ERROR_NONE, w.err.text);
    struct lease *lease = w.lease;
    w.lease = NULL;
    waiter_clear(&w);
    return lease;
}

enum error_code
do_finish(struct harness *h, const char *id, uint32_t epoch, const char *result,
          struct job *out)
{
    struct waiter w;
    struct job_stats stats = {.rays_camera = 7, .trace_ms = 1.5};
    waiter_init(&w);
    bool ok = store_finish(h->store, id, epoch, result, 1234, &stats,
                           waiter_done, &w, NULL);
    return finish_wait(&w, ok, out);
}

enum error_code
do_fail(struct harness *h, const char *id, uint32_t epoch,
        enum store_failure failure, struct job *out)
{
    struct waiter w;
    waiter_init(&w);
    bool ok = store_fail(h->store, id, epoch, failure, ERROR_WORKER_CRASHED,
                         "the worker died of signal 11", waiter_done, &w, NULL);
    return finish_wait(&w, ok, out);
}

enum error_code
do_cancel(struct harness *h, const char *id, struct job *out)
{
    struct waiter w;
    waiter_init(&w);
    bool ok = store_cancel(h->store, id, waiter_done, &w, NULL);
    return finish_wait(&w, ok, out);
}

enum error_code
do_delete(struct harness *h, const char *id, struct job *out)
{
    struct waiter w;
    waiter_init(&w);
    bool ok = store_delete(h->store, id, waiter_done, &w, NULL);
    return finish_wait(&w, ok, out);
}

void
do_heartbeat(struct harness *h, const char *id, uint32_t epoch,
             enum job_phase phase, double progress, uint64_t rays)
{
    need(store_heartbeat(h->store, id, epoch, phase, progress, rays, NULL),
         "a heartbeat was not queued");
    do_settle(h);
}

void
do_settle(struct harness *h)
{
    /* A write of nothing: the queue is first in, first out. */
    struct waiter w;
    waiter_init(&w);
    while (!store_cancel(h->store, "job_nobody", waiter_done, &w, NULL))
        usleep(200);
    finish_wait(&w, true, NULL);
}

struct job
get(struct harness *h, const char *id)
{
    struct job job;
    struct error err = {0};
    need(store_get(h->store, id, &job, &err), err.text);
    return job;
}

bool
exists(struct harness *h, const char *id)
{
    struct job job;
    struct error err = {0};
    bool found = store_get(h->store, id, &job, &err);
    need(found || err.code == ERROR_NOT_FOUND, err.text);
    return found;
}

struct store_counts
counts(struct harness *h)
{
    struct store_counts c;
    struct error err = {0};
    need(store_count(h->store, &c, &err), err.text);
    return c;
}
