#include "server/blobs/blobs.h"

#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "server/blobs/blobs_dir.h"

/* One put or delete on its way. */
struct errand {
    struct errand *next;
    int fd; /* -1: delete */
    uint64_t len;
    char sha256[SHA256_HEX_SIZE]; /* delete */
    blobs_done_fn done;
    void *user;
};

enum { CHECKED_MAX = 4096 };

/* A blob whose bytes were seen to match its name. */
struct checked {
    char sha256[SHA256_HEX_SIZE];
    struct blob_stamp stamp;
};

struct blobs {
    struct blobs_dir dir;
    pthread_t thread;

    /* Guards the rest. */
    pthread_mutex_t lock;
    pthread_cond_t wake;
    struct errand *first, **last;
    size_t pending;
    bool closing;
    struct checked *checked; /* [CHECKED_MAX], by the name's first digits */
};

/* --- what was checked --- */

static struct checked *
checked_of(struct blobs *blobs, const char *sha256)
{
    unsigned slot = 0;
    for (int i = 0; i < 3; i++) /* 12 bits */
        slot =
            slot << 4 | (sha256[i] <= '9' ? (unsigned)(sha256[i] - '0')
                                          : (unsigned)(sha256[i] - 'a' + 10));
    return &blobs->checked[slot % CHECKED_MAX];
}

static bool
was_checked(struct blobs *blobs, const char *sha256,
            const struct blob_stamp *stamp)
{
    pthread_mutex_lock(&blobs->lock);
    const struct checked *c = checked_of(blobs, sha256);
    bool was = strcmp(c->sha256, sha256) == 0 &&
               c->stamp.inode == stamp->inode && c->stamp.len == stamp->len &&
               c->stamp.mtime_ns == stamp->mtime_ns;
    pthread_mutex_unlock(&blobs->lock);
    return was;
}

static void
note_checked(struct blobs *blobs, const char *sha256,
             const struct blob_stamp *stamp)
{
    pthread_mutex_lock(&blobs->lock);
    struct checked *c = checked_of(blobs, sha256);
    memcpy(c->sha256, sha256, SHA256_HEX_SIZE);
    c->stamp = *stamp;
    pthread_mutex_unlock(&blobs->lock);
}

/* --- the writer thread --- */

static void
run_put(struct blobs *blobs, struct errand *errand)
{
    char sha256[SHA256_HEX_SIZE] = "";
    struct blob_stamp stamp;
    struct error err = {0};
    if (dir_put(&blobs->dir, errand->fd, errand->len, sha256, &err)) {
        /* It was hashed on its way; the next get need not do it again. */
        int fd = dir_get(&blobs->dir, sha256, &stamp, NULL);
        if (fd >= 0) {
            note_checked(blobs, sha256, &stamp);
            close(fd);
        }
    } else {
        sha256[0] = '\0';
    }
    close(errand->fd);
    if (errand->done != NULL)
        errand->done(errand->user, sha256, errand->len, &err);
}

static struct errand *
take(struct blobs *blobs)
{
    pthread_mutex_lock(&blobs->lock);
    while (blobs->first == NULL && !blobs->closing)
        pthread_cond_wait(&blobs->wake, &blobs->lock);
    struct errand *errand = blobs->first;
    if (errand != NULL) {
        blobs->first = errand->next;
        if (blobs->first == NULL)
            blobs->last = &blobs->first;
        blobs->pending--;
    }
    pthread_mutex_unlock(&blobs->lock);
    return errand;
}

static void *
run_errands(void *arg)
{
    struct blobs *blobs = arg;
    struct errand *errand;
    while ((errand = take(blobs)) != NULL) {
        if (errand->fd >= 0)
            run_put(blobs, errand);
        else
            dir_delete(&blobs->dir, errand->sha256);
        free(errand);
    }
    return NULL;
}

/* --- open, close --- */

static int
start_thread(struct blobs *blobs)
{
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    int rc = pthread_create(&blobs->thread, NULL, run_errands, blobs);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return rc;
}

static void
free_blobs(struct blobs *blobs)
{
    dir_close(&blobs->dir);
    pthread_mutex_destroy(&blobs->lock);
    pthread_cond_destroy(&blobs->wake);
    free(blobs->checked);
    free(blobs);
}

struct blobs *
blobs_open_dir(const char *path, struct error *err)
{
    struct blobs *blobs = calloc(1, sizeof *blobs);
    struct checked *checked = calloc(CHECKED_MAX, sizeof *checked);
    if (blobs == NULL || checked == NULL) {
        free(blobs);
        free(checked);
        error_set(err, ERROR_MEMORY, "no memory for the blobs");
        return NULL;
    }
    blobs->checked = checked;
    blobs->last = &blobs->first;
    pthread_mutex_init(&blobs->lock, NULL);
    pthread_cond_init(&blobs->wake, NULL);
    int rc = 0;
    if (!dir_open(&blobs->dir, path, err) || (rc = start_thread(blobs)) != 0) {
        if (rc != 0)
            error_errno(err, ERROR_MEMORY, rc,
                        "cannot start the blob writer thread");
        free_blobs(blobs);
        return NULL;
    }
    return blobs;
}

void
blobs_close(struct blobs *blobs)
{
    if (blobs == NULL)
        return;
    pthread_mutex_lock(&blobs->lock);
    blobs->closing = true;
    pthread_cond_signal(&blobs->wake);
    pthread_mutex_unlock(&blobs->lock);
    pthread_join(blobs->thread, NULL);
    free_blobs(blobs);
}

/* --- the calls --- */

/* Takes `errand` over if true. */
static bool
push(struct blobs *blobs, struct errand *errand, struct error *err)
{
    pthread_mutex_lock(&blobs->lock);
    bool ok = !blobs->closing && blobs->pending < BLOBS_PENDING_MAX;
    if (blobs->closing)
        error_set(err, ERROR_DRAINING, "the blobs are being closed");
    else if (!ok)
        error_set(err, ERROR_QUEUE_FULL,
                  "%zu blobs are waiting to be written, the limit is %d",
                  blobs->pending, BLOBS_PENDING_MAX);
    if (ok) {
        *blobs->last = errand;
        blobs->last = &errand->next;
        if (blobs->pending++ == 0)
            pthread_cond_signal(&blobs->wake);
    }
    pthread_mutex_unlock(&blobs->lock);
    return ok;
}

bool
blobs_put(struct blobs *blobs, int fd, uint64_t len, blobs_done_fn done,
          void *user, struct error *err)
{
    struct errand *errand = calloc(1, sizeof *errand);
    bool ok = errand != NULL;
    if (!ok)
        error_set(err, ERROR_MEMORY, "no memory for a blob");
    if (ok) {
        errand->fd = fd;
        errand->len = len;
        errand->done = done;
        errand->user = user;
        ok = push(blobs, errand, err);
    }
    if (!ok) {
        free(errand);
        close(fd);
    }
    return ok;
}

int
blobs_get(struct blobs *blobs, const char *sha256, uint64_t *len,
          struct error *err)
{
    struct blob_stamp stamp;
    int fd = dir_get(&blobs->dir, sha256, &stamp, err);
    if (fd < 0)
        return -1;
    if (!was_checked(blobs, sha256, &stamp)) {
        if (!dir_verify(fd, sha256, err)) {
            close(fd);
            return -1;
        }
        note_checked(blobs, sha256, &stamp);
    }
    *len = stamp.len;
    return fd;
}

void
blobs_delete(struct blobs *blobs, const char *sha256)
{
    if (!dir_is_name(sha256))
        return;
    struct errand *errand = calloc(1, sizeof *errand);
    if (errand == NULL)
        return; /* a blob without users is only a waste of room */
    errand->fd = -1;
    memcpy(errand->sha256, sha256, SHA256_HEX_SIZE);
    if (!push(blobs, errand, NULL))
        free(errand);
}

bool
blobs_space(struct blobs *blobs, uint64_t *free_bytes, uint64_t *total_bytes,
            struct error *err)
{
    return dir_space(&blobs->dir, free_bytes, total_bytes, err);
}
