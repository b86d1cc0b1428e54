/* The disk fails at any call, or the power at any moment: no acknowledged
 * change is lost, and nothing is half there. Every seventh call is tried, fewer
 * under a sanitizer, every one with GLINT_THOROUGH set. */
#include <fcntl.h>
#include <setjmp.h>
#include <sqlite3.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "core/base/log.h"
#include "tests/contract/store/faulty_vfs.h"
#include "tests/contract/store/harness.h"

static const char blob[] =
    "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";

/* What was acknowledged, and after which recorded call. */
struct mark {
    char id[ID_SIZE];
    enum job_state state;
    bool gone;
    uint32_t epoch, revision;
    size_t entry;
};

static int marks_to = -1; /* a pipe, or */
static struct mark *marks;
static size_t mark_count;

static void
mark(const struct job *job, bool gone)
{
    struct mark m = {.state = job->state,
                     .gone = gone,
                     .epoch = job->epoch,
                     .revision = job->revision,
                     .entry = faulty_recorded()};
    memcpy(m.id, job->id, sizeof m.id);
    if (marks_to >= 0) {
        if (write(marks_to, &m, sizeof m) != sizeof m)
            _exit(9);
    } else {
        marks[mark_count++] = m;
    }
}

/* A little of everything. Any answer is good, but what is acknowledged is
 * marked. */
static void
play(struct harness *h, int jobs, size_t scene_len)
{
    char *scene = malloc(scene_len + 1);
    memset(scene, 's', scene_len);
    scene[scene_len] = '\0';
    for (int i = 0; i < jobs; i++) {
        struct job job = new_job("a", PRIORITY_NORMAL, 1), out;
        if (do_submit(h, &job, scene, &out) != ERROR_NONE)
            continue;
        mark(&out, false);
        struct waiter w;
        waiter_init(&w);
        store_lease(h->store, 0, waiter_lease, &w, NULL);
        waiter_wait(&w);
        if (w.lease != NULL) {
            struct job leased = w.lease->job;
            mark(&leased, false);
            if (i % 3 != 2 &&
                do_finish(h, leased.id, leased.epoch, blob, &out) == ERROR_NONE)
                mark(&out, false);
            if (i % 3 == 0 && do_delete(h, leased.id, &out) == ERROR_NONE)
                mark(&out, true);
        }
        waiter_clear(&w);
    }
    free(scene);
}

/* Does the store hold what was acknowledged? `count` marks, in order; later
 * changes that were not acknowledged may be there or not. */
static void
check(struct harness *h, const struct mark *list, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        const struct mark *m = &list[i];
        bool latest = true, deleted_later = false;
        for (size_t k = i + 1; k < mark_count; k++) {
            bool same = strcmp(list[k].id, m->id) == 0;
            latest &= !(same && k < count);
            deleted_later |= same && list[k].gone;
        }
        if (!latest)
            continue;
        if (m->gone) {
            assert_false(exists(h, m->id));
            continue;
        }
        if (!exists(h, m->id)) {
            /* Only a deletion that was under way can have removed it. */
            assert_true(deleted_later || m->state == JOB_SUCCEEDED);
            continue;
        }
        struct job job = get(h, m->id);
        assert_true(job.revision >= m->revision);
        assert_true(job.epoch >= m->epoch);
        if (job_is_over(m->state))
            assert_int_equal(job.state, m->state);
        struct bytes scene = {0};
        assert_true(store_scene(h->store, m->id, &scene, NULL));
        assert_true(scene.len > 0);
        bytes_clear(&scene);
    }
}

static void
check_integrity(const char *path)
{
    sqlite3 *db;
    sqlite3_stmt *stmt;
    assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
    assert_int_equal(
        sqlite3_prepare_v2(db, "PRAGMA integrity_check", -1, &stmt, NULL),
        SQLITE_OK);
    assert_int_equal(sqlite3_step(stmt), SQLITE_ROW);
    assert_string_equal((const char *)sqlite3_column_text(stmt, 0), "ok");
    sqlite3_finalize(stmt);
    assert_int_equal(
        sqlite3_prepare_v2(db,
                           "SELECT count(*) FROM counts WHERE jobs <> (SELECT "
                           "count(*) FROM jobs WHERE state = counts.state)",
                           -1, &stmt, NULL),
        SQLITE_OK);
    assert_int_equal(sqlite3_step(stmt), SQLITE_ROW);
    assert_int_equal(sqlite3_column_int(stmt, 0), 0);
    sqlite3_finalize(stmt);
    sqlite3_close(db);
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
enum { SLOWER = 4 };
#else
enum { SLOWER = 1 };
#endif

static unsigned
stride(unsigned quick)
{
    return getenv("GLINT_THOROUGH") != NULL ? 1 : quick * SLOWER;
}

/* --- the n-th call fails --- */

enum { SWEEP_JOBS = 4, SWEEP_MARKS = 64 };

static _Noreturn void
play_with_fault(struct harness *h, enum fault fault, unsigned n)
{
    log_setup((enum log_level)(LOG_ERROR + 1), LOG_AUTO);
    faulty_install();
    faulty_arm(fault, n);
    h->store = store_open_sqlite(&h->options, NULL);
    if (h->store == NULL)
        _exit(faulty_reached() ? 3 : 4);
    play(h, SWEEP_JOBS, 3000);
    bool was = faulty_reached();
    store_close(h->store);
    _exit(was || faulty_reached() ? 0 : 1);
}

/* Runs the play in a child; false: the fault lay beyond its end. */
static bool
one_fault(enum fault fault, unsigned n, unsigned *stopped)
{
    struct harness h;
    struct mark list[SWEEP_MARKS];
    int ends[2], status;
    harness_open(&h, BACKEND_SQLITE);
    store_close(h.store);
    assert_int_equal(pipe(ends), 0);
    pid_t child = fork();
    if (child == 0) {
        marks_to = ends[1];
        play_with_fault(&h, fault, n);
    }
    close(ends[1]);
    waitpid(child, &status, 0);
    mark_count = 0;
    while (read(ends[0], &list[mark_count], sizeof *list) == sizeof *list)
        mark_count++;
    close(ends[0]);
    assert_true(WIFEXITED(status));
    int code = WEXITSTATUS(status);
    if (code != 0 && code != 1 && code != 3 && code != STORE_EXIT_STATUS)
        fail_msg("fault %d at call %u: status %d", fault, n, code);
    /* A full disk is no reason to stop. */
    if (fault == FAULT_FULL_ONCE || fault == FAULT_FULL_FROM)
        assert_int_not_equal(code, STORE_EXIT_STATUS);
    *stopped += code == STORE_EXIT_STATUS;

    struct error err = {0};
    h.store = store_open_sqlite(&h.options, &err);
    assert_non_null(h.store);
    check(&h, list, mark_count);
    struct job job = new_job("b", PRIORITY_NORMAL, 1);
    assert_int_equal(do_submit(&h, &job, "{}", NULL), ERROR_NONE);
    store_close(h.store);
    check_integrity(h.path);
    remove_folder(h.folder);
    return code != 1;
}

static void
any_call_may_fail(void **state)
{
    (void)state;
    static const char *const names[FAULT_COUNT] = {
        "", "i/o error", "short write", "full once", "full from then on"};
    for (int fault = FAULT_EIO; fault < FAULT_COUNT; fault++) {
        unsigned n = 1 + (unsigned)fault % stride(7), tried = 0, stopped = 0;
        for (; one_fault((enum fault)fault, n, &stopped); n += stride(7))
            tried++;
        print_message("%s: %u calls tried, %u of them stop it\n", names[fault],
                      tried, stopped);
        assert_true(tried > 5);
        if (fault == FAULT_EIO || fault == FAULT_SHORT)
            assert_true(stopped > 5);
    }
}

/* --- power loss --- */

static void *
read_whole(const char *path, size_t *len)
{
    struct bytes bytes = {0};
    assert_true(bytes_read_file(&bytes, path, 64 << 20, NULL));
    *len = bytes.len;
    return bytes.data;
}

/* Replay every `step`-th prefix: nothing unsynced, everything, random parts. */
static void
power_loss(int jobs, size_t scene_len, size_t step, uint64_t ways)
{
    struct harness h, after;
    size_t base_len;
    faulty_install();
    harness_open(&h, BACKEND_SQLITE);
    store_close(h.store);
    void *base = read_whole(h.path, &base_len);
    marks = calloc((size_t)jobs * 4 + 1, sizeof *marks);
    mark_count = 0;
    marks_to = -1;
    faulty_record();
    h.store = store_open_sqlite(&h.options, NULL);
    assert_non_null(h.store);
    play(&h, jobs, scene_len);
    size_t entries = faulty_recorded();
    unsigned replays = 0;

    memset(&after, 0, sizeof after);
    make_folder(after.folder, sizeof after.folder);
    snprintf(after.path, sizeof after.path, "%s/glint.db", after.folder);
    after.backend = BACKEND_SQLITE;
    after.options.path = after.path;
    faulty_uninstall(); /* open files keep their methods */
    for (size_t n = 0; n <= entries; n += step) {
        size_t known = 0;
        while (known < mark_count && marks[known].entry <= n)
            known++;
        for (uint64_t way = 0; way < ways; way++) {
            struct error err = {0};
            assert_true(faulty_replay(after.path, base, base_len, n,
                                      way < 2 ? way : n * 31 + way));
            after.store = store_open_sqlite(&after.options, &err);
            if (after.store == NULL)
                fail_msg("power loss after call %zu, way %u: %s", n,
                         (unsigned)way, err.text);
            check(&after, marks, known);
            store_close(after.store);
            check_integrity(after.path);
            replays++;
        }
    }
    print_message("%zu calls, %zu acknowledgements, %u power losses\n", entries,
                  mark_count, replays);
    assert_true(mark_count >= (size_t)jobs);
    store_close(h.store);
    faulty_stop_record();
    remove_folder(h.folder);
    remove_folder(after.folder);
    free(marks);
    free(base);
}

static void
power_may_fail_at_any_call(void **state)
{
    (void)state;
    power_loss(6, 3000, stride(7), 4);
}

/* Large scenes make the log be copied into the file and begun anew. */
static void
power_may_fail_around_a_checkpoint(void **state)
{
    (void)state;
    power_loss(14, 500 * 1000, stride(331), 3);
}

int
main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_call_may_fail),
        cmocka_unit_test(power_may_fail_at_any_call),
        cmocka_unit_test(power_may_fail_around_a_checkpoint),
    };
    log_setup(LOG_ERROR, LOG_AUTO);
    return cmocka_run_group_tests_name("store faults", tests, NULL, NULL);
}
