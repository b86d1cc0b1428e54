#include "core/image/develop.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_write.h"
#include "core/image/curve.h"

enum image_format
develop_format(const struct output *output)
{
    return output->format == OUTPUT_EXR ? IMAGE_EXR : IMAGE_PNG;
}

static enum image_sample
sample_of(enum bit_depth depth)
{
    static const enum image_sample samples[] = {
        [DEPTH_UINT8] = IMAGE_UINT8,
        [DEPTH_UINT16] = IMAGE_UINT16,
        [DEPTH_HALF] = IMAGE_HALF,
        [DEPTH_FLOAT] = IMAGE_FLOAT,
    };
    return samples[depth];
}

/* The last part of a channel's name, by the kind of its layer. */
static const char *
suffix(const char *kind, unsigned channel)
{
    static const char *const color[] = {"R", "G", "B"};
    static const char *const vector[] = {"X", "Y", "Z"};
    if (strcmp(kind, "scalar") == 0)
        return "V";
    return strcmp(kind, "color") == 0 ? color[channel] : vector[channel];
}

/* "R" for beauty, "normal.X" for the rest. */
static void
channel_name(enum layer layer, unsigned channel, char name[IMAGE_NAME_SIZE])
{
    const char *last = suffix(layer_kind(layer), channel);
    if (layer == LAYER_BEAUTY)
        snprintf(name, IMAGE_NAME_SIZE, "%s", last);
    else
        snprintf(name, IMAGE_NAME_SIZE, "%s.%s", layer_name(layer), last);
}

/* What the file says about itself: which channels make which layer. */
static bool
write_manifest(const struct output *output, struct image *image,
               struct error *err)
{
    struct bytes text = {0};
    struct json_writer w = {.out = &text};
    json_begin_array(&w, NULL);
    for (uint32_t i = 0; i < output->layer_count; i++) {
        enum layer layer = output->layers[i];
        json_begin_object(&w, NULL);
        json_put_string(&w, "layer", layer_name(layer));
        json_begin_array(&w, "channels");
        for (unsigned c = 0; c < layer_channels(layer); c++) {
            char name[IMAGE_NAME_SIZE];
            channel_name(layer, c, name);
            json_put_string(&w, NULL, name);
        }
        json_end_array(&w);
        json_put_string(&w, "kind", layer_kind(layer));
        json_end_object(&w);
    }
    json_end_array(&w);
    bool ok = true;
    if (text.failed)
        ok = error_set(err, ERROR_MEMORY, "no memory for the layer manifest");
    else if (text.len >= sizeof image->manifest)
        ok = error_set(err, ERROR_INTERNAL,
                       "the layer manifest must be under %zu bytes, got %zu",
                       sizeof image->manifest, text.len);
    else
        memcpy(image->manifest, text.data, text.len + 1);
    bytes_clear(&text);
    return ok;
}

/* 0...1, and 0 for NaN: the comparison is false for it. */
static float
clamp(float v)
{
    return v > 0 ? (v < 1 ? v : 1) : 0;
}

/* floor(levels v + 1/2), v in 0...1: whole numbers that float holds exactly.
 * In double, for levels * v + 1/2 must not round up across a whole number. */
static float
quantise(double levels, double v)
{
    return (float)(uint32_t)(levels * v + 0.5);
}

static void
put_linear(const float *from, size_t count, double levels, float *to)
{
    for (size_t i = 0; i < count; i++)
        to[i] = quantise(levels, (double)clamp(from[i]));
}

static void
put_srgb8(const float *from, size_t count, float *to)
{
    struct curve8 table;
    curve8_init(&table);
    for (size_t i = 0; i < count; i++)
        to[i] = curve8_value(&table, clamp(from[i]));
}

static void
put_srgb16(const float *from, size_t count, float *to)
{
    for (size_t i = 0; i < count; i++)
        to[i] = quantise(65535, curve_srgb((double)clamp(from[i])));
}

/* n/2 + 1/2: -1...1 becomes 0...1. A miss has no normal, and is grey. */
static void
put_normal(const float *from, size_t count, double levels, float *to)
{
    for (size_t i = 0; i < count; i++)
        to[i] = quantise(levels, (double)clamp(0.5F * from[i] + 0.5F));
}

/* Scaled so that the largest finite value is 1; what is infinite is a miss. */
static void
put_scaled(const float *from, size_t count, double levels, float *to)
{
    float largest = 0;
    for (size_t i = 0; i < count; i++) {
        if (isfinite(from[i]) && from[i] > largest)
            largest = from[i];
    }
    for (size_t i = 0; i < count; i++) {
        float v = isfinite(from[i]) && largest > 0 ? from[i] / largest : 0;
        to[i] = quantise(levels, (double)clamp(v));
    }
}

/* One layer as whole numbers. Data is never put through the colour curve. */
static void
develop_png(const struct film *film, const struct output *output,
            struct image *image)
{
    enum layer layer = output->layers[0];
    const float *from = film->layers[layer];
    size_t count = (size_t)image->width * image->height * image->channel_count;
    double levels = output->bit_depth == DEPTH_UINT16 ? 65535 : 255;
    const char *kind = layer_kind(layer);
    image->srgb = false;
    if (strcmp(kind, "vector") == 0) {
        put_normal(from, count, levels, image->data);
    } else if (strcmp(kind, "scalar") == 0) {
        put_scaled(from, count, levels, image->data);
    } else if (output->color_space == COLOR_LINEAR) {
        put_linear(from, count, levels, image->data);
    } else {
        image->srgb = true;
        if (output->bit_depth == DEPTH_UINT16)
            put_srgb16(from, count, image->data);
        else
            put_srgb8(from, count, image->data);
    }
}

/* All layers side by side, as they are. */
static void
develop_exr(const struct film *film, const struct output *output,
            struct image *image)
{
    size_t pixels = (size_t)image->width * image->height;
    uint32_t at = 0;
    for (uint32_t i = 0; i < output->layer_count; i++) {
        unsigned channels = layer_channels(output->layers[i]);
        const float *from = film->layers[output->layers[i]];
        float *to = image->data + at;
        for (size_t p = 0; p < pixels; p++) {
            for (unsigned c = 0; c < channels; c++)
                to[c] = from[c];
            from += channels;
            to += image->channel_count;
        }
        at += channels;
    }
}

/* Names, counts and memory; the data is left to the two above. */
static bool
image_shape(const struct film *film, const struct output *output,
            struct image *image, struct error *err)
{
    image->width = film->width;
    image->height = film->height;
    image->sample = sample_of(output->bit_depth);
    for (uint32_t i = 0; i < output->layer_count; i++) {
        enum layer layer = output->layers[i];
        if ((unsigned)layer >= LAYER_COUNT || film->layers[layer] == NULL)
            return error_set(err, ERROR_LAYER_UNKNOWN,
                             "the film has no layer %s",
                             (unsigned)layer < LAYER_COUNT ? layer_name(layer)
                                                           : "of that number");
        if (image->channel_count + layer_channels(layer) > IMAGE_CHANNEL_MAX)
            return error_set(err, ERROR_INTERNAL,
                             "an image must have at most %d channels",
                             IMAGE_CHANNEL_MAX);
        for (unsigned c = 0; c < layer_channels(layer); c++)
            channel_name(layer, c, image->names[image->channel_count++]);
    }
    size_t size;
    if (__builtin_mul_overflow((size_t)film->width, (size_t)film->height,
                               &size) ||
        __builtin_mul_overflow(size, image->channel_count * sizeof(float),
                               &size) ||
        (image->data = malloc(size)) == NULL)
        return error_set(err, ERROR_MEMORY,
                         "no memory for an image of %u x %u pixels",
                         film->width, film->height);
    return true;
}

bool
develop(const struct film *film, const struct output *output,
        struct image *image, struct error *err)
{
    *image = (struct image){0};
    bool png = output->format == OUTPUT_PNG;
    if (output->layer_count == 0 || (png && output->layer_count != 1)) {
        error_set(err, ERROR_INTERNAL, "%s must have %s, got %u",
                  png ? "a png" : "an exr", png ? "1 layer" : "a layer",
                  output->layer_count);
        return false;
    }
    if (!image_shape(film, output, image, err))
        goto fail;
    if (png) {
        develop_png(film, output, image);
    } else {
        develop_exr(film, output, image);
        if (!write_manifest(output, image, err))
            goto fail;
    }
    return true;
fail:
    image_clear(image);
    return false;
}
