/* image -> bytes -> what another reader finds in them. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "core/image/image.h"
#include "tests/unit/image/read_back.h"

enum { WIDTH = 7, HEIGHT = 5, PIXELS = WIDTH * HEIGHT };

static struct image
image_of(enum image_sample sample, uint32_t channels, const char *const *names)
{
    struct image image = {.width = WIDTH,
                          .height = HEIGHT,
                          .channel_count = channels,
                          .sample = sample};
    for (uint32_t i = 0; i < channels; i++)
        strcpy(image.names[i], names[i]);
    image.data = calloc(PIXELS * channels, sizeof(float));
    return image;
}

static const char *const rgb[] = {"R", "G", "B"};
static const char *const grey[] = {"depth.V"};

static void
png_round_trip(enum image_sample sample, uint32_t channels,
               const char *const *names, const char *expected_sample)
{
    struct image image = image_of(sample, channels, names);
    uint32_t top = sample == IMAGE_UINT8 ? 255 : 65535;
    for (uint32_t i = 0; i < PIXELS * channels; i++)
        image.data[i] = (float)(i * 7919 % (top + 1));
    image.data[0] = (float)top;
    image.srgb = channels == 3;
    struct bytes bytes = {0};
    struct error err = {0};
    if (!image_encode(&image, IMAGE_PNG, &bytes, &err))
        fail_msg("%s", err.text);
    struct picture picture;
    assert_true(read_back("png", bytes.data, bytes.len, &picture));
    assert_int_equal(picture.width, WIDTH);
    assert_int_equal(picture.height, HEIGHT);
    assert_int_equal(picture.channel_count, channels); /* no alpha */
    assert_string_equal(picture.sample, expected_sample);
    for (uint32_t i = 0; i < PIXELS * channels; i++)
        assert_int_equal(picture.whole[i], (unsigned)image.data[i]);
    /* The chunk itself, not the reader's guess. */
    assert_int_equal(memmem(bytes.data, bytes.len, "sRGB", 4) != NULL,
                     image.srgb);
    if (!image.srgb)
        assert_null(memmem(bytes.data, bytes.len, "gAMA", 4));
    assert_null(memmem(bytes.data, bytes.len, "tIME", 4));
    picture_clear(&picture);
    bytes_clear(&bytes);
    image_clear(&image);
}

static void
png_holds_each_whole_number(void **state)
{
    (void)state;
    png_round_trip(IMAGE_UINT8, 3, rgb, "uint8");
    png_round_trip(IMAGE_UINT16, 3, rgb, "uint16");
    png_round_trip(IMAGE_UINT8, 1, grey, "uint8");
    png_round_trip(IMAGE_UINT16, 1, grey, "uint16");
}

static const char *const all_names[] = {
    "R",        "G",        "B",        "depth.V",  "normal.X",   "normal.Y",
    "normal.Z", "albedo.R", "albedo.G", "albedo.B", "object_id.V"};
static const char manifest[] =
    "[{\"layer\":\"beauty\",\"channels\":[\"R\",\"G\",\"B\"],\"kind\":"
    "\"color\"}]";

static void
exr_round_trip(enum image_sample sample, const char *expected_sample)
{
    struct image image = image_of(sample, 11, all_names);
    for (uint32_t i = 0; i < PIXELS * 11; i++)
        image.data[i] = sample == IMAGE_HALF ? (float)(i % 2048) * 0.125F
                                             : (float)i * 1.2345678F;
    image.data[3] = INFINITY; /* a miss in depth.V */
    image.data[0] = NAN;
    image.data[1] = -3.5F;
    strcpy(image.manifest, manifest);
    struct bytes bytes = {0};
    struct error err = {0};
    if (!image_encode(&image, IMAGE_EXR, &bytes, &err))
        fail_msg("%s", err.text);
    struct picture picture;
    assert_true(read_back("exr", bytes.data, bytes.len, &picture));
    assert_int_equal(picture.channel_count, 11);
    assert_string_equal(picture.sample, expected_sample);
    assert_string_equal(picture.compression, "zip");
    assert_string_equal(picture.manifest, manifest);
    for (uint32_t c = 0; c < 11; c++) {
        int at = picture_channel(&picture, all_names[c]);
        if (at < 0)
            fail_msg("no channel %s", all_names[c]);
        for (uint32_t p = 0; p < PIXELS; p++) {
            float got = picture.data[p * 11 + (uint32_t)at];
            float put = image.data[p * 11 + c];
            assert_true(got == put || (isnan(got) && isnan(put)));
        }
    }
    picture_clear(&picture);
    bytes_clear(&bytes);
    image_clear(&image);
}

static void
exr_holds_named_layers_exactly(void **state)
{
    (void)state;
    exr_round_trip(IMAGE_FLOAT, "float");
    exr_round_trip(IMAGE_HALF, "half");
}

static void
the_same_image_gives_the_same_bytes(void **state)
{
    (void)state;
    struct image image = image_of(IMAGE_FLOAT, 3, rgb);
    for (uint32_t i = 0; i < PIXELS * 3; i++)
        image.data[i] = (float)i / 9;
    struct bytes first = {0}, second = {0};
    assert_true(image_encode(&image, IMAGE_EXR, &first, NULL));
    sleep(2); /* the library's own DateTime would have changed */
    assert_true(image_encode(&image, IMAGE_EXR, &second, NULL));
    assert_int_equal(first.len, second.len);
    assert_memory_equal(first.data, second.data, first.len);
    bytes_clear(&first);
    bytes_clear(&second);
    image_clear(&image);
}

static void
bytes_are_appended(void **state)
{
    (void)state;
    struct image image = image_of(IMAGE_UINT8, 3, rgb);
    struct bytes bytes = {0};
    bytes_text(&bytes, "before");
    assert_true(image_encode(&image, IMAGE_PNG, &bytes, NULL));
    assert_memory_equal(bytes.data, "before\x89PNG", 10);
    bytes_clear(&bytes);
    image_clear(&image);
}

static void
what_a_format_cannot_hold_is_refused(void **state)
{
    (void)state;
    struct image image = image_of(IMAGE_FLOAT, 3, rgb);
    struct bytes bytes = {0};
    struct error err = {0};
    assert_false(image_encode(&image, IMAGE_PNG, &bytes, &err));
    assert_int_equal(err.code, ERROR_INTERNAL);
    image.sample = IMAGE_UINT8;
    assert_false(image_encode(&image, IMAGE_EXR, &bytes, NULL));
    image.channel_count = 0;
    assert_false(image_encode(&image, IMAGE_PNG, &bytes, NULL));
    image.channel_count = IMAGE_CHANNEL_MAX + 1;
    assert_false(image_encode(&image, IMAGE_PNG, &bytes, NULL));
    image.channel_count = 3;
    image.width = 0;
    assert_false(image_encode(&image, IMAGE_PNG, &bytes, NULL));
    assert_int_equal(bytes.len, 0);
    bytes_clear(&bytes);
    image_clear(&image);
}

static void
loading_again_is_harmless(void **state)
{
    (void)state;
    image_codec_load();
    image_codec_load();
    for (int i = 0; i < 1000 && !image_codec_settled(); i++)
        usleep(10000);
    assert_true(image_codec_settled());
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(loading_again_is_harmless),
        cmocka_unit_test(png_holds_each_whole_number),
        cmocka_unit_test(exr_holds_named_layers_exactly),
        cmocka_unit_test(the_same_image_gives_the_same_bytes),
        cmocka_unit_test(bytes_are_appended),
        cmocka_unit_test(what_a_format_cannot_hold_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
