/* One file, two connections: the writer's, which also checkpoints, and a
 * read-only one. WAL lets readers go on during a commit. */
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include "core/base/clock.h"
#include "core/base/log.h"
#include "core/base/must.h"
#include "server/jobs/rank.h"
#include "server/store/apply.h"
#include "server/store/rows.h"
#include "server/store/schema.h"

/* --- columns: one row each; type, name, member of struct row --- */

#define FIXED_COLUMNS(X)                                                       \
    X(TEXT, id, job.id)                                                        \
    X(TEXT, owner, job.owner)                                                  \
    X(I32, priority, job.priority)                                             \
    X(I64, rank, rank)                                                         \
    X(BOOL, short, is_short)                                                   \
    X(I32, max_attempts, job.max_attempts)                                     \
    X(I64, created_ms, job.created_ms)                                         \
    X(TEXT, scene_hash, job.scene_hash)                                        \
    X(TEXT, render_key, job.render_key)                                        \
    X(TEXT, output, job.output)                                                \
    X(TEXT, tags, job.tags)                                                    \
    X(TEXT, settings, job.settings)                                            \
    X(REAL, estimate_rays, job.estimate_rays)                                  \
    X(REAL, estimate_seconds, job.estimate_seconds)                            \
    X(REAL, estimate_bytes, job.estimate_bytes)                                \
    X(BOOL, no_cache, job.no_cache)                                            \
    X(TEXT, media_type, job.media_type)

/* These may change; `state` stands before them. */
#define CHANGING_COLUMNS(X)                                                    \
    X(I32, phase, job.phase)                                                   \
    X(BOOL, cancel_requested, job.cancel_requested)                            \
    X(I32, revision, job.revision)                                             \
    X(I32, epoch, job.epoch)                                                   \
    X(I32, attempt, job.attempt)                                               \
    X(REAL, progress, job.progress)                                            \
    X(I64, rays_done, job.rays_done)                                           \
    X(I64, started_ms, job.started_ms)                                         \
    X(I64, finished_ms, job.finished_ms)                                       \
    X(TEXT, result, job.result)                                                \
    X(I64, result_len, job.result_len)                                         \
    X(I64, rays_camera, job.stats.rays_camera)                                 \
    X(I64, rays_shadow, job.stats.rays_shadow)                                 \
    X(I64, rays_bounce, job.stats.rays_bounce)                                 \
    X(REAL, queue_ms, job.stats.queue_ms)                                      \
    X(REAL, load_ms, job.stats.load_ms)                                        \
    X(REAL, build_ms, job.stats.build_ms)                                      \
    X(REAL, trace_ms, job.stats.trace_ms)                                      \
    X(REAL, encode_ms, job.stats.encode_ms)                                    \
    X(I64, peak_bytes, job.stats.peak_bytes)                                   \
    X(ERROR, error, job.error_code)                                            \
    X(TEXT, error_text, job.error_text)

enum column_type { TEXT, I32, I64, BOOL, REAL, ERROR };

static const struct column {
    enum column_type type;
    size_t offset, size;
} columns[] = {
#define COLUMN(type, name, member)                                             \
    {type, offsetof(struct row, member), sizeof(((struct row *)0)->member)},
    FIXED_COLUMNS(COLUMN) COLUMN(I32, state, job.state) CHANGING_COLUMNS(COLUMN)
#undef COLUMN
};

enum {
#define COUNT(type, name, member) +1
    FIXED_COUNT = 0 FIXED_COLUMNS(COUNT),
#undef COUNT
    COLUMN_COUNT = sizeof columns / sizeof columns[0],
    CHANGING_COUNT = COLUMN_COUNT - FIXED_COUNT /* with state */
};

_Static_assert(sizeof(enum job_state) == 4 && sizeof(enum job_priority) == 4,
               "enumerations are bound as 32 bits");

/* --- statements: fixed text, prepared once per connection --- */

#define NAME(type, name, member) "," #name
#define MARK(type, name, member) ",?"
#define SET(type, name, member)  "," #name "=?"
#define ALL_COLUMNS              "seq" FIXED_COLUMNS(NAME) ",state" CHANGING_COLUMNS(NAME)

/* ?1 owner, ?2 id before, ?3 since, ?4 tag, ?5 states, ?6 limit */
#define LIST_FILTER                                                            \
    " id<?2 AND created_ms>=?3"                                                \
    " AND (?4='' OR instr(','||tags||',', ','||?4||',')>0)"
#define LIST_OWNER(state)                                                      \
    "SELECT " ALL_COLUMNS " FROM jobs WHERE owner=?1 AND state=" #state        \
    " AND (?5>>" #state ")&1 AND" LIST_FILTER

enum statement {
    BEGIN,
    COMMIT,
    ROLLBACK,
    INSERT_JOB,
    INSERT_SCENE,
    UPDATE_JOB,
    DELETE_JOB,
    FIRST,
    FIRST_SHORT,
    FIRST_SHORTER,
    TURN,
    SET_TURN,
    SET_CLOCK,
    GET,
    SCENE,
    FIND_ONE,
    FIND_ALL,
    LIST_ONE,
    LIST_ALL,
    COUNT_STATES,
    ADD_COUNT,
    POSITION,
    BLOB_USERS,
    STATEMENT_COUNT
};

static const char *const sql[STATEMENT_COUNT] = {
    [BEGIN] = "BEGIN IMMEDIATE",
    [COMMIT] = "COMMIT",
    [ROLLBACK] = "ROLLBACK",
    [INSERT_JOB] =
        "INSERT INTO jobs (" ALL_COLUMNS
        ") VALUES (NULL" FIXED_COLUMNS(MARK) ",?" CHANGING_COLUMNS(MARK) ")",
    [INSERT_SCENE] = "INSERT INTO scenes (seq, text) VALUES (?, ?)",
    [UPDATE_JOB] =
        "UPDATE jobs SET state=?" CHANGING_COLUMNS(SET) " WHERE seq=?",
    [DELETE_JOB] = "DELETE FROM jobs WHERE seq=?",
    [FIRST] = "SELECT " ALL_COLUMNS " FROM jobs INDEXED BY jobs_waiting"
              " WHERE state=0 ORDER BY priority, rank, seq LIMIT 1",
    /* The short lane's own question, answered by its own index. */
    [FIRST_SHORT] =
        "SELECT " ALL_COLUMNS " FROM jobs INDEXED BY jobs_waiting_short"
        " WHERE state=0 AND short=1 AND (priority=0 OR estimate_seconds<?)"
        " ORDER BY priority, rank, seq LIMIT 1",
    [FIRST_SHORTER] = "SELECT " ALL_COLUMNS " FROM jobs INDEXED BY jobs_waiting"
                      " WHERE state=0 AND (priority=0 OR estimate_seconds<?)"
                      " ORDER BY priority, rank, seq LIMIT 1",
    [TURN] = "SELECT now_us, (SELECT end_us FROM turns"
             " WHERE owner=?1 AND priority=?2)"
             " FROM clocks WHERE priority=?2",
    [SET_TURN] = "INSERT INTO turns (owner, priority, end_us)"
                 " VALUES (?1, ?2, ?3) ON CONFLICT (owner, priority)"
                 " DO UPDATE SET end_us=excluded.end_us",
    [SET_CLOCK] = "UPDATE clocks SET now_us=?2"
                  " WHERE priority=?1 AND now_us<?2",
    [GET] = "SELECT " ALL_COLUMNS " FROM jobs WHERE id=?",
    [SCENE] = "SELECT text FROM scenes WHERE seq="
              "(SELECT seq FROM jobs WHERE id=?)",
    [FIND_ONE] =
        "SELECT " ALL_COLUMNS " FROM jobs INDEXED BY jobs_by_render_key"
        " WHERE state=2 AND no_cache=0 AND render_key=?1"
        " AND owner=?2 ORDER BY seq DESC LIMIT 1",
    [FIND_ALL] = "SELECT " ALL_COLUMNS " FROM jobs WHERE seq=(SELECT max(seq)"
                 " FROM jobs INDEXED BY jobs_by_render_key"
                 " WHERE state=2 AND no_cache=0 AND render_key=?1)",
    /* Five sorted runs, merged: as long as the answer, not as the table. */
    [LIST_ONE] =
        LIST_OWNER(0) " UNION ALL " LIST_OWNER(1) " UNION ALL " LIST_OWNER(
            2) " UNION ALL " LIST_OWNER(3) " UNION ALL " LIST_OWNER(4) " ORDER "
                                                                       "BY id "
                                                                       "DESC "
                                                                       "LIMIT "
                                                                       "?6",
    [LIST_ALL] =
        "SELECT " ALL_COLUMNS " FROM jobs WHERE (?5>>state)&1 AND" LIST_FILTER
        " ORDER BY id DESC LIMIT ?6",
    [COUNT_STATES] = "SELECT state, jobs FROM counts",
    [ADD_COUNT] = "UPDATE counts SET jobs=jobs+?2 WHERE state=?1",
    [POSITION] = "SELECT count(*) FROM jobs INDEXED BY jobs_waiting"
                 " WHERE state=0 AND (priority, rank, seq) < (?, ?, ?)",
    [BLOB_USERS] = "SELECT count(*) FROM jobs"
                   " WHERE result=? AND result<>''",
};

static const char pragmas[] = "PRAGMA synchronous=FULL;"
                              "PRAGMA journal_size_limit=67108864;"
                              "PRAGMA foreign_keys=ON;"
                              "PRAGMA temp_store=MEMORY;"
                              "PRAGMA cache_size=-8192;"
                              "PRAGMA mmap_size=0;"
                              "PRAGMA trusted_schema=OFF;";

enum {
    BUSY_MS = 5000,
    CHECKPOINT_FRAMES = 1000,      /* WAL pages that call for a checkpoint */
    CHECKPOINT_LIMIT_FRAMES = 8000 /* from here on it waits for readers */
};

struct sqlite {
    struct rows rows;
    sqlite3 *db;
    sqlite3_stmt *statements[STATEMENT_COUNT];
    int cause;      /* errno of the last step; SQLite does not keep it */
    int lock_fd;    /* the writer's; -1: none */
    int wal_frames; /* after the last commit */
};

static struct sqlite *
sqlite_of(struct rows *rows)
{
    return (struct sqlite *)rows;
}

/* --- errors --- */

/* No room: the file system's, the quota's or the process's limit. */
static bool
is_full(struct sqlite *s, int rc)
{
    if ((rc & 0xff) == SQLITE_FULL)
        return true;
    int cause = s->cause;
    return (rc == SQLITE_IOERR_WRITE || rc == SQLITE_IOERR_SHMSIZE ||
            rc == SQLITE_IOERR_TRUNCATE) &&
           (cause == ENOSPC || cause == EDQUOT || cause == EFBIG);
}

static bool
failed(struct sqlite *s, int rc, const char *doing, struct error *err)
{
    enum error_code code = is_full(s, rc)                ? ERROR_STORAGE_FULL
                           : (rc & 0xff) == SQLITE_NOMEM ? ERROR_MEMORY
                                                         : ERROR_IO;
    return error_set(err, code, "the database cannot %s: %s (%d)", doing,
                     sqlite3_errstr(rc), rc);
}

/* --- statements --- */

static sqlite3_stmt *
statement(struct rows *rows, enum statement which)
{
    return sqlite_of(rows)->statements[which];
}

static int
step(struct rows *rows, sqlite3_stmt *stmt)
{
    errno = 0;
    int rc = sqlite3_step(stmt);
    sqlite_of(rows)->cause = errno;
    return rc;
}

/* Run to the end; for statements without rows of interest. */
static int
run(struct rows *rows, sqlite3_stmt *stmt)
{
    int rc = step(rows, stmt);
    int reset = sqlite3_reset(stmt);
    sqlite3_clear_bindings(stmt);
    return rc == SQLITE_DONE || rc == SQLITE_ROW ? SQLITE_OK
           : reset != SQLITE_OK                  ? reset
                                                 : rc;
}

static int
bind_text(sqlite3_stmt *stmt, int i, const char *text)
{
    return sqlite3_bind_text(stmt, i, text, -1, SQLITE_STATIC);
}

static int
bind_column(sqlite3_stmt *stmt, int i, const struct column *column,
            const struct row *row)
{
    const char *at = (const char *)row + column->offset;
    uint32_t number = 0;
    int64_t whole = 0;
    double real = 0;
    switch (column->type) {
    case TEXT: return bind_text(stmt, i, at);
    case I32:
        memcpy(&number, at, sizeof number);
        return sqlite3_bind_int64(stmt, i, number);
    case I64:
        memcpy(&whole, at, sizeof whole);
        return sqlite3_bind_int64(stmt, i, whole);
    case BOOL: return sqlite3_bind_int(stmt, i, *(const bool *)at);
    case REAL:
        memcpy(&real, at, sizeof real);
        return sqlite3_bind_double(stmt, i, real);
    case ERROR:
        memcpy(&number, at, sizeof number);
        return bind_text(stmt, i, error_code_name((enum error_code)number));
    }
    return SQLITE_MISUSE;
}

static void
read_column(sqlite3_stmt *stmt, int i, const struct column *column,
            struct row *row)
{
    char *at = (char *)row + column->offset;
    const char *text;
    uint32_t number;
    int64_t whole;
    double real;
    switch (column->type) {
    case TEXT:
        text = (const char *)sqlite3_column_text(stmt, i);
        snprintf(at, column->size, "%s", text != NULL ? text : "");
        break;
    case I32:
        number = (uint32_t)sqlite3_column_int64(stmt, i);
        memcpy(at, &number, sizeof number);
        break;
    case I64:
        whole = sqlite3_column_int64(stmt, i);
        memcpy(at, &whole, sizeof whole);
        break;
    case BOOL: *(bool *)at = sqlite3_column_int(stmt, i) != 0; break;
    case REAL:
        real = sqlite3_column_double(stmt, i);
        memcpy(at, &real, sizeof real);
        break;
    case ERROR:
        text = (const char *)sqlite3_column_text(stmt, i);
        number = error_code_find(text != NULL ? text : "");
        memcpy(at, &number, sizeof number);
        break;
    }
}

/* The row under a statement that selects ALL_COLUMNS. */
static void
read_row(sqlite3_stmt *stmt, struct row *row)
{
    memset(row, 0, sizeof *row);
    row->seq = sqlite3_column_int64(stmt, 0);
    for (int i = 0; i < COLUMN_COUNT; i++)
        read_column(stmt, i + 1, &columns[i], row);
    row->revision_kept = row->job.revision;
}

/* Step a bound statement that selects one row, read it, reset. */
static bool
read_one(struct rows *rows, sqlite3_stmt *stmt, struct row *row,
         const char *missing, struct error *err)
{
    int rc = step(rows, stmt);
    if (rc == SQLITE_ROW)
        read_row(stmt, row);
    int reset = sqlite3_reset(stmt);
    sqlite3_clear_bindings(stmt);
    if (rc == SQLITE_ROW)
        return true;
    if (rc == SQLITE_DONE)
        return error_set(err, ERROR_NOT_FOUND, "%s", missing);
    return failed(sqlite_of(rows), reset, "read a job", err);
}

/* --- the writer's calls --- */

/* Only another program that opened the file can make this wait. */
static bool
sqlite_begin(struct rows *rows, struct error *err)
{
    int rc;
    while (((rc = run(rows, statement(rows, BEGIN))) & 0xff) == SQLITE_BUSY)
        log_write(LOG_WARN, "store",
                  "another program writes to the database, waiting for it");
    return rc == SQLITE_OK ||
           failed(sqlite_of(rows), rc, "begin a transaction", err);
}

static bool
sqlite_commit(struct rows *rows, struct error *err)
{
    int rc = run(rows, statement(rows, COMMIT));
    if (rc == SQLITE_OK)
        return true;
    failed(sqlite_of(rows), rc, "commit", err);
    /* Whether a commit that ran out of memory is on disk is unknown. */
    if (err != NULL && err->code == ERROR_MEMORY)
        err->code = ERROR_IO;
    return false;
}

static void
sqlite_rollback(struct rows *rows)
{
    /* Some errors have rolled back already. */
    if (!sqlite3_get_autocommit(sqlite_of(rows)->db))
        run(rows, statement(rows, ROLLBACK));
}

/* The writer checkpoints itself, and not by wal_autocheckpoint, so that a
 * failed fsync is seen. */
static bool
sqlite_upkeep(struct rows *rows, struct error *err)
{
    struct sqlite *s = sqlite_of(rows);
    if (s->wal_frames < CHECKPOINT_FRAMES)
        return true;
    int mode = s->wal_frames < CHECKPOINT_LIMIT_FRAMES
                   ? SQLITE_CHECKPOINT_PASSIVE
                   : SQLITE_CHECKPOINT_RESTART;
    s->wal_frames = 0;
    errno = 0;
    int rc = sqlite3_wal_checkpoint_v2(s->db, NULL, mode, NULL, NULL);
    s->cause = errno;
    if (rc == SQLITE_OK || (rc & 0xff) == SQLITE_BUSY || is_full(s, rc))
        return true;
    return failed(s, rc, "copy its log into the file", err);
}

static int
note_wal_frames(void *user, sqlite3 *db, const char *name, int frames)
{
    (void)db;
    (void)name;
    ((struct sqlite *)user)->wal_frames = frames;
    return SQLITE_OK;
}

static bool
sqlite_insert(struct rows *rows, struct row *row, const char *scene,
              size_t scene_len, struct error *err)
{
    struct sqlite *s = sqlite_of(rows);
    sqlite3_stmt *stmt = statement(rows, INSERT_JOB);
    int rc = SQLITE_OK;
    for (int i = 0; i < COLUMN_COUNT && rc == SQLITE_OK; i++)
        rc = bind_column(stmt, i + 1, &columns[i], row);
    int ran = run(rows, stmt);
    if (rc == SQLITE_OK)
        rc = ran;
    if (rc == SQLITE_CONSTRAINT_UNIQUE)
        return error_set(err, ERROR_CONFLICT, "there is a job %s already",
                         row->job.id);
    if (rc == SQLITE_OK) {
        row->seq = sqlite3_last_insert_rowid(s->db);
        stmt = statement(rows, INSERT_SCENE);
        sqlite3_bind_int64(stmt, 1, row->seq);
        sqlite3_bind_blob64(stmt, 2, scene_len > 0 ? scene : "", scene_len,
                            SQLITE_STATIC);
        rc = run(rows, stmt);
    }
    return rc == SQLITE_OK || failed(s, rc, "keep a job", err);
}

static bool
sqlite_update(struct rows *rows, const struct row *row, struct error *err)
{
    sqlite3_stmt *stmt = statement(rows, UPDATE_JOB);
    for (int i = 0; i < CHANGING_COUNT; i++)
        bind_column(stmt, i + 1, &columns[FIXED_COUNT + i], row);
    sqlite3_bind_int64(stmt, CHANGING_COUNT + 1, row->seq);
    int rc = run(rows, stmt);
    return rc == SQLITE_OK || failed(sqlite_of(rows), rc, "change a job", err);
}

static bool
sqlite_remove(struct rows *rows, const struct row *row, struct error *err)
{
    sqlite3_stmt *stmt = statement(rows, DELETE_JOB);
    sqlite3_bind_int64(stmt, 1, row->seq);
    int rc = run(rows, stmt);
    return rc == SQLITE_OK || failed(sqlite_of(rows), rc, "delete a job", err);
}

static bool
sqlite_first(struct rows *rows, double max_seconds, struct row *row,
             struct error *err)
{
    enum statement which = max_seconds <= 0                    ? FIRST
                           : max_seconds <= RANK_SHORT_SECONDS ? FIRST_SHORT
                                                               : FIRST_SHORTER;
    sqlite3_stmt *stmt = statement(rows, which);
    if (which != FIRST)
        sqlite3_bind_double(stmt, 1, max_seconds);
    return read_one(rows, stmt, row, "no job fits", err);
}

static bool
sqlite_turn(struct rows *rows, const char *owner, enum job_priority priority,
            int64_t *clock, int64_t *owner_end, struct error *err)
{
    sqlite3_stmt *stmt = statement(rows, TURN);
    bind_text(stmt, 1, owner);
    sqlite3_bind_int(stmt, 2, (int)priority);
    int rc = step(rows, stmt);
    if (rc == SQLITE_ROW) {
        *clock = sqlite3_column_int64(stmt, 0);
        *owner_end = sqlite3_column_int64(stmt, 1); /* NULL reads as 0 */
    }
    sqlite3_reset(stmt);
    sqlite3_clear_bindings(stmt);
    return rc == SQLITE_ROW ||
           failed(sqlite_of(rows), rc, "read whose turn it is", err);
}

static bool
sqlite_set_turn(struct rows *rows, const char *owner,
                enum job_priority priority, int64_t owner_end,
                struct error *err)
{
    sqlite3_stmt *stmt = statement(rows, SET_TURN);
    bind_text(stmt, 1, owner);
    sqlite3_bind_int(stmt, 2, (int)priority);
    sqlite3_bind_int64(stmt, 3, owner_end);
    int rc = run(rows, stmt);
    return rc == SQLITE_OK ||
           failed(sqlite_of(rows), rc, "note whose turn it is", err);
}

static bool
sqlite_set_clock(struct rows *rows, enum job_priority priority, int64_t clock,
                 struct error *err)
{
    sqlite3_stmt *stmt = statement(rows, SET_CLOCK);
    sqlite3_bind_int(stmt, 1, (int)priority);
    sqlite3_bind_int64(stmt, 2, clock);
    int rc = run(rows, stmt);
    return rc == SQLITE_OK ||
           failed(sqlite_of(rows), rc, "note whose turn it is", err);
}

static bool
sqlite_add_count(struct rows *rows, enum job_state state, int64_t more,
                 struct error *err)
{
    sqlite3_stmt *stmt = statement(rows, ADD_COUNT);
    sqlite3_bind_int(stmt, 1, (int)state);
    sqlite3_bind_int64(stmt, 2, more);
    int rc = run(rows, stmt);
    return rc == SQLITE_OK || failed(sqlite_of(rows), rc, "count jobs", err);
}

/* --- calls of both --- */

static bool
sqlite_get(struct rows *rows, const char *id, struct row *row,
           struct error *err)
{
    char missing[128];
    snprintf(missing, sizeof missing, "there is no job %.64s", id);
    sqlite3_stmt *stmt = statement(rows, GET);
    bind_text(stmt, 1, id);
    return read_one(rows, stmt, row, missing, err);
}

static bool
sqlite_scene(struct rows *rows, const char *id, struct bytes *scene,
             struct error *err)
{
    sqlite3_stmt *stmt = statement(rows, SCENE);
    bind_text(stmt, 1, id);
    int rc = step(rows, stmt);
    if (rc == SQLITE_ROW) {
        const void *text = sqlite3_column_blob(stmt, 0);
        bytes_append(scene, text, (size_t)sqlite3_column_bytes(stmt, 0));
    }
    int reset = sqlite3_reset(stmt);
    sqlite3_clear_bindings(stmt);
    if (rc == SQLITE_DONE)
        return error_set(err, ERROR_NOT_FOUND, "there is no job %.64s", id);
    if (rc != SQLITE_ROW)
        return failed(sqlite_of(rows), reset, "read a scene", err);
    return !scene->failed ||
           error_set(err, ERROR_MEMORY, "no memory for a scene");
}

static bool
sqlite_find(struct rows *rows, const char *render_key, const char *owner,
            struct row *row, struct error *err)
{
    sqlite3_stmt *stmt = statement(rows, owner != NULL ? FIND_ONE : FIND_ALL);
    bind_text(stmt, 1, render_key);
    if (owner != NULL)
        bind_text(stmt, 2, owner);
    return read_one(rows, stmt, row, "no job has rendered that yet", err);
}

static int
sqlite_list(struct rows *rows, const struct store_filter *filter,
            struct job *jobs, struct error *err)
{
    sqlite3_stmt *stmt =
        statement(rows, filter->owner != NULL ? LIST_ONE : LIST_ALL);
    struct row row;
    int count = 0, rc;
    if (filter->owner != NULL)
        bind_text(stmt, 1, filter->owner);
    bind_text(stmt, 2, filter->before != NULL ? filter->before : "~");
    sqlite3_bind_int64(stmt, 3, filter->since_ms);
    bind_text(stmt, 4, filter->tag != NULL ? filter->tag : "");
    sqlite3_bind_int64(stmt, 5, filter->states != 0 ? filter->states : ~0u);
    sqlite3_bind_int64(stmt, 6, filter->limit);
    while ((rc = step(rows, stmt)) == SQLITE_ROW &&
           count < (int)filter->limit) {
        read_row(stmt, &row);
        jobs[count++] = row.job;
    }
    int reset = sqlite3_reset(stmt);
    sqlite3_clear_bindings(stmt);
    if (rc == SQLITE_DONE)
        return count;
    failed(sqlite_of(rows), reset, "list jobs", err);
    return -1;
}

static bool
sqlite_count(struct rows *rows, uint64_t jobs[JOB_STATE_COUNT],
             struct error *err)
{
    sqlite3_stmt *stmt = statement(rows, COUNT_STATES);
    int rc;
    memset(jobs, 0, JOB_STATE_COUNT * sizeof *jobs);
    while ((rc = step(rows, stmt)) == SQLITE_ROW) {
        int64_t state = sqlite3_column_int64(stmt, 0);
        if (state >= 0 && state < JOB_STATE_COUNT)
            jobs[state] = (uint64_t)sqlite3_column_int64(stmt, 1);
    }
    int reset = sqlite3_reset(stmt);
    return rc == SQLITE_DONE ||
           failed(sqlite_of(rows), reset, "count jobs", err);
}

/* Step a bound statement that selects one number. */
static bool
read_number(struct rows *rows, sqlite3_stmt *stmt, uint64_t *number,
            struct error *err)
{
    int rc = step(rows, stmt);
    if (rc == SQLITE_ROW)
        *number = (uint64_t)sqlite3_column_int64(stmt, 0);
    int reset = sqlite3_reset(stmt);
    sqlite3_clear_bindings(stmt);
    return rc == SQLITE_ROW ||
           failed(sqlite_of(rows), reset, "count jobs", err);
}

static bool
sqlite_position(struct rows *rows, const struct row *row, uint64_t *position,
                struct error *err)
{
    sqlite3_stmt *stmt = statement(rows, POSITION);
    sqlite3_bind_int(stmt, 1, (int)row->job.priority);
    sqlite3_bind_int64(stmt, 2, row->rank);
    sqlite3_bind_int64(stmt, 3, row->seq);
    return read_number(rows, stmt, position, err);
}

static bool
sqlite_blob_users(struct rows *rows, const char *sha256, uint64_t *users,
                  struct error *err)
{
    sqlite3_stmt *stmt = statement(rows, BLOB_USERS);
    bind_text(stmt, 1, sha256);
    return read_number(rows, stmt, users, err);
}

static void
sqlite_close(struct rows *rows)
{
    struct sqlite *s = sqlite_of(rows);
    for (int i = 0; i < STATEMENT_COUNT; i++)
        sqlite3_finalize(s->statements[i]);
    sqlite3_close(s->db); /* the last connection checkpoints */
    if (s->lock_fd >= 0)
        close(s->lock_fd);
    free(s);
}

static const struct rows_ops sqlite_ops = {
    .close = sqlite_close,
    .begin = sqlite_begin,
    .commit = sqlite_commit,
    .rollback = sqlite_rollback,
    .upkeep = sqlite_upkeep,
    .insert = sqlite_insert,
    .update = sqlite_update,
    .remove = sqlite_remove,
    .first = sqlite_first,
    .turn = sqlite_turn,
    .set_turn = sqlite_set_turn,
    .set_clock = sqlite_set_clock,
    .add_count = sqlite_add_count,
    .get = sqlite_get,
    .scene = sqlite_scene,
    .find = sqlite_find,
    .list = sqlite_list,
    .count = sqlite_count,
    .position = sqlite_position,
    .blob_users = sqlite_blob_users,
};

/* --- open --- */

static const struct {
    uint32_t magic;
    const char *name;
} network_file_systems[] = {
    {0x6969, "NFS"},      {0xFF534D42, "CIFS"},   {0xFE534D42, "SMB2"},
    {0x517B, "SMB"},      {0x01021997, "9P"},     {0x5346414F, "AFS"},
    {0x00C36400, "Ceph"}, {0x0BD00BD0, "Lustre"}, {0x47504653, "GPFS"},
    {0x73757245, "Coda"}, {0x7461636F, "OCFS2"},  {0x01161970, "GFS2"},
};

/* File locks and shared memory do not hold across machines. */
static bool
check_file_system(const char *path, int fd, struct error *err)
{
    struct statfs fs;
    if (fstatfs(fd, &fs) != 0)
        return error_errno(err, ERROR_IO, errno,
                           "cannot tell the file system of %s", path);
    for (size_t i = 0;
         i < sizeof network_file_systems / sizeof network_file_systems[0];
         i++) {
        if ((uint32_t)fs.f_type == network_file_systems[i].magic)
            return error_set(err, ERROR_IO,
                             "%s is on a network file system (%s), where "
                             "SQLite may lose data; use a local disk",
                             path, network_file_systems[i].name);
    }
    return true;
}

/* path.lock, held as long as the store is open. */
static bool
lock_file(struct sqlite *s, const char *path, struct error *err)
{
    char lock[PATH_MAX];
    int len = snprintf(lock, sizeof lock, "%s.lock", path);
    if (len < 0 || (size_t)len >= sizeof lock)
        return error_set(err, ERROR_IO, "the path %.64s... is too long", path);
    s->lock_fd = open(lock, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (s->lock_fd < 0)
        return error_errno(err, ERROR_IO, errno, "cannot open %s", lock);
    if (!check_file_system(path, s->lock_fd, err))
        return false;
    if (flock(s->lock_fd, LOCK_EX | LOCK_NB) == 0)
        return true;
    if (errno == EWOULDBLOCK)
        return error_set(err, ERROR_IO,
                         "another glintd is using %s (%s is locked)", path,
                         lock);
    return error_errno(err, ERROR_IO, errno, "cannot lock %s", lock);
}

/* Make the file, readable by its owner only, and its name durable. */
static bool
make_file(const char *path, struct error *err)
{
    int fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (fd < 0)
        return error_errno(err, ERROR_IO, errno, "cannot open %s", path);
    close(fd);
    char folder[PATH_MAX];
    const char *slash = strrchr(path, '/');
    int len = slash == NULL ? 1 : slash == path ? 1 : (int)(slash - path);
    snprintf(folder, sizeof folder, "%.*s", len, slash == NULL ? "." : path);
    fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    bool ok = fd >= 0 && fsync(fd) == 0;
    int cause = errno;
    if (fd >= 0)
        close(fd);
    return ok || error_errno(err, ERROR_IO, cause, "cannot sync %s", folder);
}

static int
number_of(sqlite3 *db, const char *query, int *number)
{
    sqlite3_stmt *stmt = NULL;
    int rc = sqlite3_prepare_v2(db, query, -1, &stmt, NULL);
    if (rc == SQLITE_OK && (rc = sqlite3_step(stmt)) == SQLITE_ROW) {
        *number = sqlite3_column_int(stmt, 0);
        rc = SQLITE_OK;
    }
    sqlite3_finalize(stmt);
    return rc;
}

/* Forward to the newest schema, one transaction per step. */
static bool
upgrade(struct sqlite *s, const char *path, struct error *err)
{
    int version = 0;
    int rc = number_of(s->db, "PRAGMA user_version", &version);
    if (rc != SQLITE_OK)
        return failed(s, rc, "tell its version", err);
    if (version > schema_version)
        return error_set(err, ERROR_IO,
                         "%s was written by a newer glintd (schema %d, this "
                         "one knows %d)",
                         path, version, schema_version);
    for (; version < schema_version; version++) {
        rc = sqlite3_exec(s->db, "BEGIN IMMEDIATE", NULL, NULL, NULL);
        if (rc == SQLITE_OK)
            rc = sqlite3_exec(s->db, schema_steps[version], NULL, NULL, NULL);
        if (rc == SQLITE_OK)
            rc = sqlite3_exec(s->db, "COMMIT", NULL, NULL, NULL);
        if (rc != SQLITE_OK)
            return failed(s, rc, "be brought to this version's schema", err);
    }
    return true;
}

static bool
prepare(struct sqlite *s, struct error *err)
{
    for (int i = 0; i < STATEMENT_COUNT; i++) {
        int rc =
            sqlite3_prepare_v3(s->db, sql[i], -1, SQLITE_PREPARE_PERSISTENT,
                               &s->statements[i], NULL);
        if (rc != SQLITE_OK)
            return error_set(err, ERROR_IO,
                             "the database does not understand statement %d: "
                             "%s",
                             i, sqlite3_errmsg(s->db));
    }
    return true;
}

/* One of the two ways a lease of an earlier life ends. */
static bool
void_some(struct sqlite *s, const char *update, enum job_state to,
          const char *words, struct error *err)
{
    sqlite3_stmt *stmt = NULL;
    MUST(job_may(JOB_RUNNING, to));
    int rc = sqlite3_prepare_v2(s->db, update, -1, &stmt, NULL);
    if (rc == SQLITE_OK) {
        sqlite3_bind_int(stmt, 1, REVISION_LEAP);
        sqlite3_bind_int64(stmt, 2, clock_wall_ms());
        rc = run(&s->rows, stmt);
    }
    sqlite3_finalize(stmt);
    if (rc != SQLITE_OK)
        return failed(s, rc, "take back the leases of its last run", err);
    int count = sqlite3_changes(s->db);
    if (count == 0)
        return true;
    log_write(LOG_INFO, "store", "%d running jobs %s", count, words);
    return sqlite_add_count(&s->rows, JOB_RUNNING, -count, err) &&
           sqlite_add_count(&s->rows, to, count, err);
}

/* Nobody's fault: attempts stay as they are. */
static bool
void_leases(struct sqlite *s, struct error *err)
{
    static const char cancel[] =
        "UPDATE jobs SET state=4, phase=0, cancel_requested=0,"
        " revision=revision+?1, finished_ms=?2"
        " WHERE state=1 AND cancel_requested=1";
    static const char queue[] =
        "UPDATE jobs SET state=0, phase=0, progress=0, rays_done=0,"
        " started_ms=0, revision=revision+?1 WHERE state=1";
    bool ok = sqlite_begin(&s->rows, err) &&
              void_some(s, cancel, JOB_CANCELED, "canceled", err) &&
              void_some(s, queue, JOB_QUEUED, "queued again", err) &&
              sqlite_commit(&s->rows, err);
    if (!ok)
        sqlite_rollback(&s->rows);
    return ok;
}

/* A connection with its pragmas; its statements come later. */
static struct sqlite *
connect_to(const char *path, int flags, struct error *err)
{
    struct sqlite *s = calloc(1, sizeof *s);
    if (s == NULL) {
        error_set(err, ERROR_MEMORY, "no memory for the store");
        return NULL;
    }
    s->rows.ops = &sqlite_ops;
    s->lock_fd = -1;
    int rc = sqlite3_open_v2(
        path, &s->db, flags | SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE,
        NULL);
    if (rc == SQLITE_OK)
        rc = sqlite3_busy_timeout(s->db, BUSY_MS);
    if (rc == SQLITE_OK)
        rc = sqlite3_exec(s->db, pragmas, NULL, NULL, NULL);
    if (rc != SQLITE_OK) {
        error_set(err, ERROR_IO, "cannot open the database %s: %s", path,
                  sqlite3_errstr(rc));
        sqlite_close(&s->rows);
        return NULL;
    }
    return s;
}

static bool
set_up_writer(struct sqlite *s, const char *path, struct error *err)
{
    int rc = sqlite3_exec(s->db, "PRAGMA journal_mode=WAL", NULL, NULL, NULL);
    if (rc != SQLITE_OK)
        return failed(s, rc, "use a write-ahead log", err);
    sqlite3_wal_hook(s->db, note_wal_frames, s);
    return upgrade(s, path, err) && prepare(s, err) && void_leases(s, err);
}

static struct sqlite *
open_writer(const char *path, struct error *err)
{
    /* The lock first: nothing is touched that another daemon uses. */
    struct sqlite lock = {.lock_fd = -1};
    struct sqlite *s = NULL;
    if (!lock_file(&lock, path, err) || !make_file(path, err) ||
        (s = connect_to(path, SQLITE_OPEN_READWRITE, err)) == NULL) {
        if (lock.lock_fd >= 0)
            close(lock.lock_fd);
        return NULL;
    }
    s->lock_fd = lock.lock_fd;
    if (!set_up_writer(s, path, err)) {
        sqlite_close(&s->rows);
        return NULL;
    }
    return s;
}

struct store *
store_open_sqlite(const struct store_options *options, struct error *err)
{
    struct sqlite *writer = open_writer(options->path, err);
    if (writer == NULL)
        return NULL;
    struct sqlite *reader =
        connect_to(options->path, SQLITE_OPEN_READONLY, err);
    if (reader == NULL || !prepare(reader, err)) {
        if (reader != NULL)
            sqlite_close(&reader->rows);
        sqlite_close(&writer->rows);
        return NULL;
    }
    char describe[64];
    snprintf(describe, sizeof describe, "sqlite %s", sqlite3_libversion());
    return store_start(&writer->rows, &reader->rows, describe, options, err);
}
