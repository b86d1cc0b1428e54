#include "tests/contract/store/faulty_vfs.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct faulty_file {
    sqlite3_file base;
    int kind; /* RECORD_DB, RECORD_WAL; -1: not watched */
    sqlite3_file *real;
};

enum action { WRITE, TRUNCATE, SYNC };

struct entry {
    enum action action;
    int kind;
    int64_t offset; /* truncate: the new size */
    size_t len;
    unsigned char *data;
};

static sqlite3_vfs vfs, *real_vfs;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static enum fault armed;
static unsigned countdown;
static bool reached, recording;
static struct entry *entries;
static size_t entry_count, entry_capacity;

/* --- the finger --- */

static void
record(enum action action, const struct faulty_file *file, const void *data,
       size_t len, int64_t offset)
{
    if (!recording)
        return;
    if (entry_count == entry_capacity) {
        entry_capacity = entry_capacity == 0 ? 1024 : entry_capacity * 2;
        entries = realloc(entries, entry_capacity * sizeof *entries);
        if (entries == NULL)
            abort();
    }
    struct entry *e = &entries[entry_count++];
    *e = (struct entry){action, file->kind, offset, len, NULL};
    if (len > 0) {
        e->data = malloc(len);
        if (e->data == NULL)
            abort();
        memcpy(e->data, data, len);
    }
}

/* SQLITE_OK: go on. */
static int
finger(enum action action, struct faulty_file *file, const void *data, int len,
       int64_t offset)
{
    int rc = SQLITE_OK;
    if (file->kind < 0)
        return rc;
    pthread_mutex_lock(&lock);
    bool now = countdown > 0 && --countdown == 0;
    reached |= now;
    bool full = now || (reached && armed == FAULT_FULL_FROM);
    if (now && (armed == FAULT_EIO || armed == FAULT_SHORT)) {
        if (armed == FAULT_SHORT && action == WRITE)
            file->real->pMethods->xWrite(file->real, data, len / 2, offset);
        errno = EIO;
        rc = action == SYNC ? SQLITE_IOERR_FSYNC : SQLITE_IOERR_WRITE;
    } else if (full && action != SYNC &&
               (armed == FAULT_FULL_ONCE || armed == FAULT_FULL_FROM)) {
        errno = ENOSPC;
        rc = SQLITE_FULL;
    } else {
        record(action, file, data, (size_t)len, offset);
    }
    pthread_mutex_unlock(&lock);
    return rc;
}

/* --- files --- */

#define REAL(f) (((struct faulty_file *)(f))->real)

static int
f_close(sqlite3_file *f)
{
    int rc = SQLITE_OK;
    if (REAL(f)->pMethods != NULL)
        rc = REAL(f)->pMethods->xClose(REAL(f));
    free(REAL(f));
    return rc;
}

static int
f_read(sqlite3_file *f, void *data, int len, sqlite3_int64 offset)
{
    return REAL(f)->pMethods->xRead(REAL(f), data, len, offset);
}

static int
f_write(sqlite3_file *f, const void *data, int len, sqlite3_int64 offset)
{
    int rc = finger(WRITE, (struct faulty_file *)f, data, len, offset);
    return rc != SQLITE_OK
               ? rc
               : REAL(f)->pMethods->xWrite(REAL(f), data, len, offset);
}

static int
f_truncate(sqlite3_file *f, sqlite3_int64 size)
{
    int rc = finger(TRUNCATE, (struct faulty_file *)f, NULL, 0, size);
    return rc != SQLITE_OK ? rc : REAL(f)->pMethods->xTruncate(REAL(f), size);
}

static int
f_sync(sqlite3_file *f, int flags)
{
    struct faulty_file *file = (struct faulty_file *)f;
    if (file->kind < 0)
        return file->real->pMethods->xSync(file->real, flags);
    return finger(SYNC, file, NULL, 0, 0);
}

static int
f_size(sqlite3_file *f, sqlite3_int64 *size)
{
    return REAL(f)->pMethods->xFileSize(REAL(f), size);
}

static int
f_lock(sqlite3_file *f, int level)
{
    return REAL(f)->pMethods->xLock(REAL(f), level);
}

static int
f_unlock(sqlite3_file *f, int level)
{
    return REAL(f)->pMethods->xUnlock(REAL(f), level);
}

static int
f_check_lock(sqlite3_file *f, int *out)
{
    return REAL(f)->pMethods->xCheckReservedLock(REAL(f), out);
}

static int
f_control(sqlite3_file *f, int op, void *arg)
{
    return REAL(f)->pMethods->xFileControl(REAL(f), op, arg);
}

static int
f_sector(sqlite3_file *f)
{
    return REAL(f)->pMethods->xSectorSize(REAL(f));
}

static int
f_device(sqlite3_file *f)
{
    /* A disk that promises nothing. */
    (void)f;
    return 0;
}

static int
f_shm_map(sqlite3_file *f, int page, int size, int extend, void volatile **out)
{
    return REAL(f)->pMethods->xShmMap(REAL(f), page, size, extend, out);
}

static int
f_shm_lock(sqlite3_file *f, int offset, int n, int flags)
{
    return REAL(f)->pMethods->xShmLock(REAL(f), offset, n, flags);
}

static void
f_shm_barrier(sqlite3_file *f)
{
    REAL(f)->pMethods->xShmBarrier(REAL(f));
}

static int
f_shm_unmap(sqlite3_file *f, int delete)
{
    return REAL(f)->pMethods->xShmUnmap(REAL(f), delete);
}

static const sqlite3_io_methods methods = {
    .iVersion = 2,
    .xClose = f_close,
    .xRead = f_read,
    .xWrite = f_write,
    .xTruncate = f_truncate,
    .xSync = f_sync,
    .xFileSize = f_size,
    .xLock = f_lock,
    .xUnlock = f_unlock,
    .xCheckReservedLock = f_check_lock,
    .xFileControl = f_control,
    .xSectorSize = f_sector,
    .xDeviceCharacteristics = f_device,
    .xShmMap = f_shm_map,
    .xShmLock = f_shm_lock,
    .xShmBarrier = f_shm_barrier,
    .xShmUnmap = f_shm_unmap,
};

static int
v_open(sqlite3_vfs *v, sqlite3_filename name, sqlite3_file *f, int flags,
       int *out)
{
    struct faulty_file *file = (struct faulty_file *)f;
    (void)v;
    file->kind = flags & SQLITE_OPEN_MAIN_DB ? RECORD_DB
                 : flags & SQLITE_OPEN_WAL   ? RECORD_WAL
                                             : -1;
    file->real = calloc(1, (size_t)real_vfs->szOsFile);
    if (file->real == NULL)
        return SQLITE_NOMEM;
    int rc = real_vfs->xOpen(real_vfs, name, file->real, flags, out);
    file->base.pMethods = &methods;
    if (rc != SQLITE_OK) {
        file->base.pMethods = NULL;
        if (file->real->pMethods != NULL)
            file->real->pMethods->xClose(file->real);
        free(file->real);
    }
    return rc;
}

void
faulty_install(void)
{
    real_vfs = sqlite3_vfs_find("unix");
    vfs = *real_vfs;
    vfs.szOsFile = (int)sizeof(struct faulty_file);
    vfs.zName = "faulty";
    vfs.pNext = NULL;
    vfs.xOpen = v_open;
    sqlite3_vfs_register(&vfs, 1);
}

void
faulty_uninstall(void)
{
    sqlite3_vfs_unregister(&vfs);
    sqlite3_vfs_register(real_vfs, 1);
}

void
faulty_arm(enum fault fault, unsigned n)
{
    pthread_mutex_lock(&lock);
    armed = fault;
    countdown = n;
    reached = false;
    pthread_mutex_unlock(&lock);
}

bool
faulty_reached(void)
{
    pthread_mutex_lock(&lock);
    bool was = reached;
    pthread_mutex_unlock(&lock);
    return was;
}

/* --- recording and replaying --- */

void
faulty_record(void)
{
    faulty_stop_record();
    pthread_mutex_lock(&lock);
    recording = true;
    pthread_mutex_unlock(&lock);
}

size_t
faulty_recorded(void)
{
    pthread_mutex_lock(&lock);
    size_t count = entry_count;
    pthread_mutex_unlock(&lock);
    return count;
}

void
faulty_stop_record(void)
{
    pthread_mutex_lock(&lock);
    recording = false;
    for (size_t i = 0; i < entry_count; i++)
        free(entries[i].data);
    free(entries);
    entries = NULL;
    entry_count = entry_capacity = 0;
    pthread_mutex_unlock(&lock);
}

static uint64_t
next_random(uint64_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state >> 11;
}

static bool
put(int fd, const struct entry *e, size_t from, size_t len)
{
    return len == 0 ||
           pwrite(fd, e->data + from, len,
                  (off_t)(e->offset + (int64_t)from)) == (ssize_t)len;
}

/* One entry that was not synced: all, nothing, or some of its sectors. */
static bool
put_perhaps(int fd, const struct entry *e, uint64_t *random)
{
    uint64_t dice = next_random(random) % 4;
    if (dice == 0)
        return true;
    if (e->action == TRUNCATE)
        return dice == 1 || ftruncate(fd, (off_t)e->offset) == 0;
    if (dice == 1)
        return put(fd, e, 0, e->len);
    for (size_t at = 0; at < e->len;) {
        /* sectors are those of the file, not of the write */
        size_t end = at + 512 - (size_t)((e->offset + (int64_t)at) % 512);
        if (end > e->len)
            end = e->len;
        if (next_random(random) % 2 == 0 && !put(fd, e, at, end - at))
            return false;
        at = end;
    }
    return true;
}

bool
faulty_replay(const char *path, const void *base, size_t base_len, size_t n,
              uint64_t random)
{
    static const char *const ends[RECORD_FILES] = {"", "-wal"};
    uint64_t state = random * 0x9E3779B97F4A7C15u + 1;
    bool ok = true;
    char name[4096];
    snprintf(name, sizeof name, "%s-shm", path);
    unlink(name);
    for (int kind = 0; kind < RECORD_FILES && ok; kind++) {
        snprintf(name, sizeof name, "%s%s", path, ends[kind]);
        int fd = open(name, O_RDWR | O_CREAT | O_TRUNC, 0600);
        ok = fd >= 0;
        if (ok && kind == RECORD_DB)
            ok = pwrite(fd, base, base_len, 0) == (ssize_t)base_len;
        size_t synced = 0;
        for (size_t i = 0; i < n; i++) {
            if (entries[i].kind == kind && entries[i].action == SYNC)
                synced = i;
        }
        for (size_t i = 0; i < n && ok; i++) {
            const struct entry *e = &entries[i];
            if (e->kind != kind || e->action == SYNC)
                continue;
            if (i >= synced && random == 0)
                continue;
            if (i >= synced && random != 1)
                ok = put_perhaps(fd, e, &state);
            else if (e->action == TRUNCATE)
                ok = ftruncate(fd, (off_t)e->offset) == 0;
            else
                ok = put(fd, e, 0, e->len);
        }
        if (fd >= 0)
            close(fd);
    }
    return ok;
}
