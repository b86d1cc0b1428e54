/* scene_json.h - the only reader of scene documents, and the canonical writer.
 *
 * The grammar is the whole of SCENE.md; kinds.h has one row per kind and field,
 * from which reader, checker and writer follow. What this build does not render
 * is enum.not_yet or property.not_yet, said only where the thing itself is
 * otherwise right. All errors of a document are collected, then sorted into
 * document order. Pure functions of their input; any thread. */
#ifndef CORE_SCENE_SCENE_JSON_H
#define CORE_SCENE_SCENE_JSON_H

#include "core/base/bytes.h"
#include "core/base/error.h"
#include "core/base/json.h"
#include "core/scene/output.h"
#include "core/scene/scene.h"

/* Maxima that an operator may lower; zero means SCENE section 8's. */
struct scene_limits {
    uint64_t max_pixels;
    uint64_t max_triangles;
    uint64_t max_rays;
    uint32_t max_spp;
    uint32_t max_bounces;
};

/* `root` is the scene's own object, which may be a member of a job document:
 * pointers then start at the job's root ("/scene/objects/0"). The scene and
 * its strings live in `arena`. False if `errors` got anything (or memory ended:
 * then out_of_memory is among them). */
bool
scene_read(const struct json *root, const struct scene_limits *limits,
           struct arena *arena, struct scene *scene, struct error_list *errors);

/* Text in, both steps. */
bool
scene_read_text(const char *text, size_t len, const struct scene_limits *limits,
                struct arena *arena, struct scene *scene,
                struct error_list *errors);

/* The canonical form (SCENE section 1) of a document that scene_read accepted:
 * every default filled in, `description` and `extras` dropped, keys sorted,
 * colours as three numbers, shortest numbers, no white space. Reading it gives
 * the same scene and the same canonical text. */
void
scene_write_canonical(const struct json *root, struct bytes *out);

/* The effective settings of API section 5 as one JSON object: film, sampler,
 * integrator with every value, defaults included. */
void
scene_write_settings(const struct scene *scene, struct bytes *out);

/* {"sphere": 3, "plane": 1}: how many of each shape. */
void
scene_write_object_counts(const struct scene *scene, struct bytes *out);

#endif
