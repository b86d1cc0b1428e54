/* commit.h - one write on its way through the store, and the request that waits
 * for it.
 *
 * The request's turn (HTTP loop) and the store's writer thread hold one
 * reference each, so either may be over first. The writer touches nothing of
 * the request: it leaves the outcome here and has the watchers of the job
 * woken. */
#ifndef SERVER_API_COMMIT_H
#define SERVER_API_COMMIT_H

#include <stdatomic.h>
#include <stdbool.h>

#include "server/api/events.h"
#include "server/store/store.h"

struct commit {
    atomic_int references;
    atomic_bool done; /* set last; then job and err stay as they are */
    struct events *events;
    char id[ID_SIZE]; /* of the job concerned */
    bool has_job;
    struct job job;
    struct error err;
};

/* With two references, one for store's `done`. NULL: out of memory. */
struct commit *
commit_new(struct events *events, const char *id);

/* A store_done_fn; `user` is the commit. Gives its reference up. */
void
commit_done(void *user, const struct job *job, const struct error *err);

/* One reference less. */
void
commit_drop(struct commit *commit);

#endif
