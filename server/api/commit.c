#include "server/api/commit.h"

#include <stdlib.h>
#include <string.h>

struct commit *
commit_new(struct events *events, const char *id)
{
    struct commit *commit = calloc(1, sizeof *commit);

    if (!commit)
        return NULL;
    atomic_init(&commit->references, 2);
    atomic_init(&commit->done, false);
    commit->events = events;
    strncpy(commit->id, id, sizeof commit->id - 1);
    return commit;
}

void
commit_drop(struct commit *commit)
{
    if (commit && atomic_fetch_sub(&commit->references, 1) == 1)
        free(commit);
}

void
commit_done(void *user, const struct job *job, const struct error *err)
{
    struct commit *commit = user;

    if (err)
        commit->err = *err;
    if (job) {
        commit->job = *job;
        commit->has_job = true;
    }
    atomic_store(&commit->done, true);
    events_changed(commit->events, commit->id);
    commit_drop(commit);
}
