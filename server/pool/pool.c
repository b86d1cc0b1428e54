#include "server/pool/pool.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <unistd.h>

#include "core/base/clock.h"
#include "core/base/log.h"
#include "core/base/must.h"
#include "server/pool/crew.h"
#include "server/pool/dispatch.h"
#include "server/worker/child.h"

enum {
    STALL_MS_DEFAULT = 60 * 1000,
    PAUSE_MIN_US = 100 * 1000, /* between a loss and the successor's start */
    PAUSE_MAX_US = 10 * 1000 * 1000,
    HEALTHY_US = 10 * 1000 * 1000, /* lived so long: the pauses start anew */
    READY_US = 30 * 1000 * 1000,   /* a worker that does not get ready */
    LOOK_US = 20 * 1000,        /* between two looks for jobs to be canceled */
    LEAVE_US = 5 * 1000 * 1000, /* drain: for results on their way to disk */
    MESSAGES_PER_TURN = 64, /* of one worker, so that none starves the rest */
    /* What a worker loads after READY: the image library and its data take 60
     * to 75 MiB (measured), the stacks of a big crew as much again. */
    LIBRARY_BYTES = 192 << 20,
    RECYCLE_ASKS = 1000,      /* a worker's whole life */
    RECYCLE_BYTES = 256 << 20 /* memory it kept after an ask */
};

/* One worker's place. It is down (pid 0, until start_us), getting ready, idle
 * (no task) or taken (a task: being leased, then rendered). */
struct slot {
    struct child child;
    struct task *task;
    unsigned number;      /* from 1, for the log */
    int64_t start_us;     /* down: when to start */
    int64_t ready_by_us;  /* starting: when it is given up */
    int64_t ready_us;     /* since when */
    int64_t pause_us;     /* before the next successor */
    uint64_t ready_bytes; /* resident when READY */
    unsigned asks;        /* answered by this process */
    uint64_t kicks;       /* those known when it last asked for a job ... */
    bool asked;           /* ... and got none */
};

struct forgotten {
    struct forgotten *next;
    char sha256[SHA256_HEX_SIZE];
};

struct pool {
    struct pool_options options;
    pthread_t thread;
    bool joined;
    int wake; /* eventfd */
    atomic_bool kicked;
    atomic_bool stopping;
    int64_t grace_us; /* set before `stopping` */

    /* Guards the mailbox (both lists) and `status`. */
    pthread_mutex_t lock;
    struct task *posted_first, **posted_last;
    struct forgotten *forgotten;
    struct pool_status status;
    bool closed; /* nobody reads the mailbox any more */

    /* The loop thread's own. */
    struct dispatch dispatch;
    struct slot *slots;
    struct pollfd *fds;
    uint64_t kicks; /* seen */
    uint64_t exits;
    bool look;         /* for jobs to be canceled */
    int64_t looked_us; /* last time */
    int64_t stop_us;   /* end of the grace time; 0: not stopping */
};

static void
wake(struct pool *pool)
{
    uint64_t one = 1;
    /* Fails only when the counter is full, and then the loop is awake. */
    ssize_t written = write(pool->wake, &one, sizeof one);
    (void)written;
}

/* --- workers --- */

/* Resident and data bytes of a process; zeros if it is gone. */
static void
memory_of(pid_t pid, uint64_t *resident, uint64_t *data)
{
    char path[48], text[160];
    unsigned long long pages[6] = {0};
    *resident = *data = 0;
    snprintf(path, sizeof path, "/proc/%d/statm", (int)pid);
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return;
    ssize_t len = read(fd, text, sizeof text - 1);
    close(fd);
    if (len <= 0)
        return;
    text[len] = '\0';
    /* size resident shared text lib data */
    char *at = text;
    for (int i = 0; i < 6; i++)
        pages[i] = strtoull(at, &at, 10);
    uint64_t page = (uint64_t)sysconf(_SC_PAGESIZE);
    *resident = pages[1] * page;
    *data = pages[5] * page;
}

/* Limit what the worker may map from now on. Not its address space: its
 * libraries map one or two GiB before the first byte of a scene, so a limit on
 * that would be either no limit or a guess. RLIMIT_DATA counts private writable
 * memory, and what is there at READY is measured. */
static void
limit_memory(struct pool *pool, struct slot *slot)
{
    uint64_t data;
    memory_of(slot->child.pid, &slot->ready_bytes, &data);
    if (pool->options.max_render_bytes == 0 || data == 0)
        return;
    uint64_t most = data + LIBRARY_BYTES + pool->options.max_render_bytes;
    struct rlimit limit = {most, most};
    if (prlimit(slot->child.pid, RLIMIT_DATA, &limit, NULL) != 0)
        log_write(LOG_WARN, "pool", "worker %u: cannot limit its memory: %s",
                  slot->number, strerror(errno));
}

/* The first successor comes at once, the next ones after a growing pause,
 * until one has proved healthy. A worker lost in the middle of a job was able to
 * start, and its job's attempts are counted: there the pause does not grow, or a
 * few poisonous jobs would keep everybody else waiting. */
static void
schedule_start(struct slot *slot, bool healthy, bool rendering, int64_t now_us)
{
    if (healthy)
        slot->pause_us = 0;
    if (rendering && slot->pause_us > PAUSE_MIN_US)
        slot->pause_us = PAUSE_MIN_US;
    slot->start_us = now_us + slot->pause_us;
    slot->pause_us = slot->pause_us == 0 ? PAUSE_MIN_US : 2 * slot->pause_us;
    if (slot->pause_us > PAUSE_MAX_US)
        slot->pause_us = PAUSE_MAX_US;
}

static void
slot_start(struct slot *slot, int64_t now_us)
{
    struct error err = {0};
    if (!child_start(&slot->child, 0, &err)) {
        schedule_start(slot, false, false, now_us);
        log_write(LOG_ERROR, "pool", "worker %u: %s; next try in %.1f s",
                  slot->number, err.text,
                  (double)(slot->start_us - now_us) / 1e6);
        return;
    }
    slot->ready_by_us = now_us + READY_US;
    slot->asks = 0;
    slot->asked = false;
}

/* End what is left of a worker and plan its successor. `failure` and `cause`
 * are for its job; without a cause, it is how the process ended. */
static void
slot_lose(struct pool *pool, struct slot *slot, enum store_failure failure,
          const struct error *cause, int64_t now_us)
{
    char how[64] = "";
    pid_t pid = slot->child.pid;
    bool healthy = slot->child.ready &&
                   (slot->asks > 0 || now_us - slot->ready_us >= HEALTHY_US);
    bool rendering = slot->task != NULL && slot->task->step == TASK_RENDER;
    child_stop(&slot->child, how);
    pool->exits++;

    struct error lost = {0};
    if (cause != NULL)
        lost = *cause;
    else
        error_set(&lost, ERROR_WORKER_CRASHED, "the worker was lost: %s", how);
    schedule_start(slot, healthy, rendering, now_us);
    /* While it is being leased, the job is the store's to write. */
    log_write(LOG_WARN, "pool",
              "worker %u (process %d) lost%s%s: %s; successor in %.1f s",
              slot->number, (int)pid, rendering ? " with " : "",
              rendering ? slot->task->lease->job.id : "", lost.text,
              (double)(slot->start_us - now_us) / 1e6);
    if (slot->task != NULL)
        dispatch_lost(&pool->dispatch, slot->task, failure, lost.code,
                      lost.text, now_us);
    slot->task = NULL;
}

/* A long life or a big scene may have left much memory behind: start afresh. */
static void
slot_recycle(struct slot *slot, int64_t now_us)
{
    uint64_t resident, data;
    memory_of(slot->child.pid, &resident, &data);
    if (slot->asks < RECYCLE_ASKS &&
        resident < slot->ready_bytes + RECYCLE_BYTES)
        return;
    log_write(LOG_INFO, "pool", "worker %u renewed after %u jobs, %llu MiB",
              slot->number, slot->asks, (unsigned long long)(resident >> 20));
    child_stop(&slot->child, NULL);
    slot->pause_us = 0;
    slot->start_us = now_us;
}

static void
slot_ready(struct pool *pool, struct slot *slot, int64_t now_us)
{
    slot->ready_us = now_us;
    limit_memory(pool, slot);
    log_write(LOG_INFO, "pool", "worker %u (process %d) ready", slot->number,
              (int)slot->child.pid);
}

/* --- turns of the loop --- */

static void
share_threads(struct pool *pool)
{
    unsigned running = 0, index = 0;
    for (unsigned i = 0; i < pool->options.workers; i++) {
        const struct task *task = pool->slots[i].task;
        running += task != NULL && task->step == TASK_RENDER;
    }
    for (unsigned i = 0; i < pool->options.workers; i++) {
        struct task *task = pool->slots[i].task;
        if (task != NULL && task->step == TASK_RENDER)
            dispatch_threads(
                task, crew_share(pool->options.threads, running, index++));
    }
}

/* A lease has come for this idle worker. It starts with what it will have
 * anyway; share_threads takes the same from the others. */
static void
slot_ask(struct pool *pool, struct slot *slot, int64_t now_us)
{
    unsigned running = 1, index = 0;
    for (unsigned i = 0; i < pool->options.workers; i++) {
        const struct slot *other = &pool->slots[i];
        if (other == slot || other->task == NULL ||
            other->task->step != TASK_RENDER)
            continue;
        running++;
        index += other < slot;
    }
    struct error err = {0};
    struct task *task = slot->task;
    if (dispatch_ask(&pool->dispatch, task,
                     crew_share(pool->options.threads, running, index), now_us,
                     &err)) {
        pool->look = true; /* a cancel may have come during the lease */
        return;
    }
    slot->task = NULL;
    slot_lose(pool, slot, FAILURE_RELEASE, &err, now_us);
}

static struct slot *
slot_of(struct pool *pool, const struct task *task)
{
    for (unsigned i = 0; i < pool->options.workers; i++) {
        if (pool->slots[i].task == task)
            return &pool->slots[i];
    }
    return NULL;
}

static void
take_posted(struct pool *pool, struct task *task, int64_t now_us)
{
    struct slot *slot = slot_of(pool, task);
    switch (dispatch_arrived(&pool->dispatch, task, now_us)) {
    case DISPATCH_NO_JOB:
        if (slot != NULL) {
            slot->task = NULL;
            slot->asked = true;
        }
        break;
    case DISPATCH_ASK:
        MUST(slot != NULL);
        slot_ask(pool, slot, now_us);
        break;
    case DISPATCH_GOES_ON:
    case DISPATCH_OVER:
        /* Only a lease that failed or went back had a slot. */
        if (slot != NULL)
            slot->task = NULL;
        break;
    }
}

static void
empty_mailbox(struct pool *pool, int64_t now_us)
{
    uint64_t count;
    ssize_t got = read(pool->wake, &count, sizeof count);
    (void)got; /* EAGAIN: nobody called */
    if (atomic_exchange(&pool->kicked, false)) {
        pool->kicks++;
        pool->look = true;
    }
    pthread_mutex_lock(&pool->lock);
    struct task *task = pool->posted_first;
    struct forgotten *forgotten = pool->forgotten;
    pool->posted_first = NULL;
    pool->posted_last = &pool->posted_first;
    pool->forgotten = NULL;
    pthread_mutex_unlock(&pool->lock);

    for (struct task *next; task != NULL; task = next) {
        next = task->post_next;
        take_posted(pool, task, now_us);
    }
    for (struct forgotten *next; forgotten != NULL; forgotten = next) {
        next = forgotten->next;
        dispatch_forget(&pool->dispatch, forgotten->sha256);
        free(forgotten);
    }
}

/* One message. False: the worker is out of step, or ill. */
static bool
take_message(struct pool *pool, struct slot *slot, struct message *message,
             int64_t now_us, struct error *err)
{
    if (message->kind == MESSAGE_READY) {
        slot_ready(pool, slot, now_us);
        return true;
    }
    if (slot->task == NULL || slot->task->step != TASK_RENDER)
        return error_set(err, ERROR_PROTOCOL, "the worker spoke unasked");
    enum dispatch_news news;
    if (!dispatch_message(&pool->dispatch, slot->task, message, now_us, &news,
                          err))
        return false;
    if (news == NEWS_NONE)
        return true;
    slot->task = NULL;
    slot->asked = false;
    if (news == NEWS_ILL)
        return error_set(err, ERROR_INTERNAL, "it failed by its own fault");
    slot->asks++;
    slot_recycle(slot, now_us);
    return true;
}

/* All that a worker has said, then whether it still lives. */
static void
listen_to(struct pool *pool, struct slot *slot, int64_t now_us)
{
    for (int i = 0; i < MESSAGES_PER_TURN && slot->child.pid != 0; i++) {
        struct message message = {0};
        struct error err = {0};
        enum wire_status status =
            child_receive(&slot->child, false, &message, &err);
        bool ok = status == WIRE_MESSAGE &&
                  take_message(pool, slot, &message, now_us, &err);
        message_clear(&message);
        if (status == WIRE_NOTHING)
            return;
        if (ok)
            continue;
        slot_lose(pool, slot, FAILURE_ATTEMPT,
                  status == WIRE_CLOSED ? NULL : &err, now_us);
    }
}

static void
listen_to_all(struct pool *pool, int64_t now_us)
{
    for (unsigned i = 0; i < pool->options.workers; i++) {
        struct slot *slot = &pool->slots[i];
        const struct pollfd *fds = &pool->fds[1 + 2 * i];
        if (slot->child.pid == 0 || (fds[0].revents | fds[1].revents) == 0)
            continue;
        listen_to(pool, slot, now_us);
        /* The process has ended, and there is nothing more to read. */
        if (slot->child.pid != 0 && fds[1].revents != 0 &&
            fds[1].fd == slot->child.pidfd && fds[0].revents == 0)
            slot_lose(pool, slot, FAILURE_ATTEMPT, NULL, now_us);
    }
}

/* Kill what takes too long, start what is due. */
static void
supervise(struct pool *pool, int64_t now_us)
{
    for (unsigned i = 0; i < pool->options.workers; i++) {
        struct slot *slot = &pool->slots[i];
        enum store_failure failure;
        struct error cause = {0};
        if (slot->child.pid == 0) {
            if (pool->stop_us == 0 && now_us >= slot->start_us)
                slot_start(slot, now_us);
        } else if (!slot->child.ready) {
            if (now_us < slot->ready_by_us)
                continue;
            error_set(&cause, ERROR_STALLED, "not ready within %d s",
                      READY_US / 1000000);
            slot_lose(pool, slot, FAILURE_RELEASE, &cause, now_us);
        } else if (slot->task != NULL &&
                   dispatch_overdue(&pool->dispatch, slot->task, now_us,
                                    &failure, &cause)) {
            slot_lose(pool, slot, failure, &cause, now_us);
        }
    }
}

/* Every idle worker asks the store, once per kick. */
static void
feed(struct pool *pool, int64_t now_us)
{
    for (unsigned i = 0; i < pool->options.workers; i++) {
        struct slot *slot = &pool->slots[i];
        if (slot->child.pid == 0 || !slot->child.ready || slot->task != NULL)
            continue;
        if (slot->asked && slot->kicks == pool->kicks)
            continue;
        slot->task = dispatch_next(&pool->dispatch, &slot->child, now_us);
        if (slot->task == NULL)
            return; /* the store or the blobs need a moment: none for anyone */
        slot->kicks = pool->kicks;
        slot->asked = false;
    }
}

static void
look_for_canceled(struct pool *pool, int64_t now_us)
{
    if (!pool->look || now_us < pool->looked_us + LOOK_US)
        return;
    pool->look = false;
    pool->looked_us = now_us;
    dispatch_look(&pool->dispatch, now_us);
}

/* Stopping: idle workers go at once, busy ones when the grace time is over. */
static void
wind_down(struct pool *pool, int64_t now_us)
{
    if (pool->stop_us == 0) {
        if (!atomic_load(&pool->stopping))
            return;
        pool->stop_us = now_us + pool->grace_us;
        pool->dispatch.stopping = true;
    }
    bool given_up = now_us >= pool->stop_us;
    for (unsigned i = 0; i < pool->options.workers; i++) {
        struct slot *slot = &pool->slots[i];
        if (slot->task != NULL && slot->task->step == TASK_RENDER) {
            if (!given_up)
                continue;
            dispatch_lost(&pool->dispatch, slot->task, FAILURE_RELEASE,
                          ERROR_DRAINING, "the service was stopped", now_us);
            slot->task = NULL;
        } else if (slot->task != NULL) {
            continue; /* a lease under way, given back when it comes */
        }
        child_stop(&slot->child, NULL);
    }
}

static bool
is_over(const struct pool *pool, int64_t now_us)
{
    if (pool->stop_us == 0)
        return false;
    if (pool->dispatch.tasks == NULL)
        return true;
    /* What the store still refuses stays leased there; its next opening voids
     * all leases, so nothing is lost. But never leave while a writer thread
     * may still touch a task. */
    if (now_us < pool->stop_us + LEAVE_US)
        return false;
    for (const struct task *t = pool->dispatch.tasks; t != NULL; t = t->next) {
        if (t->under_way)
            return false;
    }
    return true;
}

static int64_t
earlier(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

static int
poll_ms(const struct pool *pool, int64_t now_us)
{
    int64_t due = dispatch_due(&pool->dispatch, now_us);
    for (unsigned i = 0; i < pool->options.workers; i++) {
        const struct slot *slot = &pool->slots[i];
        if (slot->child.pid == 0 && pool->stop_us == 0)
            due = earlier(due, slot->start_us);
        else if (slot->child.pid != 0 && !slot->child.ready)
            due = earlier(due, slot->ready_by_us);
    }
    if (pool->look)
        due = earlier(due, pool->looked_us + LOOK_US);
    if (pool->stop_us > now_us)
        due = earlier(due, pool->stop_us);
    else if (pool->stop_us > 0 && pool->stop_us + LEAVE_US > now_us)
        due = earlier(due, pool->stop_us + LEAVE_US);
    if (due == INT64_MAX)
        return -1;
    if (due <= now_us)
        return 0;
    int64_t ms = (due - now_us + 999) / 1000;
    return ms < 60000 ? (int)ms : 60000;
}

static void
publish(struct pool *pool)
{
    struct pool_status status = {
        .workers = pool->options.workers,
        .exits = pool->exits,
        .rays_per_second = pool->dispatch.rays_per_second,
    };
    for (unsigned i = 0; i < pool->options.workers; i++) {
        const struct slot *slot = &pool->slots[i];
        status.ready += slot->child.pid != 0 && slot->child.ready;
        status.busy += slot->task != NULL && slot->task->step == TASK_RENDER;
    }
    pthread_mutex_lock(&pool->lock);
    pool->status = status;
    pthread_mutex_unlock(&pool->lock);
}

static void
wait_for_news(struct pool *pool, int64_t now_us)
{
    pool->fds[0] = (struct pollfd){.fd = pool->wake, .events = POLLIN};
    for (unsigned i = 0; i < pool->options.workers; i++) {
        const struct child *child = &pool->slots[i].child;
        bool up = child->pid != 0;
        /* poll skips negative descriptors. */
        pool->fds[1 + 2 * i] =
            (struct pollfd){.fd = up ? child->socket : -1, .events = POLLIN};
        pool->fds[2 + 2 * i] =
            (struct pollfd){.fd = up ? child->pidfd : -1, .events = POLLIN};
    }
    if (poll(pool->fds, 1 + 2 * (nfds_t)pool->options.workers,
             poll_ms(pool, now_us)) < 0) {
        MUST(errno == EINTR || errno == ENOMEM);
        memset(pool->fds, 0,
               (1 + 2 * (size_t)pool->options.workers) * sizeof *pool->fds);
    }
}

static void *
loop(void *user)
{
    struct pool *pool = user;
    for (;;) {
        int64_t now_us = clock_monotonic_us();
        wind_down(pool, now_us);
        if (is_over(pool, now_us))
            break;
        supervise(pool, now_us);
        dispatch_tick(&pool->dispatch, now_us);
        feed(pool, now_us);
        share_threads(pool);
        look_for_canceled(pool, now_us);
        publish(pool);
        wait_for_news(pool, now_us);
        now_us = clock_monotonic_us();
        listen_to_all(pool, now_us);
        empty_mailbox(pool, now_us);
    }
    for (unsigned i = 0; i < pool->options.workers; i++)
        child_stop(&pool->slots[i].child, NULL);
    publish(pool);
    return NULL;
}

/* --- from other threads --- */

static void
post(void *user, struct task *task)
{
    struct pool *pool = user;
    task->post_next = NULL;
    pthread_mutex_lock(&pool->lock);
    *pool->posted_last = task;
    pool->posted_last = &task->post_next;
    pthread_mutex_unlock(&pool->lock);
    wake(pool);
}

void
pool_kick(struct pool *pool)
{
    if (!atomic_exchange(&pool->kicked, true))
        wake(pool);
}

void
pool_forget_blob(struct pool *pool, const char *sha256)
{
    struct forgotten *one = calloc(1, sizeof *one);
    if (one == NULL)
        return; /* a blob too many is no harm */
    snprintf(one->sha256, sizeof one->sha256, "%s", sha256);
    pthread_mutex_lock(&pool->lock);
    bool closed = pool->closed;
    if (!closed) {
        one->next = pool->forgotten;
        pool->forgotten = one;
    }
    pthread_mutex_unlock(&pool->lock);
    if (closed)
        free(one);
    else
        wake(pool);
}

void
pool_status(struct pool *pool, struct pool_status *status)
{
    pthread_mutex_lock(&pool->lock);
    *status = pool->status;
    pthread_mutex_unlock(&pool->lock);
}

/* --- start and stop --- */

static void
pool_free(struct pool *pool)
{
    while (pool->forgotten != NULL) {
        struct forgotten *next = pool->forgotten->next;
        free(pool->forgotten);
        pool->forgotten = next;
    }
    if (pool->wake >= 0)
        close(pool->wake);
    pthread_mutex_destroy(&pool->lock);
    free(pool->slots);
    free(pool->fds);
    free(pool);
}

static void
set_up(struct pool *pool)
{
    const struct pool_options *o = &pool->options;
    int64_t stall_ms = o->stall_ms > 0 ? o->stall_ms : STALL_MS_DEFAULT;
    double seconds = o->max_render_seconds;
    pool->dispatch = (struct dispatch){
        .store = o->store,
        .blobs = o->blobs,
        .render_us = seconds > 0 ? (int64_t)(seconds * 1e6) : INT64_MAX / 4,
        .stall_us = stall_ms * 1000,
        .result_bytes =
            o->max_render_bytes > 0 ? o->max_render_bytes : (uint64_t)1 << 40,
        .post = post,
        .user = pool,
    };
    for (unsigned i = 0; i < o->workers; i++) {
        pool->slots[i].number = i + 1;
        pool->slots[i].child.pidfd = pool->slots[i].child.socket = -1;
    }
    pool->looked_us = INT64_MIN / 2;
    pool->status.workers = o->workers;
}

struct pool *
pool_start(const struct pool_options *options, struct error *err)
{
    MUST(options->workers > 0 && options->threads > 0);
    struct pool *pool = calloc(1, sizeof *pool);
    if (pool == NULL) {
        error_set(err, ERROR_MEMORY, "no memory for the pool");
        return NULL;
    }
    pool->options = *options;
    pool->posted_last = &pool->posted_first;
    pthread_mutex_init(&pool->lock, NULL);
    pool->slots = calloc(options->workers, sizeof *pool->slots);
    pool->fds = calloc(1 + 2 * (size_t)options->workers, sizeof *pool->fds);
    pool->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (pool->slots == NULL || pool->fds == NULL || pool->wake < 0) {
        error_set(err, ERROR_MEMORY, "no memory or descriptor for the pool");
        pool_free(pool);
        return NULL;
    }
    set_up(pool);
    /* Workers are started by the loop's thread: they die with it, not with
     * whichever thread called us. */
    int cause = pthread_create(&pool->thread, NULL, loop, pool);
    if (cause != 0) {
        error_errno(err, ERROR_IO, cause, "cannot start the pool's thread");
        pool_free(pool);
        return NULL;
    }
    return pool;
}

void
pool_drain(struct pool *pool, int64_t grace_ms)
{
    if (pool->joined)
        return;
    pool->grace_us = grace_ms * 1000;
    atomic_store(&pool->stopping, true);
    wake(pool);
    pthread_join(pool->thread, NULL);
    pool->joined = true;
    pthread_mutex_lock(&pool->lock);
    pool->closed = true;
    pthread_mutex_unlock(&pool->lock);
    dispatch_clear(&pool->dispatch);
}

void
pool_stop(struct pool *pool, int64_t grace_ms)
{
    if (pool == NULL)
        return;
    pool_drain(pool, grace_ms);
    pool_free(pool);
}
