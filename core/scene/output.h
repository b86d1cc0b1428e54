/* output.h - how a film is delivered (SCENE section 4): the `output` member of
 * a job document. Plain data, copied by value. */
#ifndef CORE_SCENE_OUTPUT_H
#define CORE_SCENE_OUTPUT_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/bytes.h"
#include "core/base/error.h"
#include "core/base/json.h"
#include "core/scene/layer.h"

enum output_format { OUTPUT_PNG, OUTPUT_EXR };
enum bit_depth { DEPTH_UINT8, DEPTH_UINT16, DEPTH_HALF, DEPTH_FLOAT };
enum color_space { COLOR_SRGB, COLOR_LINEAR };

struct output {
    enum output_format format;
    enum layer layers[LAYER_COUNT]; /* in the order asked, no two alike */
    uint32_t layer_count;           /* >= 1; png: exactly 1 */
    enum bit_depth bit_depth;
    enum color_space color_space;
};

/* PNG of beauty, 8 bits, sRGB. */
void
output_default(struct output *output);

/* Read `node` (NULL: the default). False if anything was added to errors.
 * Everything is checked together: a png with two layers is array.length, a
 * png with `float` is property.conflict, jpeg and gif are enum.not_yet. */
bool
output_read(const struct json *node, struct output *output,
            struct error_list *errors);

/* Canonical JSON: all members, sorted. Reads back to the same struct. */
void
output_write(const struct output *output, struct bytes *out);

const char *
output_media_type(const struct output *output); /* "image/png" */
const char *
output_extension(const struct output *output); /* "png" */

const char *
layer_name(enum layer layer);
const char *
layer_kind(enum layer layer); /* "color", "vector", "scalar" */
unsigned
layer_channels(enum layer layer);
/* LAYER_COUNT if there is no such layer. */
enum layer
layer_find(const char *name);

#endif
