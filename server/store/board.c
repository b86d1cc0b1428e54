#include "server/store/board.h"

#include <stdlib.h>
#include <string.h>

void
board_clear(struct board *board)
{
    free(board->entries);
    *board = (struct board){0};
}

/* The entry's index, or board->count. There are about as many entries as
 * workers, so a walk is fine. */
static size_t
index_of(const struct board *board, const char *id)
{
    size_t i = 0;
    while (i < board->count && strcmp(board->entries[i].id, id) != 0)
        i++;
    return i;
}

void
board_note(struct board *board, const struct job *job)
{
    size_t i = index_of(board, job->id);
    if (i == board->capacity) {
        size_t capacity = board->capacity == 0 ? 16 : board->capacity * 2;
        struct board_entry *entries =
            realloc(board->entries, capacity * sizeof *entries);
        if (entries == NULL)
            return;
        board->entries = entries;
        board->capacity = capacity;
    }
    struct board_entry *entry = &board->entries[i];
    if (i == board->count)
        board->count++;
    memcpy(entry->id, job->id, sizeof entry->id);
    entry->epoch = job->epoch;
    entry->revision = job->revision;
    entry->phase = job->phase;
    entry->progress = job->progress;
    entry->rays_done = job->rays_done;
}

void
board_wipe(struct board *board, const char *id)
{
    size_t i = index_of(board, id);
    if (i < board->count)
        board->entries[i] = board->entries[--board->count];
}

bool
board_find(const struct board *board, const char *id, struct board_entry *entry)
{
    size_t i = index_of(board, id);
    if (i == board->count)
        return false;
    *entry = board->entries[i];
    return true;
}

void
board_lay(const struct board_entry *entry, struct job *job)
{
    if (job->state != JOB_RUNNING || job->epoch != entry->epoch ||
        job->revision >= entry->revision)
        return;
    job->revision = entry->revision;
    job->phase = entry->phase;
    job->progress = entry->progress;
    job->rays_done = entry->rays_done;
}
