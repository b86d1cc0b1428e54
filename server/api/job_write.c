#include <string.h>

#include "core/base/clock.h"
#include "core/base/isa.h"
#include "server/api/job_json.h"
#include "server/api/problem.h"

static void
write_time(struct json_writer *w, const char *key, int64_t wall_ms)
{
    char text[CLOCK_RFC3339_SIZE];

    if (wall_ms > 0) {
        clock_rfc3339(wall_ms, text);
        json_put_string(w, key, text);
    } else {
        json_put_null(w, key);
    }
}

/* Samples per pixel, from the effective settings; 0 if they do not say. */
static double
samples_total(const struct job *job, struct arena *arena)
{
    struct error_list errors = {.arena = arena};
    const struct json *settings =
        json_read(job->settings, strlen(job->settings), NULL, arena, &errors);
    const struct json *sampler =
        settings ? json_member(settings, "sampler") : NULL;
    const struct json *spp = sampler ? json_member(sampler, "spp") : NULL;

    return spp && spp->type == JSON_NUMBER ? spp->number : 0;
}

/* What the clock and the counters say about a job under way. */
static void
write_progress(struct json_writer *w, const struct job *job,
               const struct job_around *around)
{
    double total = samples_total(job, around->arena);
    double running_s = 0;

    if (job->state == JOB_RUNNING && job->started_ms > 0)
        running_s = (double)(around->now_ms - job->started_ms) / 1000;
    else if (job->state == JOB_SUCCEEDED)
        running_s = job->stats.trace_ms / 1000;
    json_put_number(w, "progress", job->progress);
    json_put_integer(w, "samples_done", (int64_t)(job->progress * total));
    json_put_integer(w, "samples_total", (int64_t)total);
    if (running_s > 0 && job->rays_done > 0)
        json_put_integer(w, "rays_per_second",
                         (int64_t)((double)job->rays_done / running_s));
    else
        json_put_null(w, "rays_per_second");
    if (job->state == JOB_RUNNING && job->progress > 0 && running_s > 0)
        json_put_number(w, "eta_seconds",
                        (double)(int64_t)(running_s * 10 * (1 - job->progress) /
                                          job->progress) /
                            10);
    else if (job->state == JOB_RUNNING)
        json_put_number(w, "eta_seconds", job->estimate_seconds);
    else
        json_put_null(w, "eta_seconds");
    if (job->state == JOB_QUEUED && around->position >= 0)
        json_put_integer(w, "queue_position", around->position);
    else if (job->state == JOB_RUNNING)
        json_put_integer(w, "queue_position", 0);
    else
        json_put_null(w, "queue_position");
}

static void
write_tags(struct json_writer *w, const char *tags)
{
    json_begin_array(w, "tags");
    while (*tags) {
        size_t len = strcspn(tags, ",");

        json_put_stringn(w, NULL, tags, len);
        tags += len + (tags[len] == ',');
    }
    json_end_array(w);
}

static void
write_stats(struct json_writer *w, const struct job *job)
{
    const struct job_stats *stats = &job->stats;

    if (job->state != JOB_SUCCEEDED) {
        json_put_null(w, "stats");
        return;
    }
    json_begin_object(w, "stats");
    json_begin_object(w, "rays");
    json_put_integer(w, "camera", (int64_t)stats->rays_camera);
    json_put_integer(w, "shadow", (int64_t)stats->rays_shadow);
    json_put_integer(w, "bounce", (int64_t)stats->rays_bounce);
    json_end_object(w);
    json_begin_object(w, "seconds");
    json_put_number(w, "queue", stats->queue_ms / 1000);
    json_put_number(w, "load", stats->load_ms / 1000);
    json_put_number(w, "build", stats->build_ms / 1000);
    json_put_number(w, "trace", stats->trace_ms / 1000);
    json_put_number(w, "encode", stats->encode_ms / 1000);
    json_end_object(w);
    json_put_integer(w, "memory_bytes", (int64_t)stats->peak_bytes);
    json_put_integer(w, "result_bytes", (int64_t)job->result_len);
    json_put_string(w, "media_type", job->media_type);
    json_end_object(w);
}

void
job_json_write_error(struct json_writer *w, const char *key,
                     const struct job *job)
{
    if (job->state != JOB_FAILED) {
        json_put_null(w, key);
        return;
    }
    json_begin_object(w, key);
    json_put_string(w, "type", "/problems/render-failed");
    json_put_string(w, "title", problem_title(PROBLEM_RENDER_FAILED));
    json_put_string(w, "code", error_code_name(job->error_code));
    json_put_string(w, "detail", job->error_text);
    json_end_object(w);
}

/* "/v1/jobs/{id}" and what follows; null unless `there`. */
static void
write_link(struct json_writer *w, const char *name, bool there,
           const struct job *job, const char *rest)
{
    struct bytes link = {0};

    if (there)
        bytes_printf(&link, "/v1/jobs/%s%s", job->id, rest);
    json_put_string_or_null(w, name, link.data);
    bytes_clear(&link);
}

static void
write_links(struct json_writer *w, const struct job *job)
{
    json_begin_object(w, "links");
    write_link(w, "self", true, job, "");
    json_put_null(w, "events");
    json_put_null(w, "preview");
    write_link(w, "result", job->state == JOB_SUCCEEDED, job, "/result");
    write_link(w, "cancel", !job_is_over(job->state), job, "/cancel");
    json_put_null(w, "html");
    json_end_object(w);
}

void
job_json_write(struct json_writer *w, const char *key, const struct job *job,
               const struct job_around *around)
{
    json_begin_object(w, key);
    json_put_string(w, "id", job->id);
    json_put_string(w, "state", job_state_name(job->state));
    json_put_string_or_null(
        w, "phase",
        job->state == JOB_RUNNING ? job_phase_name(job->phase) : NULL);
    json_put_bool(w, "cancel_requested", job->cancel_requested);
    json_put_integer(w, "revision", job->revision);
    json_put_integer(w, "attempt", job->attempt);
    json_put_integer(w, "max_attempts", job->max_attempts);
    write_progress(w, job, around);
    write_time(w, "created_at", job->created_ms);
    write_time(w, "started_at", job->started_ms);
    write_time(w, "finished_at", job->finished_ms);
    json_put_null(w, "expires_at");
    json_put_string(w, "scene_hash", job->scene_hash);
    json_put_string(w, "core_version", glint_version);
    json_put_string(w, "isa", around->isa);
    json_put_bool(w, "cached", false);
    json_put_string(w, "priority", job_priority_name(job->priority));
    write_tags(w, job->tags);
    json_put_raw(w, "settings", job->settings[0] ? job->settings : "null",
                 strlen(job->settings[0] ? job->settings : "null"));
    json_begin_object(w, "estimate");
    json_put_number(w, "rays", job->estimate_rays);
    json_put_number(w, "seconds", job->estimate_seconds);
    json_put_number(w, "memory_bytes", job->estimate_bytes);
    json_end_object(w);
    write_stats(w, job);
    job_json_write_error(w, "error", job);
    write_links(w, job);
    json_end_object(w);
}
