#include "tests/unit/pool/rig.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <dirent.h>
#include <ftw.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "core/base/clock.h"

int64_t
rig_now_ms(void)
{
    return clock_monotonic_us() / 1000;
}

void
rig_sleep_ms(int64_t ms)
{
    struct timespec time = {ms / 1000, ms % 1000 * 1000000};
    nanosleep(&time, NULL);
}

/* As main.c does it. */
static void
on_change(void *user, const struct job *job, bool deleted)
{
    struct rig *rig = user;
    struct pool *pool = atomic_load(&rig->pool);
    if (pool == NULL)
        return;
    pool_kick(pool);
    if (deleted && job->result[0] != '\0')
        pool_forget_blob(pool, job->result);
}

void
rig_start_pool(struct rig *rig)
{
    struct error err = {0};
    atomic_store(&rig->pool, pool_start(&rig->options, &err));
    if (atomic_load(&rig->pool) == NULL)
        fail_msg("pool_start: %s", err.text);
}

void
rig_open(struct rig *rig, struct pool_options options)
{
    *rig = (struct rig){0};
    snprintf(rig->folder, sizeof rig->folder, "/tmp/glint-pool-XXXXXX");
    assert_non_null(mkdtemp(rig->folder));
    struct error err = {0};
    struct store_options store = {.on_change = on_change, .user = rig};
    rig->store = store_open_memory(&store, &err);
    char path[80];
    snprintf(path, sizeof path, "%s/blobs", rig->folder);
    rig->blobs = blobs_open_dir(path, &err);
    if (rig->store == NULL || rig->blobs == NULL)
        fail_msg("rig: %s", err.text);
    options.store = rig->store;
    options.blobs = rig->blobs;
    if (options.workers == 0)
        options.workers = 1;
    if (options.threads == 0)
        options.threads = 2;
    if (options.max_render_seconds <= 0)
        options.max_render_seconds = 60;
    if (options.max_render_bytes == 0)
        options.max_render_bytes = 1 << 30;
    if (options.stall_ms == 0)
        options.stall_ms = 30000;
    rig->options = options;
    rig_start_pool(rig);
}

void
rig_stop_pool(struct rig *rig, int64_t grace_ms)
{
    struct pool *pool = atomic_load(&rig->pool);
    if (pool == NULL)
        return;
    pool_drain(pool, grace_ms);
    atomic_store(&rig->pool, NULL);
    /* on_change may still hold it for a moment; in the service the store is
     * closed before the pool is freed. */
    struct store_counts counts;
    do {
        rig_sleep_ms(2);
        assert_true(store_count(rig->store, &counts, NULL));
    } while (counts.pending_writes > 0);
    rig_sleep_ms(20);
    pool_stop(pool, 0);
}

static int
remove_one(const char *path, const struct stat *about, int kind,
           struct FTW *walk)
{
    (void)about;
    (void)kind;
    (void)walk;
    return remove(path);
}

void
rig_close(struct rig *rig)
{
    rig_stop_pool(rig, 0);
    store_close(rig->store);
    blobs_close(rig->blobs);
    nftw(rig->folder, remove_one, 8, FTW_DEPTH | FTW_PHYS);
    pid_t left;
    assert_int_equal(rig_workers(&left, 1), 0);
}

/* --- jobs --- */

struct waiter {
    atomic_int state; /* 0: not yet, 1: fine, 2: refused */
    struct error err;
};

static void
on_done(void *user, const struct job *job, const struct error *err)
{
    (void)job;
    struct waiter *waiter = user;
    waiter->err = *err;
    atomic_store(&waiter->state, err->code == ERROR_NONE ? 1 : 2);
}

static void
wait_done(struct waiter *waiter)
{
    while (atomic_load(&waiter->state) == 0)
        rig_sleep_ms(1);
    if (atomic_load(&waiter->state) == 2)
        fail_msg("store: %s", waiter->err.text);
}

void
rig_submit(struct rig *rig, const char *scene, unsigned max_attempts,
           char id[ID_SIZE])
{
    struct job job = {.max_attempts = max_attempts,
                      .priority = PRIORITY_NORMAL,
                      .estimate_seconds = 1};
    ulid_id("job", job.id);
    memcpy(id, job.id, ID_SIZE);
    snprintf(job.output, sizeof job.output, "{\"format\":\"png\"}");
    snprintf(job.media_type, sizeof job.media_type, "image/png");
    snprintf(job.settings, sizeof job.settings, "{}");
    struct waiter waiter = {0};
    assert_true(store_submit(rig->store, &job, scene, strlen(scene), on_done,
                             &waiter, NULL));
    wait_done(&waiter);
}

void
rig_cancel(struct rig *rig, const char *id)
{
    struct waiter waiter = {0};
    assert_true(store_cancel(rig->store, id, on_done, &waiter, NULL));
    wait_done(&waiter);
}

void
rig_delete(struct rig *rig, const char *id)
{
    struct waiter waiter = {0};
    assert_true(store_delete(rig->store, id, on_done, &waiter, NULL));
    wait_done(&waiter);
}

struct job
rig_get(struct rig *rig, const char *id)
{
    struct job job;
    struct error err = {0};
    if (!store_get(rig->store, id, &job, &err))
        fail_msg("store_get: %s", err.text);
    return job;
}

struct job
rig_wait(struct rig *rig, const char *id, enum job_state state, int64_t ms)
{
    int64_t end = rig_now_ms() + ms;
    for (;;) {
        struct job job = rig_get(rig, id);
        if (job.state == state)
            return job;
        if (job_is_over(job.state))
            fail_msg("the job is %s, not %s: %s (%s)",
                     job_state_name(job.state), job_state_name(state),
                     job.error_text, error_code_name(job.error_code));
        if (rig_now_ms() > end)
            fail_msg("the job is %s, not %s, after %lld ms",
                     job_state_name(job.state), job_state_name(state),
                     (long long)ms);
        rig_sleep_ms(2);
    }
}

void
rig_wait_tracing(struct rig *rig, const char *id)
{
    for (int64_t end = rig_now_ms() + 30000;;) {
        struct job job = rig_get(rig, id);
        if (job.state == JOB_RUNNING && job.phase == JOB_TRACING &&
            job.progress > 0)
            return;
        if (job_is_over(job.state) || rig_now_ms() > end)
            fail_msg("the job was never seen tracing; it is %s",
                     job_state_name(job.state));
        rig_sleep_ms(2);
    }
}

/* --- workers --- */

struct pool_status
rig_status(struct rig *rig)
{
    struct pool_status status;
    pool_status(atomic_load(&rig->pool), &status);
    return status;
}

void
rig_wait_ready(struct rig *rig, unsigned count, int64_t ms)
{
    int64_t end = rig_now_ms() + ms;
    while (rig_status(rig).ready < count) {
        if (rig_now_ms() > end)
            fail_msg("%u workers ready after %lld ms", rig_status(rig).ready,
                     (long long)ms);
        rig_sleep_ms(1);
    }
}

unsigned
rig_workers(pid_t *pids, unsigned max)
{
    unsigned count = 0;
    DIR *proc = opendir("/proc");
    assert_non_null(proc);
    for (struct dirent *entry; (entry = readdir(proc)) != NULL;) {
        char path[300], text[512] = "";
        snprintf(path, sizeof path, "/proc/%s/stat", entry->d_name);
        FILE *file = entry->d_name[0] >= '1' && entry->d_name[0] <= '9'
                         ? fopen(path, "r")
                         : NULL;
        if (file == NULL)
            continue;
        if (fgets(text, sizeof text, file) == NULL)
            text[0] = '\0';
        fclose(file);
        /* pid (name) state parent */
        const char *rest = strrchr(text, ')');
        char state;
        int parent;
        if (rest != NULL && sscanf(rest, ") %c %d", &state, &parent) == 2 &&
            parent == getpid() && state != 'Z' && count < max)
            pids[count++] = atoi(entry->d_name);
    }
    closedir(proc);
    return count;
}

void
rig_signal_workers(int number)
{
    pid_t pids[16];
    unsigned count = rig_workers(pids, 16);
    for (unsigned i = 0; i < count; i++)
        kill(pids[i], number);
}

bool
rig_has_blob(struct rig *rig, const char *sha256)
{
    uint64_t len;
    int fd = blobs_get(rig->blobs, sha256, &len, NULL);
    if (fd >= 0)
        close(fd);
    return fd >= 0;
}
