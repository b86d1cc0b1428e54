#include "server/blobs/blobs_dir.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "core/base/log.h"

enum {
    CHUNK = 256 * 1024,
    NAME_SIZE = 3 + SHA256_HEX_SIZE /* "ab/" and the name */
};

static enum error_code
code_of(int cause)
{
    return cause == ENOSPC || cause == EDQUOT || cause == EFBIG
               ? ERROR_STORAGE_FULL
               : ERROR_IO;
}

bool
dir_is_name(const char *sha256)
{
    return strlen(sha256) == SHA256_HEX_SIZE - 1 &&
           strspn(sha256, "0123456789abcdef") == SHA256_HEX_SIZE - 1;
}

static void
file_name(const char *sha256, char name[NAME_SIZE])
{
    snprintf(name, NAME_SIZE, "%.2s/%s", sha256, sha256);
}

/* --- open, close --- */

static bool
make_folders(struct blobs_dir *dir, struct error *err)
{
    bool made = false;
    for (int i = 0; i < 256; i++) {
        char name[4];
        snprintf(name, sizeof name, "%02x", i);
        if (mkdirat(dir->root, name, 0700) == 0)
            made = true;
        else if (errno != EEXIST)
            return error_errno(err, code_of(errno), errno,
                               "cannot make the folder %s/%s", dir->path, name);
    }
    if (mkdirat(dir->root, "incoming", 0700) == 0)
        made = true;
    else if (errno != EEXIST)
        return error_errno(err, code_of(errno), errno,
                           "cannot make the folder %s/incoming", dir->path);
    if (made && fsync(dir->root) != 0)
        return error_errno(err, ERROR_IO, errno, "cannot sync %s", dir->path);
    return true;
}

/* What a crash has left half written was never acknowledged. */
static bool
empty_incoming(struct blobs_dir *dir, struct error *err)
{
    int fd = openat(dir->root, "incoming", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *folder = fd >= 0 ? fdopendir(fd) : NULL;
    if (folder == NULL) {
        int cause = errno;
        if (fd >= 0)
            close(fd);
        return error_errno(err, ERROR_IO, cause, "cannot read %s/incoming",
                           dir->path);
    }
    struct dirent *entry;
    unsigned count = 0;
    while ((entry = readdir(folder)) != NULL) {
        if (entry->d_name[0] != '.' && unlinkat(fd, entry->d_name, 0) == 0)
            count++;
    }
    closedir(folder);
    if (count > 0)
        log_write(LOG_INFO, "blobs", "%u unfinished files removed", count);
    return true;
}

/* DIR itself, and its name in its own folder. */
static bool
make_root(struct blobs_dir *dir, const char *path, struct error *err)
{
    bool made = mkdir(path, 0700) == 0;
    if (!made && errno != EEXIST)
        return error_errno(err, code_of(errno), errno,
                           "cannot make the folder %s", path);
    dir->root = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (dir->root < 0)
        return error_errno(err, ERROR_IO, errno, "cannot open the folder %s",
                           path);
    if (!made)
        return true;
    int parent = openat(dir->root, "..", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    bool ok = parent >= 0 && fsync(parent) == 0;
    int cause = errno;
    if (parent >= 0)
        close(parent);
    return ok || error_errno(err, ERROR_IO, cause,
                             "cannot sync the folder of %s", path);
}

bool
dir_open(struct blobs_dir *dir, const char *path, struct error *err)
{
    *dir = (struct blobs_dir){.root = -1, .incoming = -1};
    snprintf(dir->path, sizeof dir->path, "%s", path);
    if (!make_root(dir, path, err) || !make_folders(dir, err) ||
        !empty_incoming(dir, err))
        goto fail;
    dir->incoming =
        openat(dir->root, "incoming", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (dir->incoming >= 0)
        return true;
    error_errno(err, ERROR_IO, errno, "cannot open %s/incoming", path);
fail:
    dir_close(dir);
    return false;
}

void
dir_close(struct blobs_dir *dir)
{
    if (dir->incoming >= 0)
        close(dir->incoming);
    if (dir->root >= 0)
        close(dir->root);
    dir->incoming = dir->root = -1;
}

/* --- put --- */

static bool
write_all(int fd, const char *data, size_t len)
{
    while (len > 0) {
        ssize_t n = write(fd, data, len);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return false;
        data += n;
        len -= (size_t)n;
    }
    return true;
}

/* Read, not map: a file that shrinks gives an error and no signal. */
static bool
copy_hashed(int from, uint64_t len, int to, char sha256[SHA256_HEX_SIZE],
            struct error *err)
{
    struct sha256 hash;
    uint64_t at = 0;
    bool ok = false;
    char *chunk = malloc(CHUNK);
    if (chunk == NULL)
        return error_set(err, ERROR_MEMORY, "no memory to copy a blob");
    sha256_init(&hash);
    while (at < len) {
        size_t want = len - at < CHUNK ? (size_t)(len - at) : CHUNK;
        ssize_t n = pread(from, chunk, want, (off_t)at);
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0) {
            error_errno(err, ERROR_IO, errno, "cannot read a new blob");
            goto out;
        }
        if (n == 0) {
            error_set(err, ERROR_IO,
                      "a new blob has %llu bytes, %llu were announced",
                      (unsigned long long)at, (unsigned long long)len);
            goto out;
        }
        sha256_add(&hash, chunk, (size_t)n);
        if (!write_all(to, chunk, (size_t)n)) {
            error_errno(err, code_of(errno), errno, "cannot write a blob");
            goto out;
        }
        at += (uint64_t)n;
    }
    sha256_hex(&hash, sha256);
    ok = true;
out:
    free(chunk);
    return ok;
}

/* The folder of a blob, so that its name survives. */
static bool
sync_folder(struct blobs_dir *dir, const char *sha256, struct error *err)
{
    char name[4];
    snprintf(name, sizeof name, "%.2s", sha256);
    int fd = openat(dir->root, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    bool ok = fd >= 0 && fsync(fd) == 0;
    int cause = errno;
    if (fd >= 0)
        close(fd);
    return ok || error_errno(err, code_of(cause), cause,
                             "cannot sync the folder %s/%s", dir->path, name);
}

static bool
is_whole(struct blobs_dir *dir, const char *sha256)
{
    struct blob_stamp stamp;
    int fd = dir_get(dir, sha256, &stamp, NULL);
    bool whole = fd >= 0 && dir_verify(fd, sha256, NULL);
    if (fd >= 0)
        close(fd);
    return whole;
}

static bool
publish(struct blobs_dir *dir, int fd, const char *temporary,
        const char *sha256, struct error *err)
{
    char name[NAME_SIZE];
    file_name(sha256, name);
    if (fsync(fd) != 0)
        return error_errno(err, code_of(errno), errno, "cannot sync a blob");
    if (renameat(dir->incoming, temporary, dir->root, name) != 0)
        return error_errno(err, code_of(errno), errno,
                           "cannot name the blob %s", name);
    if (sync_folder(dir, sha256, err))
        return true;
    /* Nobody may find it and take it for durable. */
    unlinkat(dir->root, name, 0);
    return false;
}

bool
dir_put(struct blobs_dir *dir, int fd, uint64_t len,
        char sha256[SHA256_HEX_SIZE], struct error *err)
{
    char temporary[32];
    snprintf(temporary, sizeof temporary, "%llu",
             (unsigned long long)dir->next++);
    int to = openat(dir->incoming, temporary,
                    O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    if (to < 0)
        return error_errno(err, code_of(errno), errno,
                           "cannot make a file in %s/incoming", dir->path);
    bool named = false, ok = copy_hashed(fd, len, to, sha256, err);
    if (ok && is_whole(dir, sha256)) {
        /* Its name may be there only in memory, after a crash. */
        ok = sync_folder(dir, sha256, err);
    } else if (ok) {
        ok = publish(dir, to, temporary, sha256, err);
        named = ok;
    }
    if (!named)
        unlinkat(dir->incoming, temporary, 0);
    close(to);
    return ok;
}

/* --- get, delete --- */

int
dir_get(struct blobs_dir *dir, const char *sha256, struct blob_stamp *stamp,
        struct error *err)
{
    char name[NAME_SIZE];
    struct stat st;
    if (!dir_is_name(sha256)) {
        error_set(err, ERROR_NOT_FOUND, "that is no name of a blob");
        return -1;
    }
    file_name(sha256, name);
    int fd = openat(dir->root, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (fd < 0) {
        error_errno(err, errno == ENOENT ? ERROR_NOT_FOUND : ERROR_IO, errno,
                    "cannot open the blob %s", sha256);
        return -1;
    }
    if (fstat(fd, &st) != 0) {
        error_errno(err, ERROR_IO, errno, "cannot look at the blob %s", sha256);
        close(fd);
        return -1;
    }
    *stamp = (struct blob_stamp){
        .inode = st.st_ino,
        .len = (uint64_t)st.st_size,
        .mtime_ns = st.st_mtim.tv_sec * 1000000000LL + st.st_mtim.tv_nsec,
    };
    return fd;
}

bool
dir_verify(int fd, const char *sha256, struct error *err)
{
    struct sha256 hash;
    char found[SHA256_HEX_SIZE];
    off_t at = 0;
    char *chunk = malloc(CHUNK);
    if (chunk == NULL)
        return error_set(err, ERROR_MEMORY, "no memory to read a blob");
    sha256_init(&hash);
    ssize_t n;
    while ((n = pread(fd, chunk, CHUNK, at)) != 0) {
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            break;
        sha256_add(&hash, chunk, (size_t)n);
        at += n;
    }
    int cause = errno;
    free(chunk);
    if (n < 0)
        return error_errno(err, ERROR_IO, cause, "cannot read the blob %s",
                           sha256);
    sha256_hex(&hash, found);
    return strcmp(found, sha256) == 0 ||
           error_set(err, ERROR_IO,
                     "the blob %s is damaged: its bytes have the hash %s",
                     sha256, found);
}

void
dir_delete(struct blobs_dir *dir, const char *sha256)
{
    char name[NAME_SIZE];
    if (!dir_is_name(sha256))
        return;
    file_name(sha256, name);
    unlinkat(dir->root, name, 0);
}

bool
dir_space(struct blobs_dir *dir, uint64_t *free_bytes, uint64_t *total_bytes,
          struct error *err)
{
    struct statvfs fs;
    if (fstatvfs(dir->root, &fs) != 0)
        return error_errno(err, ERROR_IO, errno,
                           "cannot tell the free space of %s", dir->path);
    *free_bytes = (uint64_t)fs.f_bavail * fs.f_frsize;
    *total_bytes = (uint64_t)fs.f_blocks * fs.f_frsize;
    return true;
}
