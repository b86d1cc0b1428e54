/* lint_list.h - collecting likely mistakes. Private to core/scene. */
#ifndef CORE_SCENE_LINT_LIST_H
#define CORE_SCENE_LINT_LIST_H

#include "core/scene/scene_lint.h"

enum { LINT_MAX = 50 };

struct lint_list {
    struct arena *arena;
    const struct json *root;
    const struct scene *scene;
    const struct json **nodes; /* [object_count]: each object's document */
    struct lint_item *items;   /* [LINT_MAX] */
    size_t count;
};

void
lint_add(struct lint_list *list, const struct json *place, const char *code,
         const char *format, ...) __attribute__((format(printf, 4, 5)));

/* triangle.degenerate, mesh.duplicate_vertex, mesh.winding of one object; each
 * is told once per mesh, at the first place. */
void
lint_mesh(struct lint_list *list, const struct scene_object *object,
          const struct json *node);

#endif
