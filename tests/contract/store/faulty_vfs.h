/* faulty_vfs.h - SQLite's own files, with a finger in between.
 *
 * Installed as the default VFS it counts every write, truncate and sync of the
 * database and its log. It can make the n-th of them fail, or record all of
 * them so that a power loss at any point can be acted out: what was synced is
 * there, of the rest any part, whole or torn at a sector.
 *
 * It syncs nothing really: the process that dies leaves the page cache. */
#ifndef TESTS_CONTRACT_STORE_FAULTY_VFS_H
#define TESTS_CONTRACT_STORE_FAULTY_VFS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum fault {
    FAULT_NONE,
    FAULT_EIO,       /* that one call fails with an I/O error */
    FAULT_SHORT,     /* half of it is written, then an I/O error; EIO if it
                          is no write */
    FAULT_FULL_ONCE, /* no room, once */
    FAULT_FULL_FROM, /* no room from then on (syncs succeed) */
    FAULT_COUNT
};

void
faulty_install(void);
void
faulty_uninstall(void);

/* The n-th call from now, 1 for the next; 0: never. */
void
faulty_arm(enum fault fault, unsigned n);
/* Has the armed call been reached? */
bool
faulty_reached(void);

/* --- recording --- */

enum { RECORD_DB, RECORD_WAL, RECORD_FILES };

void
faulty_record(void); /* from now on, an empty record */
size_t
faulty_recorded(void); /* entries so far */
void
faulty_stop_record(void); /* and free it */

/* Make `path` and its log what a power loss after the first `n` entries may
 * leave, starting from the image `base` of the database; `random` picks among
 * the possible ones, 0: nothing that was not synced, 1: everything. */
bool
faulty_replay(const char *path, const void *base, size_t base_len, size_t n,
              uint64_t random);

#endif
