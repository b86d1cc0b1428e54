/* scene_verdicts - the scene reader's verdicts (verdicts.h). */
#include "core/scene/scene_json.h"
#include "tests/api/verdicts.h"

static void
read_scene(const char *text, size_t len, struct arena *arena,
           struct error_list *errors)
{
    struct scene scene;
    scene_read_text(text, len, NULL, arena, &scene, errors);
}

int
main(void)
{
    return verdicts_main(read_scene);
}
