/* develop.h - film + output settings -> image (SCENE section 4).
 *
 * Linear film values become what the file stores: sRGB or linear, quantised for
 * PNG as floor(255 clamp(v, 0, 1) + 1/2) after encoding, untouched for EXR.
 * PNG of a data layer: normal is n/2 + 1/2; depth and object_id are scaled to
 * 0...1 by the largest finite value (miss: 0 and 0), linear. */
#ifndef CORE_IMAGE_DEVELOP_H
#define CORE_IMAGE_DEVELOP_H

#include "core/image/image.h"
#include "core/scene/output.h"
#include "core/trace/film.h"

/* ERROR_LAYER_UNKNOWN if the film lacks a layer asked for. */
bool
develop(const struct film *film, const struct output *output,
        struct image *image, struct error *err);

enum image_format
develop_format(const struct output *output);

#endif
