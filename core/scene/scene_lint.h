/* scene_lint.h - likely mistakes that never block (SCENE section 8, lint codes):
 * those that need no rays. */
#ifndef CORE_SCENE_SCENE_LINT_H
#define CORE_SCENE_SCENE_LINT_H

#include <stdint.h>

#include "core/base/arena.h"
#include "core/base/json.h"
#include "core/scene/scene.h"

struct lint_item {
    const char *pointer;
    uint32_t line, column;
    const char *code; /* "mirror.no_bounces" */
    const char *detail;
};

/* Items in document order, in `arena`; returns their number, at most 50. `root`
 * is the document of which scene_read made `scene`. */
size_t
scene_lint(const struct json *root, const struct scene *scene,
           struct arena *arena, const struct lint_item **items);

#endif
