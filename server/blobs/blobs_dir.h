/* blobs_dir.h - blobs in a folder: DIR/ab/abcdef..., DIR/incoming/ for files
 * on their way.
 *
 * No threads, no memory of its own but the open folders; dir_put and
 * dir_delete are for one thread, the others for any. */
#ifndef SERVER_BLOBS_BLOBS_DIR_H
#define SERVER_BLOBS_BLOBS_DIR_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/error.h"
#include "core/base/sha256.h"

struct blobs_dir {
    int root;       /* DIR */
    int incoming;   /* DIR/incoming */
    uint64_t next;  /* of names in incoming */
    char path[256]; /* for messages */
};

/* Which bytes a descriptor had when their hash was last checked. */
struct blob_stamp {
    uint64_t inode;
    uint64_t len;
    int64_t mtime_ns;
};

/* Makes DIR, its 256 folders and incoming where they are missing, durably;
 * empties incoming. */
bool
dir_open(struct blobs_dir *dir, const char *path, struct error *err);
void
dir_close(struct blobs_dir *dir);

/* `len` bytes of `fd` from offset 0: copied and hashed, fsync, renamed, folder
 * fsync. A whole blob of that name is kept as it is; a damaged one is
 * replaced. ERROR_STORAGE_FULL, ERROR_IO. */
bool
dir_put(struct blobs_dir *dir, int fd, uint64_t len,
        char sha256[SHA256_HEX_SIZE], struct error *err);

/* 64 lower-case hexadecimal digits? Nothing else becomes a file name. */
bool
dir_is_name(const char *sha256);

/* A descriptor and its stamp, the hash not checked; -1: ERROR_NOT_FOUND,
 * ERROR_IO. */
int
dir_get(struct blobs_dir *dir, const char *sha256, struct blob_stamp *stamp,
        struct error *err);

/* Read it all and compare. */
bool
dir_verify(int fd, const char *sha256, struct error *err);

void
dir_delete(struct blobs_dir *dir, const char *sha256);

bool
dir_space(struct blobs_dir *dir, uint64_t *free_bytes, uint64_t *total_bytes,
          struct error *err);

#endif
