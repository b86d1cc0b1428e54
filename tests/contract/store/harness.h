/* harness.h - a store under test, and its writes as plain calls that wait.
 *
 * Every wait has a deadline of 30 s, so a lost answer is a failed test and not
 * a hang. Any thread may use one harness. */
#ifndef TESTS_CONTRACT_STORE_HARNESS_H
#define TESTS_CONTRACT_STORE_HARNESS_H

#include <limits.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>

#include "server/store/store.h"

enum backend { BACKEND_MEMORY, BACKEND_SQLITE, BACKEND_COUNT };
extern const char *const backend_names[BACKEND_COUNT];

struct harness {
    enum backend backend;
    struct store *store;
    char folder[PATH_MAX - 64];
    char path[PATH_MAX];
    struct store_options options;
};

/* A new folder below $GLINT_BUILD (or /tmp) and an open store in it. */
void
harness_open(struct harness *h, enum backend backend);
void
harness_open_with(struct harness *h, enum backend backend,
                  store_change_fn on_change, void *user);
/* Close and open again; memory: nothing. */
void
harness_reopen(struct harness *h);
void
harness_close(struct harness *h); /* and remove the folder */

void
make_folder(char *path, size_t size);
void
remove_folder(const char *path);

/* A job ready to be submitted: owner, priority, estimate; a new id. */
struct job
new_job(const char *owner, enum job_priority priority, double seconds);

/* The answer's code; *out (may be NULL) is the job it came with. */
enum error_code
do_submit(struct harness *h, const struct job *job, const char *scene,
          struct job *out);
/* NULL: no job fits. lease_free it. */
struct lease *
do_lease(struct harness *h, double max_seconds);
enum error_code
do_finish(struct harness *h, const char *id, uint32_t epoch, const char *result,
          struct job *out);
enum error_code
do_fail(struct harness *h, const char *id, uint32_t epoch,
        enum store_failure failure, struct job *out);
enum error_code
do_cancel(struct harness *h, const char *id, struct job *out);
enum error_code
do_delete(struct harness *h, const char *id, struct job *out);
/* Returns when the writer has passed it. */
void
do_heartbeat(struct harness *h, const char *id, uint32_t epoch,
             enum job_phase phase, double progress, uint64_t rays);
/* Returns when the writer has answered everything queued before. */
void
do_settle(struct harness *h);

struct job
get(struct harness *h, const char *id); /* it must be there */
bool
exists(struct harness *h, const char *id);
struct store_counts
counts(struct harness *h);

/* One answer, waited for. */
struct waiter {
    pthread_mutex_t lock;
    pthread_cond_t wake;
    bool done;
    struct error err;
    struct job job;
    struct lease *lease;
};
void
waiter_init(struct waiter *w);
void
waiter_wait(struct waiter *w);
void
waiter_clear(struct waiter *w);
void
waiter_done(void *user, const struct job *job, const struct error *err);
void
waiter_lease(void *user, struct lease *lease, const struct error *err);

/* A lock that a writer thread can be held at. */
struct gate {
    pthread_mutex_t lock;
    pthread_cond_t wake;
    bool reached, open;
};
void
gate_init(struct gate *g);
void
gate_hold(void *user, const struct job *job, const struct error *err);
void
gate_wait_reached(struct gate *g);
void
gate_open(struct gate *g);

#endif
