#include "server/api/events.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/ulid.h"

enum { BUCKETS = 1024 };

struct watcher {
    struct watcher *next;
    uint64_t ticket;
    char job[ID_SIZE];
};

/* The lock guards everything below it. While it is held, http_wake, pool_kick
 * and pool_status are called; none of them calls back. */
struct events {
    pthread_mutex_t lock;
    struct http *http;
    struct pool *pool;
    struct watcher *buckets[BUCKETS];
};

struct events *
events_new(struct error *err)
{
    struct events *events = calloc(1, sizeof *events);

    if (!events || pthread_mutex_init(&events->lock, NULL) != 0) {
        free(events);
        error_set(err, ERROR_MEMORY, "no memory for the table of watchers");
        return NULL;
    }
    return events;
}

void
events_free(struct events *events)
{
    size_t i;

    if (!events)
        return;
    for (i = 0; i < BUCKETS; i++) {
        while (events->buckets[i]) {
            struct watcher *watcher = events->buckets[i];

            events->buckets[i] = watcher->next;
            free(watcher);
        }
    }
    pthread_mutex_destroy(&events->lock);
    free(events);
}

void
events_connect_http(struct events *events, struct http *http)
{
    struct watcher *watcher;
    size_t i;

    pthread_mutex_lock(&events->lock);
    events->http = http;
    for (i = 0; http && i < BUCKETS; i++)
        for (watcher = events->buckets[i]; watcher; watcher = watcher->next)
            http_wake(http, watcher->ticket);
    pthread_mutex_unlock(&events->lock);
}

void
events_connect_pool(struct events *events, struct pool *pool)
{
    pthread_mutex_lock(&events->lock);
    events->pool = pool;
    pthread_mutex_unlock(&events->lock);
}

/* FNV-1a: ids differ in their last characters. */
static struct watcher **
bucket_of(struct events *events, const char *job)
{
    uint32_t hash = 2166136261u;

    for (; *job; job++)
        hash = (hash ^ (unsigned char)*job) * 16777619u;
    return &events->buckets[hash % BUCKETS];
}

bool
events_watch(struct events *events, const char *job, uint64_t ticket)
{
    struct watcher *watcher = calloc(1, sizeof *watcher);
    struct watcher **bucket;

    if (!watcher)
        return false;
    watcher->ticket = ticket;
    strncpy(watcher->job, job, sizeof watcher->job - 1);
    bucket = bucket_of(events, watcher->job);
    pthread_mutex_lock(&events->lock);
    watcher->next = *bucket;
    *bucket = watcher;
    pthread_mutex_unlock(&events->lock);
    return true;
}

void
events_unwatch(struct events *events, const char *job, uint64_t ticket)
{
    struct watcher **link, *found = NULL;

    pthread_mutex_lock(&events->lock);
    for (link = bucket_of(events, job); *link; link = &(*link)->next) {
        if ((*link)->ticket == ticket && strcmp((*link)->job, job) == 0) {
            found = *link;
            *link = found->next;
            break;
        }
    }
    pthread_mutex_unlock(&events->lock);
    free(found);
}

unsigned
events_watchers(struct events *events, const char *job)
{
    struct watcher *watcher;
    unsigned count = 0;

    pthread_mutex_lock(&events->lock);
    for (watcher = *bucket_of(events, job); watcher; watcher = watcher->next)
        count += strcmp(watcher->job, job) == 0;
    pthread_mutex_unlock(&events->lock);
    return count;
}

void
events_changed(struct events *events, const char *job)
{
    struct watcher *watcher;

    pthread_mutex_lock(&events->lock);
    for (watcher = *bucket_of(events, job); watcher && events->http;
         watcher = watcher->next)
        if (strcmp(watcher->job, job) == 0)
            http_wake(events->http, watcher->ticket);
    pthread_mutex_unlock(&events->lock);
}

void
events_kick_pool(struct events *events)
{
    pthread_mutex_lock(&events->lock);
    if (events->pool)
        pool_kick(events->pool);
    pthread_mutex_unlock(&events->lock);
}

bool
events_pool_status(struct events *events, struct pool_status *status)
{
    bool connected;

    memset(status, 0, sizeof *status);
    pthread_mutex_lock(&events->lock);
    connected = events->pool != NULL;
    if (connected)
        pool_status(events->pool, status);
    pthread_mutex_unlock(&events->lock);
    return connected;
}
