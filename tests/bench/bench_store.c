/* bench_store - durable submissions and claims per second, beside a raw append
 * + fdatasync of the same bytes, interleaved, for disks change from hour to
 * hour: quote the ratios.
 *
 *     bench_store [seconds per measurement, default 1] [queued, default 200000]
 *
 * Works in a folder below the current one and removes it. */
#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/base/clock.h"
#include "server/store/store.h"

enum { SCENE_LEN = 2048, PRODUCERS_MAX = 64 };

static char folder[] = "bench-store-XXXXXX";
static char scene[SCENE_LEN + 1];
static struct store *store;
static int64_t deadline_us;
static atomic_ulong done_count;

struct waiter {
    pthread_mutex_t lock;
    pthread_cond_t wake;
    bool done;
    char id[ID_SIZE];
    uint32_t epoch;
};

static void
wake(struct waiter *w)
{
    pthread_mutex_lock(&w->lock);
    w->done = true;
    pthread_cond_signal(&w->wake);
    pthread_mutex_unlock(&w->lock);
}

static void
wait_for(struct waiter *w)
{
    pthread_mutex_lock(&w->lock);
    while (!w->done)
        pthread_cond_wait(&w->wake, &w->lock);
    w->done = false;
    pthread_mutex_unlock(&w->lock);
}

static void
on_done(void *user, const struct job *job, const struct error *err)
{
    (void)job;
    if (err->code != ERROR_NONE) {
        fprintf(stderr, "bench_store: %s\n", err->text);
        exit(1);
    }
    atomic_fetch_add(&done_count, 1);
    if (user != NULL)
        wake(user);
}

static void
on_lease(void *user, struct lease *lease, const struct error *err)
{
    struct waiter *w = user;
    if (lease == NULL) {
        fprintf(stderr, "bench_store: no lease: %s\n", err->text);
        exit(1);
    }
    memcpy(w->id, lease->job.id, sizeof w->id);
    w->epoch = lease->job.epoch;
    lease_free(lease);
    wake(w);
}

static struct job
next_job(void)
{
    struct job job = {.priority = PRIORITY_NORMAL, .estimate_seconds = 1};
    ulid_id("job", job.id);
    snprintf(job.owner, sizeof job.owner, "key_%c", 'a' + job.id[20] % 16);
    snprintf(job.render_key, sizeof job.render_key, "%064d", 7);
    snprintf(job.output, sizeof job.output, "{\"format\":\"png\"}");
    snprintf(job.settings, sizeof job.settings, "{\"film\":{\"width\":1280}}");
    return job;
}

static void *
produce(void *arg)
{
    struct waiter *w = arg;
    while (clock_monotonic_us() < deadline_us) {
        struct job job = next_job();
        if (store_submit(store, &job, scene, SCENE_LEN, on_done, w, NULL))
            wait_for(w);
    }
    return NULL;
}

static double
submits_per_second(int producers, double seconds)
{
    pthread_t threads[PRODUCERS_MAX];
    static struct waiter waiters[PRODUCERS_MAX];
    atomic_store(&done_count, 0);
    int64_t start = clock_monotonic_us();
    deadline_us = start + (int64_t)(seconds * 1e6);
    for (int i = 0; i < producers; i++) {
        waiters[i] = (struct waiter){.lock = PTHREAD_MUTEX_INITIALIZER,
                                     .wake = PTHREAD_COND_INITIALIZER};
        pthread_create(&threads[i], NULL, produce, &waiters[i]);
    }
    for (int i = 0; i < producers; i++)
        pthread_join(threads[i], NULL);
    return (double)atomic_load(&done_count) * 1e6 /
           (double)(clock_monotonic_us() - start);
}

static double
raw_per_second(double seconds)
{
    char path[64];
    snprintf(path, sizeof path, "%s/raw", folder);
    int fd = open(path, O_WRONLY | O_CREAT | O_APPEND, 0600);
    int64_t start = clock_monotonic_us();
    int64_t end = start + (int64_t)(seconds * 1e6);
    unsigned long count = 0;
    while (clock_monotonic_us() < end) {
        if (write(fd, scene, SCENE_LEN) != SCENE_LEN || fdatasync(fd) != 0)
            exit(1);
        count++;
    }
    close(fd);
    return (double)count * 1e6 / (double)(clock_monotonic_us() - start);
}

/* Lease one, give it back: the queue stays as long as it is. */
static double
claims_per_second(double seconds)
{
    struct waiter w = {.lock = PTHREAD_MUTEX_INITIALIZER,
                       .wake = PTHREAD_COND_INITIALIZER};
    int64_t start = clock_monotonic_us();
    int64_t end = start + (int64_t)(seconds * 1e6);
    unsigned long count = 0;
    while (clock_monotonic_us() < end) {
        store_lease(store, 0, on_lease, &w, NULL);
        wait_for(&w);
        store_fail(store, w.id, w.epoch, FAILURE_RELEASE, ERROR_NONE, NULL,
                   on_done, &w, NULL);
        wait_for(&w);
        count++;
    }
    return (double)count * 1e6 / (double)(clock_monotonic_us() - start);
}

static double
fill(unsigned long queued)
{
    struct store_counts counts;
    store_count(store, &counts, NULL);
    int64_t start = clock_monotonic_us();
    unsigned long more = queued - counts.jobs[JOB_QUEUED];
    for (unsigned long i = 0; i < more; i++) {
        struct job job = next_job();
        while (
            !store_submit(store, &job, scene, SCENE_LEN, on_done, NULL, NULL))
            usleep(100);
    }
    do {
        usleep(1000);
        store_count(store, &counts, NULL);
    } while (counts.jobs[JOB_QUEUED] < queued);
    return (double)more * 1e6 / (double)(clock_monotonic_us() - start);
}

static void
remove_files(void)
{
    static const char *const names[] = {"db", "db-wal", "db-shm", "db.lock",
                                        "raw"};
    char path[64];
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        unlink(path);
    }
}

static double
open_store(void)
{
    char path[64];
    struct error err = {0};
    snprintf(path, sizeof path, "%s/db", folder);
    struct store_options options = {.path = path};
    int64_t start = clock_monotonic_us();
    store = store_open_sqlite(&options, &err);
    if (store == NULL) {
        fprintf(stderr, "bench_store: %s\n", err.text);
        exit(1);
    }
    return (double)(clock_monotonic_us() - start) / 1e3;
}

static void
measure_submits(double seconds)
{
    static const int producers[] = {1, 8, 64};
    for (int i = 0; i < 3; i++) {
        double raw = raw_per_second(seconds / 2);
        double rate = submits_per_second(producers[i], seconds);
        raw = (raw + raw_per_second(seconds / 2)) / 2;
        printf("submit, %2d producers  %8.0f /s   raw append + fdatasync "
               "%6.0f /s   ratio %.2f\n",
               producers[i], rate, raw, rate / raw);
    }
}

int
main(int argc, char **argv)
{
    double seconds = argc > 1 ? strtod(argv[1], NULL) : 1;
    unsigned long queued = argc > 2 ? strtoul(argv[2], NULL, 10) : 200000;
    memset(scene, 'x', SCENE_LEN);
    if (mkdtemp(folder) == NULL)
        return 1;
    open_store();
    printf("%s, scenes of %d bytes\n", store_describe(store), SCENE_LEN);
    measure_submits(seconds);
    store_close(store);
    remove_files();

    open_store();
    fill(10);
    double few = claims_per_second(seconds);
    double bulk = fill(queued);
    double many = claims_per_second(seconds);
    printf("submit, pipelined     %8.0f /s\n", bulk);
    printf("claim + release       %8.0f /s with 10 queued, %.0f /s with %lu: "
           "ratio %.2f\n",
           few, many, queued, many / few);
    struct waiter w = {.lock = PTHREAD_MUTEX_INITIALIZER,
                       .wake = PTHREAD_COND_INITIALIZER};
    store_lease(store, 0, on_lease, &w, NULL);
    wait_for(&w);
    store_close(store);
    printf("open with %lu queued %6.0f ms\n", queued, open_store());
    store_close(store);
    remove_files();
    rmdir(folder);
    return 0;
}
