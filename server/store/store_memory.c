/* The same promises but durability; read it to know what a backend is. */
#include <stdlib.h>
#include <string.h>

#include "server/store/rows.h"

struct kept {
    struct row row;
    struct bytes scene;
    struct kept *next_same_slot;
};

/* Where an owner's last turn ends, per priority. */
struct turn {
    char owner[JOB_OWNER_SIZE];
    int64_t end[PRIORITY_LOW + 1];
};

enum { SLOT_COUNT = 4096 };

struct memory {
    struct rows rows;
    struct kept **kept; /* in order of submission */
    size_t count, capacity;
    struct kept *slots[SLOT_COUNT]; /* by id */
    int64_t next_seq;
    struct turn *turns;
    size_t turn_count;
    int64_t clocks[PRIORITY_LOW + 1];
};

static struct memory *
memory_of(struct rows *rows)
{
    return (struct memory *)rows;
}

static struct kept **
slot_of(struct memory *memory, const char *id)
{
    uint32_t hash = 2166136261u; /* FNV-1a */
    for (const char *c = id; *c != '\0'; c++)
        hash = (hash ^ (unsigned char)*c) * 16777619u;
    struct kept **link = &memory->slots[hash % SLOT_COUNT];
    while (*link != NULL && strcmp((*link)->row.job.id, id) != 0)
        link = &(*link)->next_same_slot;
    return link;
}

static struct kept *
look_up(struct rows *rows, const char *id, struct error *err)
{
    struct kept *kept = *slot_of(memory_of(rows), id);
    if (kept == NULL)
        error_set(err, ERROR_NOT_FOUND, "there is no job %s", id);
    return kept;
}

static void
free_kept(struct kept *kept)
{
    if (kept == NULL)
        return;
    bytes_clear(&kept->scene);
    free(kept);
}

static void
memory_close(struct rows *rows)
{
    struct memory *memory = memory_of(rows);
    for (size_t i = 0; i < memory->count; i++)
        free_kept(memory->kept[i]);
    free(memory->kept);
    free(memory->turns);
    free(memory);
}

static bool
memory_begin(struct rows *rows, struct error *err)
{
    (void)rows;
    (void)err;
    return true;
}

static bool
reserve(struct memory *memory)
{
    if (memory->count < memory->capacity)
        return true;
    size_t capacity = memory->capacity == 0 ? 64 : memory->capacity * 2;
    struct kept **kept =
        realloc(memory->kept, capacity * sizeof(struct kept *));
    if (kept == NULL)
        return false;
    memory->kept = kept;
    memory->capacity = capacity;
    return true;
}

/* The owner's turns, made if they are not there; NULL: no memory. */
static struct turn *
turn_of(struct memory *memory, const char *owner)
{
    for (size_t i = 0; i < memory->turn_count; i++) {
        if (strcmp(memory->turns[i].owner, owner) == 0)
            return &memory->turns[i];
    }
    struct turn *turns =
        realloc(memory->turns, (memory->turn_count + 1) * sizeof *turns);
    if (turns == NULL)
        return NULL;
    memory->turns = turns;
    struct turn *turn = &turns[memory->turn_count++];
    *turn = (struct turn){0};
    strncpy(turn->owner, owner, sizeof turn->owner - 1);
    return turn;
}

static bool
memory_insert(struct rows *rows, struct row *row, const char *scene,
              size_t scene_len, struct error *err)
{
    struct memory *memory = memory_of(rows);
    struct kept **link = slot_of(memory, row->job.id);
    if (*link != NULL)
        return error_set(err, ERROR_CONFLICT, "there is a job %s already",
                         row->job.id);
    struct kept *kept = calloc(1, sizeof *kept);
    if (kept != NULL)
        bytes_append(&kept->scene, scene, scene_len);
    if (kept == NULL || kept->scene.failed || !reserve(memory)) {
        free_kept(kept);
        return error_set(err, ERROR_MEMORY, "no memory for another job");
    }
    row->seq = ++memory->next_seq;
    kept->row = *row;
    *link = kept;
    memory->kept[memory->count++] = kept;
    return true;
}

static bool
memory_update(struct rows *rows, const struct row *row, struct error *err)
{
    struct kept *kept = look_up(rows, row->job.id, err);
    if (kept == NULL)
        return false;
    kept->row = *row;
    return true;
}

static bool
memory_remove(struct rows *rows, const struct row *row, struct error *err)
{
    struct memory *memory = memory_of(rows);
    struct kept *kept = look_up(rows, row->job.id, err);
    if (kept == NULL)
        return false;
    *slot_of(memory, row->job.id) = kept->next_same_slot;
    size_t i = 0;
    while (memory->kept[i] != kept)
        i++;
    memory->count--;
    memmove(&memory->kept[i], &memory->kept[i + 1],
            (memory->count - i) * sizeof(struct kept *));
    free_kept(kept);
    return true;
}

/* Does a stand before b in the order of leases? */
static bool
is_before(const struct row *a, const struct row *b)
{
    if (a->job.priority != b->job.priority)
        return a->job.priority < b->job.priority;
    if (a->rank != b->rank)
        return a->rank < b->rank;
    return a->seq < b->seq;
}

static bool
memory_first(struct rows *rows, double max_seconds, struct row *row,
             struct error *err)
{
    struct memory *memory = memory_of(rows);
    const struct row *best = NULL;
    for (size_t i = 0; i < memory->count; i++) {
        const struct row *r = &memory->kept[i]->row;
        bool fits = max_seconds <= 0 || r->job.priority == PRIORITY_DRAFT ||
                    r->job.estimate_seconds < max_seconds;
        if (r->job.state == JOB_QUEUED && fits &&
            (best == NULL || is_before(r, best)))
            best = r;
    }
    if (best == NULL)
        return error_set(err, ERROR_NOT_FOUND, "no job fits");
    *row = *best;
    return true;
}

static bool
memory_turn(struct rows *rows, const char *owner, enum job_priority priority,
            int64_t *clock, int64_t *owner_end, struct error *err)
{
    struct turn *turn = turn_of(memory_of(rows), owner);
    if (turn == NULL)
        return error_set(err, ERROR_MEMORY, "no memory for another owner");
    *clock = memory_of(rows)->clocks[priority];
    *owner_end = turn->end[priority];
    return true;
}

static bool
memory_set_turn(struct rows *rows, const char *owner,
                enum job_priority priority, int64_t owner_end,
                struct error *err)
{
    struct turn *turn = turn_of(memory_of(rows), owner);
    if (turn == NULL)
        return error_set(err, ERROR_MEMORY, "no memory for another owner");
    turn->end[priority] = owner_end;
    return true;
}

static bool
memory_set_clock(struct rows *rows, enum job_priority priority, int64_t clock,
                 struct error *err)
{
    int64_t *now = &memory_of(rows)->clocks[priority];
    (void)err;
    if (clock > *now)
        *now = clock;
    return true;
}

static bool
memory_get(struct rows *rows, const char *id, struct row *row,
           struct error *err)
{
    const struct kept *kept = look_up(rows, id, err);
    if (kept == NULL)
        return false;
    *row = kept->row;
    return true;
}

static bool
memory_scene(struct rows *rows, const char *id, struct bytes *scene,
             struct error *err)
{
    const struct kept *kept = look_up(rows, id, err);
    if (kept == NULL)
        return false;
    bytes_append(scene, kept->scene.data, kept->scene.len);
    return !scene->failed ||
           error_set(err, ERROR_MEMORY, "no memory for a scene");
}

static bool
memory_find(struct rows *rows, const char *render_key, const char *owner,
            struct row *row, struct error *err)
{
    struct memory *memory = memory_of(rows);
    for (size_t i = memory->count; i-- > 0;) {
        const struct row *r = &memory->kept[i]->row;
        if (r->job.state == JOB_SUCCEEDED && !r->job.no_cache &&
            strcmp(r->job.render_key, render_key) == 0 &&
            (owner == NULL || strcmp(r->job.owner, owner) == 0)) {
            *row = *r;
            return true;
        }
    }
    return error_set(err, ERROR_NOT_FOUND, "no job has rendered that yet");
}

/* Is `tag` one of the comma-separated `tags`? */
static bool
has_tag(const char *tags, const char *tag)
{
    size_t len = strlen(tag);
    for (const char *t = strstr(tags, tag); t != NULL; t = strstr(t + 1, tag)) {
        bool begins = t == tags || t[-1] == ',';
        if (begins && (t[len] == ',' || t[len] == '\0'))
            return true;
    }
    return false;
}

static bool
passes(const struct store_filter *filter, const struct job *job)
{
    return (filter->owner == NULL || strcmp(job->owner, filter->owner) == 0) &&
           (filter->tag == NULL || filter->tag[0] == '\0' ||
            has_tag(job->tags, filter->tag)) &&
           (filter->before == NULL || strcmp(job->id, filter->before) < 0) &&
           job->created_ms >= filter->since_ms &&
           (filter->states == 0 || (filter->states >> job->state & 1u) != 0);
}

/* Newest first, by id. */
static int
by_id(const void *a, const void *b)
{
    const struct kept *const *x = a, *const *y = b;
    return strcmp((*y)->row.job.id, (*x)->row.job.id);
}

static int
memory_list(struct rows *rows, const struct store_filter *filter,
            struct job *jobs, struct error *err)
{
    struct memory *memory = memory_of(rows);
    struct kept **sorted = malloc((memory->count + 1) * sizeof(struct kept *));
    size_t found = 0;
    if (sorted == NULL) {
        error_set(err, ERROR_MEMORY, "no memory for a list of jobs");
        return -1;
    }
    for (size_t i = 0; i < memory->count; i++) {
        if (passes(filter, &memory->kept[i]->row.job))
            sorted[found++] = memory->kept[i];
    }
    qsort(sorted, found, sizeof(struct kept *), by_id);
    if (found > filter->limit)
        found = filter->limit;
    for (size_t i = 0; i < found; i++)
        jobs[i] = sorted[i]->row.job;
    free(sorted);
    return (int)found;
}

static bool
memory_count(struct rows *rows, uint64_t jobs[JOB_STATE_COUNT],
             struct error *err)
{
    struct memory *memory = memory_of(rows);
    (void)err;
    memset(jobs, 0, JOB_STATE_COUNT * sizeof *jobs);
    for (size_t i = 0; i < memory->count; i++)
        jobs[memory->kept[i]->row.job.state]++;
    return true;
}

static bool
memory_position(struct rows *rows, const struct row *row, uint64_t *position,
                struct error *err)
{
    struct memory *memory = memory_of(rows);
    (void)err;
    *position = 0;
    for (size_t i = 0; i < memory->count; i++) {
        const struct row *r = &memory->kept[i]->row;
        *position += r->job.state == JOB_QUEUED && is_before(r, row);
    }
    return true;
}

static bool
memory_blob_users(struct rows *rows, const char *sha256, uint64_t *users,
                  struct error *err)
{
    struct memory *memory = memory_of(rows);
    (void)err;
    *users = 0;
    for (size_t i = 0; i < memory->count; i++) {
        const struct job *job = &memory->kept[i]->row.job;
        *users += job->result[0] != '\0' && strcmp(job->result, sha256) == 0;
    }
    return true;
}

static const struct rows_ops memory_ops = {
    .close = memory_close,
    .begin = memory_begin,
    .commit = memory_begin,
    .insert = memory_insert,
    .update = memory_update,
    .remove = memory_remove,
    .first = memory_first,
    .turn = memory_turn,
    .set_turn = memory_set_turn,
    .set_clock = memory_set_clock,
    .get = memory_get,
    .scene = memory_scene,
    .find = memory_find,
    .list = memory_list,
    .count = memory_count,
    .position = memory_position,
    .blob_users = memory_blob_users,
};

struct store *
store_open_memory(const struct store_options *options, struct error *err)
{
    struct memory *memory = calloc(1, sizeof *memory);
    if (memory == NULL) {
        error_set(err, ERROR_MEMORY, "no memory for the store");
        return NULL;
    }
    memory->rows.ops = &memory_ops;
    return store_start(&memory->rows, &memory->rows, "memory", options, err);
}
