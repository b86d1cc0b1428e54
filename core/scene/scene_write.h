/* scene_write.h - the writers that rows of kinds.h name. Private to the room;
 * scene_write_canonical itself is in scene_json.h. */
#ifndef CORE_SCENE_SCENE_WRITE_H
#define CORE_SCENE_SCENE_WRITE_H

#include <stdbool.h>

#include "core/base/json.h"
#include "core/base/json_write.h"

struct writer {
    struct json_writer json;
    const struct json *root; /* the scene */
    bool inherits;           /* a group around has a material */
};

/* `value` is NULL where the member is absent from `object`: its default is
 * written, if it has one. */
void
write_assets(struct writer *w, const char *key, const struct json *object,
             const struct json *value);
void
write_lights(struct writer *w, const char *key, const struct json *object,
             const struct json *value);
void
write_objects(struct writer *w, const char *key, const struct json *object,
              const struct json *value);
void
write_material(struct writer *w, const char *key, const struct json *object,
               const struct json *value);
void
write_transform(struct writer *w, const char *key, const struct json *object,
                const struct json *value);
/* Numbers, and arrays of them, as they are. */
void
write_numbers(struct writer *w, const char *key, const struct json *object,
              const struct json *value);

#endif
