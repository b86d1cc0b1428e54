/* scene_reader.h - one reading of one scene document: what the files of the
 * reader share. Private to core/scene.
 *
 *   scene_json.c     the walk along the tables, and what a document adds up to
 *   scene_fields.c   one value of each field type
 *   scene_fault.c    errors with place, hint and fix
 *   scene_camera.c   scene_surface.c   scene_object.c   scene_mesh.c
 *                    relations, references, and the structs of the scene
 *
 * The walk goes on after an error, so values may be wrong or absent: a relation
 * asks the document again through the tolerant getters below and stays silent
 * about what it cannot read. The scene is good only if nothing was added to
 * `errors` and the arena has not failed. */
#ifndef CORE_SCENE_SCENE_READER_H
#define CORE_SCENE_SCENE_READER_H

#include "core/scene/kinds.h"
#include "core/scene/names.h"
#include "core/scene/scene.h"
#include "core/scene/scene_json.h"

enum {
    LIMIT_OBJECTS = 10000,
    LIMIT_INLINE_TRIANGLES = 20000,
    LIMIT_NESTING = 8,
    LIMIT_SDF_NODES = 256,
    LIMIT_SURFACES = 1024, /* materials, textures, definitions */
    LIMIT_LIGHTS = 256,
    LIMIT_ASSETS = 64,
    LIMIT_EXTRAS = 16 * 1024,
    LIMIT_TEXT = 4096,
    LIMIT_FAULTS = 400 /* kept, of which the first 50 are told */
};
#define LIMIT_PIXELS    16777216.0
#define LIMIT_TRIANGLES 10000000.0
#define LIMIT_RAYS      2e10

/* What a group hands down to its children. */
struct object_context {
    const char *path; /* pointer of the array, within the scene */
    double to_world[12];
    bool transformed;
    int32_t material; /* SCENE_NONE: none yet */
    unsigned visible;
    uint32_t depth; /* of groups and csg around */
    bool drawn;     /* false inside csg and definitions */
};

/* A camera before the film's shape is known. */
struct camera_fields {
    double eye[3], target[3], up[3];
    double fov;
    int fov_axis; /* 0 x, 1 y */
    double focal_length, height, distance;
    double window[4];
};

/* One step of a transform. */
struct step_fields {
    double translate[3], axis[3], angle, scale[3], matrix[16];
};

/* A light before colour and intensity are one. */
struct light_fields {
    struct scene_light light;
    double color[3], intensity, direction[3], to_light[3];
    int falloff, loop;
};

/* A growing array in the arena. */
struct vector {
    void *items;
    uint32_t count, capacity;
};

struct reader {
    struct arena *arena;
    struct error_list *errors; /* filled at the end, see reader_tell_all */
    struct vector items;       /* struct error_item, in the order found */
    struct scene *scene;
    const struct json *root;
    struct scene_limits limits; /* no zeros */
    uint32_t faults;            /* all errors but not_yet */
    bool silent;                /* read again what has been checked */
    bool dropped;               /* more than LIMIT_FAULTS */

    struct names materials, textures, definitions, assets, objects;
    bool *texture_reflects; /* [named textures] a reflectance uses it */
    int32_t slot;           /* array entry being read; SCENE_NONE: inline */
    struct vector texture_items, material_items, light_items, mesh_items,
        object_items;
    int32_t default_material;
    struct vector material_nodes; /* const struct json *, of every material */

    struct object_context *context;
    const char *path; /* of the object being read */
    struct scene_mesh mesh;
    uint64_t inline_triangles;
    uint32_t sdf_depth, sdf_nodes;
    struct camera_fields camera;
};

/* --- scene_fault.c: all return false ------------------------------------- */

/* Put what was found into the list of errors, in document order; true if there
 * was nothing and memory sufficed. */
bool
reader_tell_all(struct reader *r);

/* Is there room for one more error? What costs time to say asks first. */
bool
can_tell(const struct reader *r);

bool
fault(struct reader *r, enum error_code code, const struct json *value,
      const char *hint, const char *fix, const char *format, ...)
    __attribute__((format(printf, 6, 7)));
/* The same, at the member's name. */
bool
fault_key(struct reader *r, enum error_code code, const struct json *member,
          const char *hint, const char *fix, const char *format, ...)
    __attribute__((format(printf, 6, 7)));
/* enum.not_yet or property.not_yet, at the value. */
bool
fault_not_yet(struct reader *r, enum error_code code, const struct json *value,
              const char *noun, const char *hint);
bool
fault_type(struct reader *r, const struct json *value, const char *wanted);
/* A number outside of the field's range; true if it is inside. */
bool
fault_range(struct reader *r, const struct json *value,
            const struct field *field);
bool
fault_unknown_key(struct reader *r, const struct json *member,
                  const struct family *family, const struct kind *kind);
bool
fault_unknown_word(struct reader *r, enum error_code code,
                   const struct json *value, const char *noun,
                   const char *const *words, size_t count);
bool
fault_reference(struct reader *r, const struct json *value, const char *noun,
                const struct names *names);

/* JSON Patch texts; NULL without memory or where nothing can be told. */
const char *
fix_remove(struct reader *r, const struct json *member);
const char *
fix_text(struct reader *r, const struct json *value, const char *text);
const char *
fix_number(struct reader *r, const struct json *value, double number);

/* `text`, or "it" where memory ended. */
const char *
or_word(const char *text);
/* A number as a reader types it, in the arena. */
const char *
number_said(struct reader *r, double number);

/* --- scene_fields.c --------------------------------------------------------- */

/* `value` is not NULL; the result goes to `to` at the field's offset. */
void
read_value(struct reader *r, const struct json *value,
           const struct field *field, void *to);
/* The field is absent from `object` (which may be NULL). */
void
read_default(struct reader *r, const struct json *object,
             const struct field *field, void *to);

bool
read_name(struct reader *r, const struct json *value, const char **name);
/* An array of `count` numbers within +-limit. */
bool
read_numbers(struct reader *r, const struct json *value, uint32_t count,
             double limit, const char *noun, double *numbers);

/* --- scene_json.c ------------------------------------------------------------ */

/* Members of `object` (NULL: absent) by the rows of a kind; `family` may be
 * NULL, `kind` too if the family's common fields are all that is known. */
void
read_members(struct reader *r, const struct json *object,
             const struct family *family, const struct kind *kind, void *to);
/* An object with a `type`; NULL if it is unknown. */
const struct kind *
read_family(struct reader *r, const struct json *object,
            const struct family *family, void *to);
/* Into scratch memory; the family's finish keeps what is of use. */
void
read_family_value(struct reader *r, const struct json *value,
                  const struct family *family);
bool
reader_push(struct reader *r, struct vector *vector, const void *item,
            size_t size);

/* --- tolerant getters: false if absent or not of that form ------------------ */

/* Has it no fraction? */
bool
is_whole(double number);
bool
number_of(const struct json *object, const char *key, double *number);
bool
numbers_of(const struct json *object, const char *key, uint32_t count,
           double *numbers);
const char *
text_of(const struct json *object, const char *key); /* or NULL */
bool
is_text(const struct json *value, const char *text);

/* Of two members, either may be NULL: the first, the later in the document. */
const struct json *
first_of(const struct json *a, const struct json *b);
const struct json *
later_of(const struct json *a, const struct json *b);

/* At most one of `count` names may be given; each further one is
 * property.conflict. Returns the first given, or NULL. */
const struct json *
check_one_of(struct reader *r, const struct json *object,
             const char *const *names, size_t count);

/* --- relations, called by the rows ------------------------------------------- */

void
check_perspective(struct reader *r, const struct json *object, void *to);
void
check_orthographic(struct reader *r, const struct json *object, void *to);
void
check_sampler(struct reader *r, const struct json *object, void *to);
void
finish_camera_fields(struct reader *r, const struct json *object,
                     const struct kind *kind, void *to);
void
check_film(struct reader *r, const struct json *object, void *to);
void
check_filter(struct reader *r, const struct json *object, void *to);
void
check_whitted(struct reader *r, const struct json *object, void *to);
void
finish_background(struct reader *r, const struct json *object,
                  const struct kind *kind, void *to);
void
finish_integrator(struct reader *r, const struct json *object,
                  const struct kind *kind, void *to);

void
check_directional(struct reader *r, const struct json *object, void *to);
void
check_spot(struct reader *r, const struct json *object, void *to);
void
finish_texture(struct reader *r, const struct json *object,
               const struct kind *kind, void *to);
void
finish_material(struct reader *r, const struct json *object,
                const struct kind *kind, void *to);
void
finish_light(struct reader *r, const struct json *object,
             const struct kind *kind, void *to);
void
read_paint(struct reader *r, const struct json *value,
           const struct field *field, struct paint *paint);
/* The array of lights, or the one that shines where there is none. */
void
read_lights(struct reader *r, const struct json *value,
            const struct field *field, void *to);
/* A material's name or an inline one; `to` is an int32_t at the offset. */
void
read_material(struct reader *r, const struct json *value,
              const struct field *field, void *to);
/* Index of the material of an object that has none. */
int32_t
default_material(struct reader *r);
void
read_asset_name(struct reader *r, const struct json *value,
                const struct field *field, void *to);
void
read_weight(struct reader *r, const struct json *value,
            const struct field *field, void *to);

void
check_box(struct reader *r, const struct json *object, void *to);
void
check_plane(struct reader *r, const struct json *object, void *to);
void
check_quad(struct reader *r, const struct json *object, void *to);
void
check_disk(struct reader *r, const struct json *object, void *to);
void
check_axis(struct reader *r, const struct json *object, void *to);
void
check_torus(struct reader *r, const struct json *object, void *to);
void
check_triangle(struct reader *r, const struct json *object, void *to);
void
check_mesh(struct reader *r, const struct json *object, void *to);
void
check_step(struct reader *r, const struct json *object, void *to);
void
finish_object(struct reader *r, const struct json *object,
              const struct kind *kind, void *to);
void
finish_sdf(struct reader *r, const struct json *object, const struct kind *kind,
           void *to);
void
read_transform(struct reader *r, const struct json *value,
               const struct field *field, void *to);
void
read_objects(struct reader *r, const struct json *value,
             const struct field *field, void *to);
void
read_definitions(struct reader *r, const struct json *value,
                 const struct field *field, void *to);
void
read_operand(struct reader *r, const struct json *value,
             const struct field *field, void *to);
void
read_definition_name(struct reader *r, const struct json *value,
                     const struct field *field, void *to);
void
read_node(struct reader *r, const struct json *value, const struct field *field,
          void *to);
void
read_nodes(struct reader *r, const struct json *value,
           const struct field *field, void *to);
void
read_vertices(struct reader *r, const struct json *value,
              const struct field *field, void *to);
void
read_positions(struct reader *r, const struct json *value,
               const struct field *field, void *to);
void
read_indices(struct reader *r, const struct json *value,
             const struct field *field, void *to);
void
read_mesh_normals(struct reader *r, const struct json *value,
                  const struct field *field, void *to);
void
read_mesh_uvs(struct reader *r, const struct json *value,
              const struct field *field, void *to);
void
read_assets(struct reader *r, const struct json *value,
            const struct field *field, void *to);
void
read_extras(struct reader *r, const struct json *value,
            const struct field *field, void *to);

/* --- after the walk ----------------------------------------------------------- */

/* No number of a texture object above 1: a reflectance uses it. */
void
check_reflectance(struct reader *r, const struct json *texture);
void
collect_names(struct reader *r);
void
check_document(struct reader *r);
void
finish_camera(struct reader *r);

#endif
