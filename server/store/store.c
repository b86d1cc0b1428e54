#include "server/store/store.h"

#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/base/clock.h"
#include "core/base/log.h"
#include "core/base/must.h"
#include "server/store/apply.h"
#include "server/store/board.h"
#include "server/store/rows.h"

struct store {
    struct rows *writer, *reader;
    store_change_fn on_change;
    void *user;
    char describe[64];
    pthread_t thread;

    /* Guards the rest of this group. */
    pthread_mutex_t lock;
    pthread_cond_t wake;
    struct write *first, **last;
    size_t pending, pending_bytes;
    bool closing;
    struct board board; /* the writer thread alone changes it */
    uint64_t counts[JOB_STATE_COUNT];

    /* Guards `reader`; and `writer` where both are the same. Taken before
     * `lock` if both are needed. */
    pthread_mutex_t read_lock;

    /* The writer thread's own. */
    struct batch batch;
    struct write *taken[BATCH_MAX];
    size_t taken_count;
    bool full; /* the disk, when last written to */
};

/* --- the queue --- */

/* Who holds a lease must be able to end it while the queue is full of
 * submissions. */
static const struct {
    size_t places;
} kinds[WRITE_KIND_COUNT] = {
    [WRITE_SUBMIT] = {STORE_PENDING_MAX},
    [WRITE_CANCEL] = {STORE_PENDING_MAX},
    [WRITE_DELETE] = {STORE_PENDING_MAX},
    [WRITE_LEASE] = {STORE_PENDING_MAX + STORE_PENDING_RESERVE},
    [WRITE_HEARTBEAT] = {STORE_PENDING_MAX + STORE_PENDING_RESERVE},
    [WRITE_FINISH] = {STORE_PENDING_MAX + STORE_PENDING_RESERVE},
    [WRITE_FAIL] = {STORE_PENDING_MAX + STORE_PENDING_RESERVE},
};

static struct write *
new_write(enum write_kind kind, const char *id, uint32_t epoch, void *user,
          struct error *err)
{
    struct write *write = calloc(1, sizeof *write);
    if (write == NULL) {
        error_set(err, ERROR_MEMORY, "no memory for a write to the store");
        return NULL;
    }
    write->kind = kind;
    /* A name that is too long is nobody's. */
    if (id != NULL && strlen(id) < sizeof write->id)
        memcpy(write->id, id, strlen(id) + 1);
    write->epoch = epoch;
    write->user = user;
    return write;
}

/* Takes `write` over, also on failure. */
static bool
push(struct store *store, struct write *write, struct error *err)
{
    bool ok = false;
    pthread_mutex_lock(&store->lock);
    if (store->closing) {
        error_set(err, ERROR_DRAINING, "the store is being closed");
    } else if (store->pending >= kinds[write->kind].places) {
        error_set(err, ERROR_QUEUE_FULL,
                  "%zu writes to the store are waiting, the limit is %zu",
                  store->pending, kinds[write->kind].places);
    } else if (write->scene.len >
               STORE_PENDING_BYTES_MAX - store->pending_bytes) {
        error_set(err, ERROR_QUEUE_FULL,
                  "%zu bytes of scenes are waiting to be stored, the limit "
                  "is %d",
                  store->pending_bytes, STORE_PENDING_BYTES_MAX);
    } else {
        *store->last = write;
        store->last = &write->next;
        store->pending++;
        store->pending_bytes += write->scene.len;
        if (store->pending == 1)
            pthread_cond_signal(&store->wake);
        ok = true;
    }
    pthread_mutex_unlock(&store->lock);
    if (!ok)
        write_free(write);
    return ok;
}

/* Wait for writes and take what one batch holds. False: closed and empty. */
static bool
take(struct store *store)
{
    size_t bytes = 0;
    store->taken_count = 0;
    pthread_mutex_lock(&store->lock);
    while (store->first == NULL && !store->closing)
        pthread_cond_wait(&store->wake, &store->lock);
    while (store->first != NULL && store->taken_count < BATCH_MAX &&
           bytes < BATCH_BYTES_MAX) {
        struct write *write = store->first;
        store->first = write->next;
        store->pending--;
        store->pending_bytes -= write->scene.len;
        bytes += write->scene.len;
        store->taken[store->taken_count++] = write;
    }
    if (store->first == NULL)
        store->last = &store->first;
    pthread_mutex_unlock(&store->lock);
    return store->taken_count > 0;
}

/* --- one batch --- */

/* After a failed write or fsync nobody knows what the disk holds: pages may be
 * lost that a later fsync reports as written. Nothing of this batch was
 * acknowledged; the next start finds out from the disk. */
static _Noreturn void
stop_process(const struct error *err)
{
    log_write(LOG_ERROR, "store", "stopping, a write failed: %s", err->text);
    _exit(STORE_EXIT_STATUS);
}

static bool
keep_counts(struct store *store, struct error *err)
{
    struct rows *rows = store->writer;
    bool ok = true;
    for (int i = 0; i < JOB_STATE_COUNT && rows->ops->add_count != NULL; i++) {
        int64_t more = store->batch.counted[i];
        if (more != 0)
            ok = ok && rows->ops->add_count(rows, (enum job_state)i, more, err);
    }
    return ok;
}

static bool
transaction(struct store *store, struct error *err)
{
    struct rows *rows = store->writer;
    bool ok = rows->ops->begin(rows, err) && batch_apply(&store->batch, err) &&
              keep_counts(store, err) && rows->ops->commit(rows, err);
    if (!ok && rows->ops->rollback != NULL)
        rows->ops->rollback(rows);
    return ok;
}

/* Refuse all writes of the batch, or only submissions. */
static void
refuse(struct batch *batch, bool submits_only, const struct error *err)
{
    size_t kept = 0;
    for (size_t i = 0; i < batch->count; i++) {
        struct write *write = batch->writes[i];
        write->err = (struct error){0};
        write->changed = false;
        if (submits_only && write->kind != WRITE_SUBMIT)
            batch->writes[kept++] = write;
        else
            write->err = *err;
    }
    batch->count = kept;
}

/* Say it once, and once when it is over. */
static void
note_full(struct store *store, bool full)
{
    if (full && !store->full)
        log_write(LOG_WARN, "store", "the disk is full, new jobs are refused");
    if (!full && store->full)
        log_write(LOG_INFO, "store", "the disk has room again");
    store->full = full;
}

static void
commit_taken(struct store *store)
{
    struct batch *batch = &store->batch;
    const size_t size = sizeof(struct write *);
    memcpy(batch->writes, store->taken, store->taken_count * size);
    batch->count = store->taken_count;
    batch->now_ms = clock_wall_ms();
    struct error err = {0};
    if (transaction(store, &err)) {
        note_full(store, false);
        return;
    }
    /* A full disk refuses newcomers; what ends or deletes jobs tries again. */
    if (err.code == ERROR_STORAGE_FULL) {
        note_full(store, true);
        refuse(batch, true, &err);
        err = (struct error){0};
        if (transaction(store, &err))
            return;
    }
    if (err.code != ERROR_STORAGE_FULL && err.code != ERROR_MEMORY)
        stop_process(&err);
    refuse(batch, false, &err);
    memset(batch->counted, 0, sizeof batch->counted);
}

/* The commit is durable: let readers see what is kept beside the rows. */
static void
publish(struct store *store)
{
    pthread_mutex_lock(&store->lock);
    for (size_t i = 0; i < store->taken_count; i++) {
        const struct write *write = store->taken[i];
        if (!write->changed || !write->latest)
            continue;
        if (write->kind == WRITE_HEARTBEAT)
            board_note(&store->board, &write->row.job);
        else
            board_wipe(&store->board, write->row.job.id);
    }
    for (int i = 0; i < JOB_STATE_COUNT; i++)
        store->counts[i] += (uint64_t)store->batch.counted[i];
    pthread_mutex_unlock(&store->lock);
}

static void
answer(struct store *store)
{
    for (size_t i = 0; i < store->taken_count; i++) {
        struct write *write = store->taken[i];
        bool ok = write->err.code == ERROR_NONE;
        if (write->lease_done != NULL) {
            struct lease *lease = ok ? write->lease : NULL;
            if (ok)
                write->lease = NULL;
            write->lease_done(write->user, lease, &write->err);
        } else if (write->done != NULL) {
            write->done(write->user, ok ? &write->row.job : NULL, &write->err);
        }
    }
    for (size_t i = 0; i < store->taken_count; i++) {
        struct write *write = store->taken[i];
        if (write->changed && write->latest && store->on_change != NULL)
            store->on_change(store->user, &write->row.job, write->deleted);
        write_free(write);
    }
}

static void *
write_all(void *arg)
{
    struct store *store = arg;
    bool shared = store->writer == store->reader;
    struct error err = {0};
    while (take(store)) {
        if (shared)
            pthread_mutex_lock(&store->read_lock);
        commit_taken(store);
        if (shared)
            pthread_mutex_unlock(&store->read_lock);
        publish(store);
        answer(store);
        if (store->writer->ops->upkeep != NULL &&
            !store->writer->ops->upkeep(store->writer, &err))
            stop_process(&err);
    }
    return NULL;
}

/* --- open, close --- */

static void
free_store(struct store *store)
{
    if (store->reader != store->writer)
        store->reader->ops->close(store->reader);
    store->writer->ops->close(store->writer);
    board_clear(&store->board);
    pthread_mutex_destroy(&store->lock);
    pthread_mutex_destroy(&store->read_lock);
    pthread_cond_destroy(&store->wake);
    free(store);
}

/* Signals are for the program's first thread. */
static int
start_thread(struct store *store)
{
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    int rc = pthread_create(&store->thread, NULL, write_all, store);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return rc;
}

struct store *
store_start(struct rows *writer, struct rows *reader, const char *describe,
            const struct store_options *options, struct error *err)
{
    struct store *store = calloc(1, sizeof *store);
    if (store == NULL) {
        if (reader != writer)
            reader->ops->close(reader);
        writer->ops->close(writer);
        error_set(err, ERROR_MEMORY, "no memory for the store");
        return NULL;
    }
    store->writer = writer;
    store->reader = reader;
    store->on_change = options->on_change;
    store->user = options->user;
    snprintf(store->describe, sizeof store->describe, "%s", describe);
    store->last = &store->first;
    store->batch.rows = writer;
    store->batch.board = &store->board;
    pthread_mutex_init(&store->lock, NULL);
    pthread_mutex_init(&store->read_lock, NULL);
    pthread_cond_init(&store->wake, NULL);
    int rc = 0;
    if (!reader->ops->count(reader, store->counts, err) ||
        (rc = start_thread(store)) != 0) {
        if (rc != 0)
            error_errno(err, ERROR_MEMORY, rc,
                        "cannot start the store's writer thread");
        free_store(store);
        return NULL;
    }
    return store;
}

void
store_close(struct store *store)
{
    if (store == NULL)
        return;
    pthread_mutex_lock(&store->lock);
    store->closing = true;
    pthread_cond_signal(&store->wake);
    pthread_mutex_unlock(&store->lock);
    pthread_join(store->thread, NULL);
    free_store(store);
}

/* --- writes --- */

bool
store_submit(struct store *store, const struct job *job, const char *scene,
             size_t scene_len, store_done_fn done, void *user,
             struct error *err)
{
    MUST(job->id[0] != '\0');
    struct write *write = new_write(WRITE_SUBMIT, job->id, 0, user, err);
    if (write == NULL)
        return false;
    write->done = done;
    write->row.job = *job;
    bytes_append(&write->scene, scene, scene_len);
    if (write->scene.failed) {
        write_free(write);
        return error_set(err, ERROR_MEMORY,
                         "no memory for a scene of %zu bytes", scene_len);
    }
    return push(store, write, err);
}

bool
store_lease(struct store *store, double max_seconds, store_lease_fn done,
            void *user, struct error *err)
{
    MUST(done != NULL);
    struct write *write = new_write(WRITE_LEASE, NULL, 0, user, err);
    if (write == NULL)
        return false;
    write->lease_done = done;
    write->max_seconds = max_seconds;
    return push(store, write, err);
}

void
lease_free(struct lease *lease)
{
    if (lease == NULL)
        return;
    bytes_clear(&lease->scene);
    free(lease);
}

bool
store_heartbeat(struct store *store, const char *id, uint32_t epoch,
                enum job_phase phase, double progress, uint64_t rays_done,
                struct error *err)
{
    struct write *write = new_write(WRITE_HEARTBEAT, id, epoch, NULL, err);
    if (write == NULL)
        return false;
    write->phase = phase;
    write->progress = progress;
    write->rays_done = rays_done;
    return push(store, write, err);
}

bool
store_finish(struct store *store, const char *id, uint32_t epoch,
             const char *result, uint64_t result_len,
             const struct job_stats *stats, store_done_fn done, void *user,
             struct error *err)
{
    MUST(strlen(result) < SHA256_HEX_SIZE);
    struct write *write = new_write(WRITE_FINISH, id, epoch, user, err);
    if (write == NULL)
        return false;
    write->done = done;
    memcpy(write->result, result, strlen(result) + 1);
    write->result_len = result_len;
    if (stats != NULL)
        write->stats = *stats;
    return push(store, write, err);
}

bool
store_fail(struct store *store, const char *id, uint32_t epoch,
           enum store_failure failure, enum error_code code, const char *text,
           store_done_fn done, void *user, struct error *err)
{
    struct write *write = new_write(WRITE_FAIL, id, epoch, user, err);
    if (write == NULL)
        return false;
    write->done = done;
    write->failure = failure;
    error_set(&write->cause, code, "%s", text != NULL ? text : "");
    return push(store, write, err);
}

static bool
push_named(struct store *store, enum write_kind kind, const char *id,
           store_done_fn done, void *user, struct error *err)
{
    struct write *write = new_write(kind, id, 0, user, err);
    if (write == NULL)
        return false;
    write->done = done;
    return push(store, write, err);
}

bool
store_cancel(struct store *store, const char *id, store_done_fn done,
             void *user, struct error *err)
{
    return push_named(store, WRITE_CANCEL, id, done, user, err);
}

bool
store_delete(struct store *store, const char *id, store_done_fn done,
             void *user, struct error *err)
{
    return push_named(store, WRITE_DELETE, id, done, user, err);
}

/* --- reads --- */

static struct rows *
begin_read(struct store *store)
{
    pthread_mutex_lock(&store->read_lock);
    return store->reader;
}

static void
end_read(struct store *store)
{
    pthread_mutex_unlock(&store->read_lock);
}

bool
store_get(struct store *store, const char *id, struct job *job,
          struct error *err)
{
    /* Board first, row second: see board.h. */
    struct board_entry entry;
    pthread_mutex_lock(&store->lock);
    bool noted = board_find(&store->board, id, &entry);
    pthread_mutex_unlock(&store->lock);

    struct row row;
    struct rows *rows = begin_read(store);
    bool ok = rows->ops->get(rows, id, &row, err);
    end_read(store);
    if (!ok)
        return false;
    if (noted)
        board_lay(&entry, &row.job);
    *job = row.job;
    return true;
}

bool
store_scene(struct store *store, const char *id, struct bytes *scene,
            struct error *err)
{
    struct rows *rows = begin_read(store);
    bool ok = rows->ops->scene(rows, id, scene, err);
    end_read(store);
    return ok;
}

bool
store_find(struct store *store, const char *render_key, const char *owner,
           struct job *job, struct error *err)
{
    struct row row;
    struct rows *rows = begin_read(store);
    bool ok = rows->ops->find(rows, render_key, owner, &row, err);
    end_read(store);
    if (ok)
        *job = row.job;
    return ok;
}

/* The whole board, for a list. `copy` is cleared by the caller. */
static bool
copy_board(struct store *store, struct board *copy, struct error *err)
{
    bool ok = true;
    pthread_mutex_lock(&store->lock);
    size_t count = store->board.count;
    if (count > 0) {
        copy->entries = malloc(count * sizeof *copy->entries);
        ok = copy->entries != NULL;
        if (ok) {
            memcpy(copy->entries, store->board.entries,
                   count * sizeof *copy->entries);
            copy->count = copy->capacity = count;
        }
    }
    pthread_mutex_unlock(&store->lock);
    return ok || error_set(err, ERROR_MEMORY, "no memory for a list of jobs");
}

int
store_list(struct store *store, const struct store_filter *filter,
           struct job *jobs, struct error *err)
{
    MUST(filter->limit >= 1 && filter->limit <= STORE_LIST_MAX);
    struct board board = {0};
    struct board_entry entry;
    if (!copy_board(store, &board, err))
        return -1;
    struct rows *rows = begin_read(store);
    int count = rows->ops->list(rows, filter, jobs, err);
    end_read(store);
    for (int i = 0; i < count; i++) {
        if (board_find(&board, jobs[i].id, &entry))
            board_lay(&entry, &jobs[i]);
    }
    board_clear(&board);
    return count;
}

bool
store_count(struct store *store, struct store_counts *counts, struct error *err)
{
    (void)err;
    pthread_mutex_lock(&store->lock);
    memcpy(counts->jobs, store->counts, sizeof counts->jobs);
    counts->pending_writes = store->pending;
    pthread_mutex_unlock(&store->lock);
    return true;
}

bool
store_position(struct store *store, const char *id, uint64_t *position,
               struct error *err)
{
    struct row row;
    struct rows *rows = begin_read(store);
    bool ok = rows->ops->get(rows, id, &row, err);
    if (ok && row.job.state != JOB_QUEUED)
        ok = error_set(err, ERROR_CONFLICT, "%s is %s, not queued", id,
                       job_state_name(row.job.state));
    ok = ok && rows->ops->position(rows, &row, position, err);
    end_read(store);
    return ok;
}

bool
store_blob_users(struct store *store, const char *sha256, uint64_t *users,
                 struct error *err)
{
    struct rows *rows = begin_read(store);
    bool ok = rows->ops->blob_users(rows, sha256, users, err);
    end_read(store);
    return ok;
}

const char *
store_describe(const struct store *store)
{
    return store->describe;
}
