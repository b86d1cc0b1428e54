/* image.h - named float channels, developed for one output, and their bytes.
 *
 * Compiles as C11 and C++17: image_oiio.cpp, the one file that knows
 * OpenImageIO, is built as a module of its own, because loading that library
 * takes 0.2 to 0.4 s. image_codec_load starts the load; image_encode waits for
 * it. So a worker can answer and trace while its codecs are still loading. But
 * the C library creates no thread while a library loads: start the threads of a
 * render first. */
#ifndef CORE_IMAGE_IMAGE_H
#define CORE_IMAGE_IMAGE_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#include "core/base/bytes.h"
#include "core/base/error.h"

enum { IMAGE_CHANNEL_MAX = 16, IMAGE_NAME_SIZE = 32 };

enum image_format { IMAGE_PNG, IMAGE_EXR };
enum image_sample { IMAGE_UINT8, IMAGE_UINT16, IMAGE_HALF, IMAGE_FLOAT };

/* Top row first, channels interleaved: data[y][x][channel]. For integer samples
 * the values are already quantised: whole numbers 0...255 or 0...65535. */
struct image {
    uint32_t width, height;
    uint32_t channel_count;
    char names[IMAGE_CHANNEL_MAX][IMAGE_NAME_SIZE]; /* "R", "normal.X" */
    float *data;                                    /* malloc */
    enum image_sample sample;
    bool srgb; /* png: say so in the file; without it the file says nothing */
    char manifest[512]; /* EXR header attribute glint:layers, or "" */
};

void
image_clear(struct image *image);

/* Start loading the codecs on a thread of its own; returns at once, harmless
 * when repeated. */
void
image_codec_load(void);

/* True once the load has ended, well or not; does not wait. Any thread. */
bool
image_codec_settled(void);

/* image -> file bytes, in memory, appended to `out`. The same image gives the
 * same bytes, run to run. ERROR_INTERNAL names the codec's complaint. */
bool
image_encode(const struct image *image, enum image_format format,
             struct bytes *out, struct error *err);

#ifdef __cplusplus
}
#endif
#endif
