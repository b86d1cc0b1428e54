/* module.h - the one call over the edge between codec.c, in the program, and
 * image_oiio.cpp, in the module glint-image.so that codec.c loads. Both are
 * built together; the module is never another's. */
#ifndef CORE_IMAGE_MODULE_H
#define CORE_IMAGE_MODULE_H

#include "core/image/image.h"

#ifdef __cplusplus
extern "C" {
#endif

/* As image_encode. `image` has been checked. */
typedef bool (*image_module_encode_fn)(const struct image *image,
                                       enum image_format format,
                                       struct bytes *out, struct error *err);

#define IMAGE_MODULE_FILE   "glint-image.so"
#define IMAGE_MODULE_ENCODE "glint_image_encode"

#ifdef __cplusplus
}
#endif
#endif
