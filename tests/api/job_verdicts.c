/* job_verdicts - the job reader's verdicts, its scene's included (verdicts.h).
 */
#include "core/scene/scene_json.h"
#include "server/api/job_json.h"
#include "tests/api/verdicts.h"

static void
read_job(const char *text, size_t len, struct arena *arena,
         struct error_list *errors)
{
    struct job_document job;
    struct scene scene;
    const struct json *root = json_read(text, len, NULL, arena, errors);
    if (root == NULL)
        return;
    job_json_read(root, &job, errors);
    if (job.scene != NULL)
        scene_read(job.scene, NULL, arena, &scene, errors);
    error_list_sort(errors);
}

int
main(void)
{
    return verdicts_main(read_job);
}
