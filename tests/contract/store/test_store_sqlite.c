/* What SQLite promises beyond the contract: durability. */
#include <errno.h>
#include <fcntl.h>
#include <setjmp.h>
#include <signal.h>
#include <sqlite3.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "tests/contract/store/harness.h"

static struct harness h;
static const char blob[] =
    "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";

static int
set_up(void **state)
{
    (void)state;
    harness_open(&h, BACKEND_SQLITE);
    return 0;
}

static int
tear_down(void **state)
{
    (void)state;
    harness_close(&h);
    return 0;
}

static struct job
submitted(const char *owner)
{
    struct job job = new_job(owner, PRIORITY_NORMAL, 1);
    assert_int_equal(do_submit(&h, &job, "{}", &job), ERROR_NONE);
    return job;
}

/* --- open --- */

static void
a_second_daemon_is_refused(void **state)
{
    (void)state;
    struct error err = {0};
    assert_null(store_open_sqlite(&h.options, &err));
    assert_int_equal(err.code, ERROR_IO);
    assert_non_null(strstr(err.text, "another glintd"));
    pid_t child = fork();
    if (child == 0)
        _exit(store_open_sqlite(&h.options, NULL) != NULL);
    int status;
    waitpid(child, &status, 0);
    assert_int_equal(status, 0);
    submitted("a"); /* the first is unharmed */
    harness_reopen(&h);
    assert_int_equal(counts(&h).jobs[JOB_QUEUED], 1);
}

static void
what_cannot_be_opened_says_why(void **state)
{
    (void)state;
    char path[PATH_MAX + 32];
    struct store_options options = {.path = path};
    struct error err = {0};
    snprintf(path, sizeof path, "%s/no/such/folder/db", h.folder);
    assert_null(store_open_sqlite(&options, &err));
    assert_int_equal(err.code, ERROR_IO);
    assert_non_null(strstr(err.text, path));

    err = (struct error){0};
    snprintf(path, sizeof path, "%s/garbage", h.folder);
    int fd = open(path, O_WRONLY | O_CREAT, 0600);
    for (int i = 0; i < 1000; i++)
        assert_int_equal(write(fd, "not a database ", 15), 15);
    close(fd);
    assert_null(store_open_sqlite(&options, &err));
    assert_int_equal(err.code, ERROR_IO);
}

static void
a_newer_schema_is_refused(void **state)
{
    (void)state;
    sqlite3 *db;
    store_close(h.store);
    assert_int_equal(sqlite3_open(h.path, &db), SQLITE_OK);
    assert_int_equal(
        sqlite3_exec(db, "PRAGMA user_version=99", NULL, NULL, NULL),
        SQLITE_OK);
    sqlite3_close(db);
    struct error err = {0};
    assert_null(store_open_sqlite(&h.options, &err));
    assert_non_null(strstr(err.text, "newer glintd"));
    sqlite3_open(h.path, &db);
    sqlite3_exec(db, "PRAGMA user_version=1", NULL, NULL, NULL);
    sqlite3_close(db);
    h.store = store_open_sqlite(&h.options, &err);
    assert_non_null(h.store);
}

static void
the_file_is_its_owners_only(void **state)
{
    (void)state;
    static const char *const ends[] = {"", "-wal", "-shm", ".lock"};
    for (int i = 0; i < 4; i++) {
        char path[PATH_MAX + 8];
        struct stat st;
        snprintf(path, sizeof path, "%s%s", h.path, ends[i]);
        assert_int_equal(stat(path, &st), 0);
        assert_int_equal(st.st_mode & 077, 0);
    }
}

/* --- recovery --- */

static void
jobs_survive_a_restart(void **state)
{
    (void)state;
    struct job queued = submitted("a");
    struct job running = submitted("b");
    lease_free(do_lease(&h, 0));
    struct lease *lease = do_lease(&h, 0);
    struct job wished = submitted("c");
    lease_free(do_lease(&h, 0));
    do_cancel(&h, wished.id, NULL);
    struct job done = submitted("d");
    lease_free(do_lease(&h, 0));
    do_finish(&h, done.id, 1, blob, &done);
    do_heartbeat(&h, running.id, 1, JOB_TRACING, 0.5, 5);
    running = get(&h, running.id);
    queued = get(&h, queued.id);
    assert_int_equal(running.state, JOB_RUNNING);
    lease_free(lease);

    harness_reopen(&h);
    struct job now = get(&h, done.id);
    assert_memory_equal(&now, &done, sizeof now);
    now = get(&h, running.id);
    assert_int_equal(now.state, JOB_QUEUED);
    assert_int_equal(now.attempt, 1);
    assert_int_equal(now.epoch, 1);
    assert_true(now.revision > running.revision);
    assert_true(now.progress == 0);
    now = get(&h, wished.id);
    assert_int_equal(now.state, JOB_CANCELED);
    assert_true(now.finished_ms > 0);
    assert_false(now.cancel_requested);
    struct store_counts c = counts(&h);
    assert_int_equal(c.jobs[JOB_QUEUED], 2);
    assert_int_equal(c.jobs[JOB_RUNNING], 0);

    /* A ghost of the earlier life. */
    assert_int_equal(do_finish(&h, running.id, 1, blob, NULL), ERROR_CONFLICT);
    lease = do_lease(&h, 0);
    assert_int_equal(lease->job.epoch, 2);
    assert_int_equal(lease->job.attempt, 1);
    assert_int_equal(do_finish(&h, lease->job.id, 1, blob, NULL),
                     ERROR_CONFLICT);
    assert_int_equal(do_finish(&h, lease->job.id, 2, blob, NULL), ERROR_NONE);
    lease_free(lease);
}

static void
the_fair_order_survives_a_restart(void **state)
{
    (void)state;
    for (int i = 0; i < 50; i++)
        submitted("greedy");
    for (int i = 0; i < 5; i++)
        lease_free(do_lease(&h, 0));
    harness_reopen(&h);
    submitted("modest");
    int before = 0;
    for (;; before++) {
        struct lease *lease = do_lease(&h, 0);
        bool modest = strcmp(lease->job.owner, "modest") == 0;
        lease_free(lease);
        if (modest)
            break;
    }
    assert_in_range(before, 0, 6); /* the five taken back, and one */
}

/* A heartbeat in 65 536 is written through, so that no restart can show a
 * revision that somebody has seen with other contents. */
static void
revisions_leap_above_all_that_was_seen(void **state)
{
    (void)state;
    struct job job = submitted("a");
    lease_free(do_lease(&h, 0));
    struct error err = {0};
    for (int i = 0; i < 70000; i++) {
        while (!store_heartbeat(h.store, job.id, 1, JOB_TRACING, i / 1e6,
                                (uint64_t)i, &err)) {
            assert_int_equal(err.code, ERROR_QUEUE_FULL);
            err = (struct error){0};
            do_settle(&h);
        }
    }
    do_settle(&h);
    uint32_t seen = get(&h, job.id).revision;
    assert_int_equal(seen, 70002);
    harness_reopen(&h);
    assert_true(get(&h, job.id).revision > seen);
}

/* --- kill -9 --- */

enum { KILL_ROUNDS = 20 };

static int acknowledgements; /* the child's end of the pipe */

static void
acknowledge(void *user, const struct job *job, const struct error *err)
{
    (void)user;
    if (err->code == ERROR_NONE &&
        write(acknowledgements, job->id, ID_SIZE) != ID_SIZE)
        _exit(1);
}

static void
child_lease(void *user, struct lease *lease, const struct error *err)
{
    (void)err;
    struct store *store = user;
    if (lease == NULL)
        return;
    /* Every other one is finished, the rest is found running. */
    if (lease->job.id[ID_SIZE - 3] % 2 == 0)
        store_finish(store, lease->job.id, lease->job.epoch, blob, 1, NULL,
                     NULL, NULL, NULL);
    lease_free(lease);
}

static _Noreturn void
submit_until_killed(void)
{
    struct store *store = store_open_sqlite(&h.options, NULL);
    if (store == NULL)
        _exit(2);
    for (;;) {
        struct job job = new_job("a", PRIORITY_NORMAL, 1);
        if (!store_submit(store, &job, job.id, strlen(job.id), acknowledge,
                          NULL, NULL))
            usleep(1000);
        store_lease(store, 0, child_lease, store, NULL);
    }
}

static void
no_acknowledged_job_is_lost_by_kill(void **state)
{
    (void)state;
    unsigned acknowledged = 0;
    char(*ids)[ID_SIZE] = calloc(200000, ID_SIZE);
    store_close(h.store);
    for (int round = 0; round < KILL_ROUNDS; round++) {
        int ends[2];
        assert_int_equal(pipe(ends), 0);
        pid_t child = fork();
        if (child == 0) {
            close(ends[0]);
            acknowledgements = ends[1];
            submit_until_killed();
        }
        close(ends[1]);
        unsigned before = acknowledged;
        while (acknowledged < before + 50 + 37 * (unsigned)round) {
            ssize_t n = read(ends[0], ids[acknowledged], ID_SIZE);
            assert_int_equal(n, ID_SIZE);
            acknowledged++;
        }
        kill(child, SIGKILL);
        while (read(ends[0], ids[acknowledged], ID_SIZE) == ID_SIZE)
            acknowledged++;
        close(ends[0]);
        int status;
        waitpid(child, &status, 0);
        assert_true(WIFSIGNALED(status));

        struct error err = {0};
        h.store = store_open_sqlite(&h.options, &err);
        assert_non_null(h.store);
        assert_int_equal(counts(&h).jobs[JOB_RUNNING], 0);
        for (unsigned i = before; i < acknowledged; i++) {
            struct bytes scene = {0};
            struct job job = get(&h, ids[i]);
            assert_true(job.state == JOB_QUEUED || job.state == JOB_SUCCEEDED);
            assert_true(store_scene(h.store, ids[i], &scene, NULL));
            assert_string_equal(scene.data, ids[i]);
            bytes_clear(&scene);
        }
        store_close(h.store);
    }
    struct error err = {0};
    h.store = store_open_sqlite(&h.options, &err);
    for (unsigned i = 0; i < acknowledged; i++)
        assert_true(exists(&h, ids[i]));
    print_message("%d kills, %u acknowledged, 0 lost\n", KILL_ROUNDS,
                  acknowledged);
    free(ids);
}

/* --- full disk, failing disk --- */

static void
a_full_disk_refuses_submissions_and_recovers(void **state)
{
    (void)state;
    struct rlimit before, tight;
    signal(SIGXFSZ, SIG_IGN);
    struct job running = submitted("a");
    lease_free(do_lease(&h, 0));
    struct job over = submitted("a");
    do_cancel(&h, over.id, NULL);
    getrlimit(RLIMIT_FSIZE, &before);
    tight = before;
    tight.rlim_cur = 256 * 1024;
    setrlimit(RLIMIT_FSIZE, &tight);
    char *scene = calloc(1, 100 * 1024 + 1);
    memset(scene, ' ', 100 * 1024);
    unsigned accepted = 0, refused = 0;
    char kept[64][ID_SIZE];
    for (int i = 0; i < 40; i++) {
        struct job job = new_job("a", PRIORITY_NORMAL, 1);
        enum error_code code = do_submit(&h, &job, scene, NULL);
        if (code == ERROR_NONE)
            memcpy(kept[accepted++], job.id, ID_SIZE);
        else
            assert_int_equal(code, ERROR_STORAGE_FULL);
        refused += code != ERROR_NONE;
        assert_int_equal(exists(&h, job.id), code == ERROR_NONE);
    }
    assert_true(refused > 0);
    assert_int_equal(counts(&h).jobs[JOB_QUEUED], accepted);
    assert_int_equal(get(&h, running.id).state, JOB_RUNNING);

    setrlimit(RLIMIT_FSIZE, &before);
    struct job job = new_job("a", PRIORITY_NORMAL, 1);
    assert_int_equal(do_submit(&h, &job, scene, NULL), ERROR_NONE);
    assert_int_equal(do_finish(&h, running.id, 1, blob, NULL), ERROR_NONE);
    assert_int_equal(do_delete(&h, over.id, NULL), ERROR_NONE);
    harness_reopen(&h);
    assert_int_equal(counts(&h).jobs[JOB_QUEUED], accepted + 1);
    for (unsigned i = 0; i < accepted; i++)
        assert_true(exists(&h, kept[i]));
    free(scene);
}

static const struct CMUnitTest tests[] = {
#define T(f) cmocka_unit_test_setup_teardown(f, set_up, tear_down)
    T(a_second_daemon_is_refused),
    T(what_cannot_be_opened_says_why),
    T(a_newer_schema_is_refused),
    T(the_file_is_its_owners_only),
    T(jobs_survive_a_restart),
    T(the_fair_order_survives_a_restart),
    T(revisions_leap_above_all_that_was_seen),
    T(no_acknowledged_job_is_lost_by_kill),
    T(a_full_disk_refuses_submissions_and_recovers),
};

int
main(void)
{
    return cmocka_run_group_tests_name("sqlite only", tests, NULL, NULL);
}
