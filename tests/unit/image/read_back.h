/* read_back.h - encoded bytes -> what a reader finds in them; for tests. */
#ifndef TESTS_UNIT_IMAGE_READ_BACK_H
#define TESTS_UNIT_IMAGE_READ_BACK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct picture {
    int width, height, channel_count;
    char names[32][64]; /* in the file's order */
    char sample[16];    /* "uint8", "half" ... */
    char compression[16];
    char color_space[32]; /* as the file says; "" if it does not */
    char date[32];
    char manifest[1024];
    float *data;     /* exr: channels interleaved, top row first */
    unsigned *whole; /* png: the same as stored, whole numbers */
};

/* False, with a line on standard error, if the bytes are no such file. */
bool
read_back(const char *format, const void *bytes, size_t len,
          struct picture *picture);
void
picture_clear(struct picture *picture);

/* Index of a channel, or -1. */
int
picture_channel(const struct picture *picture, const char *name);

#ifdef __cplusplus
}
#endif
#endif
