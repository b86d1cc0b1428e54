/* blobs.h - bytes by SHA-256: results (and, later, assets).
 *
 * A blob is whole or absent: temporary file, fsync, rename, fsync of the
 * folder; its name is the hash of its bytes. One writer thread does all that,
 * so no fsync runs on the HTTP or the pool loop. Any thread may call. */
#ifndef SERVER_BLOBS_BLOBS_H
#define SERVER_BLOBS_BLOBS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/error.h"
#include "core/base/sha256.h"

enum {
    BLOBS_PENDING_MAX = 1024 /* puts and deletes waiting; one more put is
                                ERROR_QUEUE_FULL at the call */
};

struct blobs;

/* On the writer thread, when the blob is durable or has failed; then `sha256`
 * is "" and the code ERROR_STORAGE_FULL, ERROR_IO or ERROR_MEMORY. */
typedef void (*blobs_done_fn)(void *user, const char sha256[SHA256_HEX_SIZE],
                              uint64_t len, const struct error *err);

/* DIR/ab/abcdef...; made if it is not there. Left-over temporary files (in
 * DIR/incoming) are removed, so one process at a time: open the store, which
 * has the lock, first. */
struct blobs *
blobs_open_dir(const char *path, struct error *err);
void
blobs_close(struct blobs *blobs); /* after what is pending */

/* Keep the bytes of a sealed memory file (or any file), from offset 0, `len`
 * bytes; takes `fd` over, also on failure. A blob that is there already is not
 * written again; one that is there but damaged is replaced. */
bool
blobs_put(struct blobs *blobs, int fd, uint64_t len, blobs_done_fn done,
          void *user, struct error *err);

/* A descriptor to read it, and its length. The hash was checked: on the first
 * opening since start, or when size or mtime changed. ERROR_NOT_FOUND;
 * ERROR_IO also when the bytes do not match their name. */
int
blobs_get(struct blobs *blobs, const char *sha256, uint64_t *len,
          struct error *err);

/* Forget one that nobody refers to any more. Queued behind earlier puts. */
void
blobs_delete(struct blobs *blobs, const char *sha256);

/* Free bytes on its file system, and its size. */
bool
blobs_space(struct blobs *blobs, uint64_t *free_bytes, uint64_t *total_bytes,
            struct error *err);

#endif
