#include "server/store/apply.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/must.h"
#include "server/jobs/rank.h"

void
write_free(struct write *write)
{
    if (write == NULL)
        return;
    bytes_clear(&write->scene);
    lease_free(write->lease);
    free(write);
}

/* --- the latest version of each job that this batch has touched --- */

static uint16_t *
slot_of(struct batch *batch, const char *id)
{
    uint32_t hash = 2166136261u; /* FNV-1a */
    for (const char *c = id; *c != '\0'; c++)
        hash = (hash ^ (unsigned char)*c) * 16777619u;
    for (uint32_t i = hash;; i++) {
        uint16_t *slot = &batch->slots[i % BATCH_SLOTS];
        if (*slot == 0 || strcmp(batch->writes[*slot - 1]->row.job.id, id) == 0)
            return slot;
    }
}

/* The job as the batch sees it: its own change, else the row under the board.
 * False with ERROR_NOT_FOUND also for one that the batch has deleted. */
static bool
fetch(struct batch *batch, const char *id, struct row *row, struct error *err)
{
    uint16_t slot = *slot_of(batch, id);
    if (slot != 0) {
        const struct write *write = batch->writes[slot - 1];
        if (write->deleted)
            return error_set(err, ERROR_NOT_FOUND, "there is no job %s", id);
        *row = write->row;
        return true;
    }
    if (!batch->rows->ops->get(batch->rows, id, row, err))
        return false;
    struct board_entry entry;
    if (board_find(batch->board, id, &entry))
        board_lay(&entry, &row->job);
    return true;
}

/* write->row is the job as it is now. */
static void
note_change(struct batch *batch, struct write *write)
{
    uint16_t *slot = slot_of(batch, write->row.job.id);
    if (*slot != 0)
        batch->writes[*slot - 1]->latest = false;
    *slot = (uint16_t)(write->index + 1);
    write->changed = true;
    write->latest = true;
}

/* --- the one way to change a row --- */

static bool
change(struct batch *batch, struct write *write, enum job_state to,
       struct error *err)
{
    struct row *row = &write->row;
    enum job_state from = row->job.state;
    if (to != from) {
        MUST(job_may(from, to));
        batch->counted[from]--;
        batch->counted[to]++;
        row->job.state = to;
    }
    row->job.revision++;
    if (!batch->rows->ops->update(batch->rows, row, err))
        return false;
    row->revision_kept = row->job.revision;
    note_change(batch, write);
    return true;
}

static void
end_job(struct job *job, int64_t now_ms)
{
    job->finished_ms = now_ms;
    job->phase = JOB_PHASE_NONE;
    job->cancel_requested = false;
}

static void
queue_again(struct job *job)
{
    job->phase = JOB_PHASE_NONE;
    job->progress = 0;
    job->rays_done = 0;
    job->started_ms = 0;
}

/* The job of this write if the write's lease is the live one. */
static bool
fetch_leased(struct batch *batch, struct write *write, struct error *err)
{
    struct job *job = &write->row.job;
    if (!fetch(batch, write->id, &write->row, err))
        return false;
    if (job->state != JOB_RUNNING)
        return error_set(err, ERROR_CONFLICT, "%s is %s, not running",
                         write->id, job_state_name(job->state));
    if (job->epoch != write->epoch)
        return error_set(err, ERROR_CONFLICT,
                         "%s is under lease %u, the one named is %u", write->id,
                         job->epoch, write->epoch);
    return true;
}

/* --- one function per kind of write --- */

static bool
apply_submit(struct batch *batch, struct write *write, struct error *err)
{
    struct row *row = &write->row;
    struct job *job = &row->job;
    int64_t clock = 0, owner_end = 0;
    if (!batch->rows->ops->turn(batch->rows, job->owner, job->priority, &clock,
                                &owner_end, err))
        return false;
    struct rank_turn turn = rank_next(clock, owner_end, job->estimate_seconds);
    row->rank = turn.start;
    row->is_short = rank_is_short(job);
    row->revision_kept = 1;
    job->created_ms = batch->now_ms;
    job->state = JOB_QUEUED;
    job->phase = JOB_PHASE_NONE;
    job->cancel_requested = false;
    job->revision = 1;
    job->epoch = job->attempt = 0;
    job->progress = 0;
    job->rays_done = 0;
    job->started_ms = job->finished_ms = 0;
    job->result[0] = '\0';
    job->result_len = 0;
    job->stats = (struct job_stats){0};
    job->error_code = ERROR_NONE;
    job->error_text[0] = '\0';
    if (job->max_attempts == 0)
        job->max_attempts = JOB_ATTEMPTS_DEFAULT;
    if (job->max_attempts > JOB_ATTEMPTS_LIMIT)
        job->max_attempts = JOB_ATTEMPTS_LIMIT;
    /* The turn follows the row: a refused insert takes no turn. */
    if (!batch->rows->ops->insert(batch->rows, row, write->scene.data,
                                  write->scene.len, err) ||
        !batch->rows->ops->set_turn(batch->rows, job->owner, job->priority,
                                    turn.end, err))
        return false;
    batch->counted[JOB_QUEUED]++;
    note_change(batch, write);
    return true;
}

static bool
apply_lease(struct batch *batch, struct write *write, struct error *err)
{
    struct row *row = &write->row;
    struct job *job = &row->job;
    struct error none = {0};
    if (!batch->rows->ops->first(batch->rows, write->max_seconds, row, &none)) {
        if (none.code == ERROR_NOT_FOUND)
            return true; /* no job fits: a lease of nothing */
        return error_set(err, none.code, "%s", none.text);
    }
    struct lease *lease = calloc(1, sizeof *lease);
    if (lease == NULL)
        return error_set(err, ERROR_MEMORY, "no memory for a lease");
    write->lease = lease;
    if (!batch->rows->ops->scene(batch->rows, job->id, &lease->scene, err) ||
        !batch->rows->ops->set_clock(batch->rows, job->priority, row->rank,
                                     err))
        return false;
    job->epoch++;
    if (job->attempt == 0)
        job->attempt = 1;
    job->started_ms = batch->now_ms;
    job->phase = JOB_LOADING;
    job->progress = 0;
    job->rays_done = 0;
    if (!change(batch, write, JOB_RUNNING, err))
        return false;
    lease->job = *job;
    return true;
}

static bool
apply_heartbeat(struct batch *batch, struct write *write, struct error *err)
{
    if (!fetch_leased(batch, write, err))
        return false;
    struct job *job = &write->row.job;
    job->phase = write->phase;
    if (write->progress > job->progress) /* never back, never NaN */
        job->progress = write->progress < 1 ? write->progress : 1;
    if (write->rays_done > job->rays_done)
        job->rays_done = write->rays_done;
    if (job->revision - write->row.revision_kept >= REVISION_LEAP - 1)
        return change(batch, write, JOB_RUNNING, err);
    job->revision++;
    note_change(batch, write);
    return true;
}

static bool
apply_finish(struct batch *batch, struct write *write, struct error *err)
{
    if (!fetch_leased(batch, write, err))
        return false;
    struct job *job = &write->row.job;
    end_job(job, batch->now_ms);
    job->progress = 1;
    memcpy(job->result, write->result, sizeof job->result);
    job->result_len = write->result_len;
    job->stats = write->stats;
    return change(batch, write, JOB_SUCCEEDED, err);
}

static bool
apply_fail(struct batch *batch, struct write *write, struct error *err)
{
    if (!fetch_leased(batch, write, err))
        return false;
    struct job *job = &write->row.job;
    if (write->failure == FAILURE_CANCELED || job->cancel_requested) {
        end_job(job, batch->now_ms);
        return change(batch, write, JOB_CANCELED, err);
    }
    bool again =
        write->failure == FAILURE_RELEASE ||
        (write->failure == FAILURE_ATTEMPT && job->attempt < job->max_attempts);
    if (again) {
        if (write->failure == FAILURE_ATTEMPT)
            job->attempt++;
        queue_again(job);
        return change(batch, write, JOB_QUEUED, err);
    }
    end_job(job, batch->now_ms);
    job->error_code = write->cause.code;
    memcpy(job->error_text, write->cause.text, sizeof job->error_text);
    return change(batch, write, JOB_FAILED, err);
}

static bool
apply_cancel(struct batch *batch, struct write *write, struct error *err)
{
    if (!fetch(batch, write->id, &write->row, err))
        return false;
    struct job *job = &write->row.job;
    switch (job->state) {
    case JOB_QUEUED:
        end_job(job, batch->now_ms);
        return change(batch, write, JOB_CANCELED, err);
    case JOB_RUNNING:
        if (job->cancel_requested)
            return true;
        job->cancel_requested = true;
        return change(batch, write, JOB_RUNNING, err);
    case JOB_CANCELED: return true;
    default:
        return error_set(err, ERROR_CONFLICT, "%s has already %s", write->id,
                         job_state_name(job->state));
    }
}

static bool
apply_delete(struct batch *batch, struct write *write, struct error *err)
{
    if (!fetch(batch, write->id, &write->row, err))
        return false;
    struct job *job = &write->row.job;
    if (!job_is_over(job->state))
        return error_set(err, ERROR_CONFLICT, "%s is still %s", write->id,
                         job_state_name(job->state));
    if (!batch->rows->ops->remove(batch->rows, &write->row, err))
        return false;
    batch->counted[job->state]--;
    write->deleted = true;
    note_change(batch, write);
    return true;
}

static bool (*const apply[WRITE_KIND_COUNT])(struct batch *, struct write *,
                                             struct error *) = {
    [WRITE_SUBMIT] = apply_submit,       [WRITE_LEASE] = apply_lease,
    [WRITE_HEARTBEAT] = apply_heartbeat, [WRITE_FINISH] = apply_finish,
    [WRITE_FAIL] = apply_fail,           [WRITE_CANCEL] = apply_cancel,
    [WRITE_DELETE] = apply_delete,
};

static bool
is_refusal(const struct batch *batch, enum error_code code)
{
    return code == ERROR_CONFLICT || code == ERROR_NOT_FOUND ||
           (code == ERROR_MEMORY && batch->rows->ops->rollback == NULL);
}

bool
batch_apply(struct batch *batch, struct error *err)
{
    memset(batch->counted, 0, sizeof batch->counted);
    memset(batch->slots, 0, sizeof batch->slots);
    for (size_t i = 0; i < batch->count; i++) {
        struct write *write = batch->writes[i];
        write->index = i;
        write->err = (struct error){0};
        write->changed = write->deleted = write->latest = false;
        lease_free(write->lease);
        write->lease = NULL;
    }
    for (size_t i = 0; i < batch->count; i++) {
        struct write *write = batch->writes[i];
        if (apply[write->kind](batch, write, &write->err))
            continue;
        if (!is_refusal(batch, write->err.code))
            return error_set(err, write->err.code, "%s", write->err.text);
    }
    return true;
}
