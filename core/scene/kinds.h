/* kinds.h - the grammar of scene documents as tables: one row per kind (of
 * camera, shape, material ...), one row per field of it.
 *
 * Reader (scene_json.c), canonical writer (scene_write.c) and hints follow from
 * these rows; only relations between fields are code, in a kind's `check`. The
 * rows are in kinds_view.c, kinds_surface.c and kinds_object.c. To add a field
 * is to add a row; to add a kind, a row and its fields.
 *
 * The whole of SCENE.md is here. A row that this build does not render has
 * `ready` false (kinds, choices) or FIELD_NOT_YET (fields); it is checked like
 * any other, and enum.not_yet or property.not_yet is added only if nothing else
 * is wrong inside of it: for a kind, in the object whose `type` it is; for a
 * field, in its value. So a torus with a negative radius is told about the
 * radius, and about the torus once that is mended.
 *
 * A value is stored at `offset` of the struct being read (FIELD_SKIP: only
 * checked), with the C type named at enum field_type. */
#ifndef CORE_SCENE_KINDS_H
#define CORE_SCENE_KINDS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/json.h"
#include "core/base/json_write.h"

struct reader; /* scene_reader.h */
struct writer; /* scene_write.h */
struct field;
struct kind;
struct family;

enum field_type {
    FIELD_NUMBER,    /* double */
    FIELD_INTEGER,   /* uint32_t */
    FIELD_BOOL,      /* bool; with `count`: that bit of an unsigned */
    FIELD_ENUM,      /* int: the value of the choice */
    FIELD_TEXT,      /* const char *, at most `count` characters */
    FIELD_NAME,      /* const char *, SCENE section 2 */
    FIELD_VECTOR,    /* double[count], each in range */
    FIELD_DIRECTION, /* double[3] as written; not the zero vector */
    FIELD_SCALE,     /* double[3]: a number, or `count` numbers; count 0: as
                        many as the texture's mapping has coordinates */
    FIELD_COLOR,     /* double[3] linear, each at most `max` */
    FIELD_PAINT,     /* struct paint: a colour, a texture's name or a texture */
    FIELD_PART,      /* an object with the fields of `part` */
    FIELD_FAMILY,    /* an object with a `type`, of `family` */
    FIELD_LIST,      /* an array of those, at most `count` */
    FIELD_CUSTOM     /* whatever `read` and `write` say */
};

enum field_flag {
    FIELD_REQUIRED = 1,
    FIELD_OPTIONAL = 2, /* no default: nothing is stored or written */
    FIELD_NULLABLE = 4, /* null is allowed, and stored as 0 */
    FIELD_NULL = 8,     /* the default is null */
    FIELD_NOT_YET = 16,
    FIELD_ABOVE = 32,   /* min itself is not allowed */
    FIELD_BELOW = 64,   /* max itself is not allowed */
    FIELD_NAMED = 128,  /* FIELD_LIST: every entry needs a name */
    FIELD_LATE = 256,   /* read after all other fields of the object */
    FIELD_DROPPED = 512 /* not in the canonical form */
};

#define FIELD_SKIP SIZE_MAX

struct choice {
    const char *name;
    int value;
    bool ready;
};

struct field {
    const char *name;
    enum field_type type;
    unsigned flags;
    double min, max;
    uint32_t count;
    size_t offset;
    double def[4]; /* default: numbers, 0 or 1, the value of a choice */
    const struct choice *choices;
    size_t choice_count;
    const struct kind *part;
    const struct family *family;
    const char *same_as; /* absent: as this neighbour, which has its own row */

    /* Absent fields whose default depends on their neighbours: change `def`
     * (or set it to NAN for null); false if there is no value. `object` may
     * be NULL: the whole object is absent. */
    bool (*fill)(const struct json *root, const struct json *object,
                 double def[4]);

    /* FIELD_CUSTOM; `value` is NULL where the field is absent. */
    void (*read)(struct reader *r, const struct json *value,
                 const struct field *field, void *to);
    void (*write)(struct writer *w, const char *key, const struct json *object,
                  const struct json *value);
};

struct kind {
    const char *name;
    int value; /* of the C enum; -1 while not ready */
    bool ready;
    const struct field *fields;
    size_t field_count;

    /* Relations between fields; called after them, also when some are wrong.
     * `object` is NULL where it is absent. */
    void (*check)(struct reader *r, const struct json *object, void *to);
};

struct family {
    const char *noun; /* "shape", for messages */
    const struct field *common;
    size_t common_count;
    const struct kind *kinds;
    size_t kind_count;
    const struct kind *fallback; /* without `type`; NULL: it is required */

    /* After everything else: the struct goes into the scene. */
    void (*finish)(struct reader *r, const struct json *object,
                   const struct kind *kind, void *to);
};

extern const struct kind kind_scene; /* the document itself */
extern const struct kind kind_film, kind_sampler;
extern const struct family family_camera, family_integrator, family_background;
extern const struct family family_texture, family_material, family_light;
extern const struct family family_shape, family_sdf;
extern const struct kind kind_step; /* one step of a transform */

/* Values of `kind` beyond enum shape_kind. */
enum { OBJECT_GROUP = 100 };

/* The row of that name, or NULL. */
const struct kind *
family_kind(const struct family *family, const char *name);
const struct field *
kind_field(const struct field *fields, size_t count, const char *name);

/* The kind that `object` names, or the fallback; NULL if it is unknown. */
const struct kind *
family_kind_of(const struct family *family, const struct json *object);

/* Coordinates that a texture object's mapping reads: 2 or 3. */
uint32_t
texture_coordinates(const struct json *texture);

/* Row pieces. */
#define FIELD_AT(type, member) .offset = offsetof(struct type, member)
#define COUNT_OF(array)        (sizeof(array) / sizeof((array)[0]))
#define FIELDS_OF(array)       .fields = (array), .field_count = COUNT_OF(array)
#define CHOICES_OF(array)      .choices = (array), .choice_count = COUNT_OF(array)
#define RANGE_POINT            .count = 3, .min = -1e6, .max = 1e6
#define RANGE_LENGTH           .min = 1e-6, .max = 1e6

#endif
