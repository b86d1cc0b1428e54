/* job_json.h - job document -> what it asks for; struct job -> reply.
 *
 * A submission is a job document or a bare scene: the top-level member `scene`
 * decides. Pure; any thread. */
#ifndef SERVER_API_JOB_JSON_H
#define SERVER_API_JOB_JSON_H

#include "core/base/json.h"
#include "core/base/json_write.h"
#include "core/scene/output.h"
#include "server/jobs/job.h"

struct job_document {
    bool is_job;              /* false: the root is the scene */
    const struct json *scene; /* to be read by scene_read; NULL: not to be
                                 found, errors say why */
    const char *example;      /* name of the built-in scene, or NULL */
    const char *prefix;       /* of pointers into the scene: "/scene" or "" */
    bool has_output;
    struct output output;
    enum job_priority priority;
    uint32_t max_attempts;
    char tags[JOB_TAGS_SIZE];
};

/* Reads every member but the scene's own and collects all errors. False if any
 * was added. Strings live in errors->arena. */
bool
job_json_read(const struct json *root, struct job_document *document,
              struct error_list *errors);

/* What a job object says beyond the job. */
struct job_around {
    const char *isa;
    int64_t position; /* jobs before this queued one; < 0: unknown */
    int64_t now_ms;   /* wall clock */
    struct arena *arena;
};

/* The job object of API section 5, compact (job_write.c). */
void
job_json_write(struct json_writer *w, const char *key, const struct job *job,
               const struct job_around *around);

/* {"type", "title", "code", "detail"} of a failed job, else null. */
void
job_json_write_error(struct json_writer *w, const char *key,
                     const struct job *job);

#endif
