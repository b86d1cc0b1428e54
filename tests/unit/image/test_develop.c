/* Film values -> what a file stores. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/image/develop.h"

/* A film of `count` pixels in one row with one layer, filled from `values`. */
static struct film
film_of(enum layer layer, unsigned channels, const float *values,
        uint32_t count)
{
    struct film film = {.width = count, .height = 1};
    size_t size = (size_t)count * channels * sizeof(float);
    film.layers[layer] = malloc(size);
    memcpy(film.layers[layer], values, size);
    return film;
}

static void
film_free(struct film *film)
{
    for (int i = 0; i < LAYER_COUNT; i++)
        free(film->layers[i]);
}

static struct output
png_of(enum layer layer, enum bit_depth depth, enum color_space space)
{
    return (struct output){.format = OUTPUT_PNG,
                           .layers = {layer},
                           .layer_count = 1,
                           .bit_depth = depth,
                           .color_space = space};
}

/* Develop beauty values as grey triples and compare the first channel. */
static void
expect_beauty(enum bit_depth depth, enum color_space space, const float *values,
              const float *expected, uint32_t count)
{
    float triples[64 * 3];
    for (uint32_t i = 0; i < count * 3; i++)
        triples[i] = values[i / 3];
    struct film film = film_of(LAYER_BEAUTY, 3, triples, count);
    struct output output = png_of(LAYER_BEAUTY, depth, space);
    struct image image;
    struct error err = {0};
    assert_true(develop(&film, &output, &image, &err));
    assert_int_equal(image.channel_count, 3);
    assert_string_equal(image.names[0], "R");
    assert_string_equal(image.names[2], "B");
    for (uint32_t i = 0; i < count; i++) {
        if (image.data[i * 3] != expected[i] ||
            image.data[i * 3 + 2] != expected[i])
            fail_msg("value %g: %g, not %g", (double)values[i],
                     (double)image.data[i * 3], (double)expected[i]);
    }
    image_clear(&image);
    film_free(&film);
}

static void
linear_bytes_round_half_up_and_clamp(void **state)
{
    (void)state;
    /* 0.5/255 in float is a hair under or over the step: both sides by name. */
    float half = 0.5F / 255;
    float values[] = {0,
                      1,
                      2,
                      -1,
                      INFINITY,
                      -INFINITY,
                      NAN,
                      0.5F,
                      0.25F,
                      -0.0F,
                      half * 0.999F,
                      half * 1.001F,
                      0x1.fffffep-1F,
                      127.0F / 255};
    float expected[] = {0, 255, 255, 0, 255, 0, 0, 128, 64, 0, 0, 1, 255, 127};
    expect_beauty(DEPTH_UINT8, COLOR_LINEAR, values, expected, 14);
}

static void
every_byte_survives_the_way_there_and_back(void **state)
{
    (void)state;
    for (uint32_t k = 0; k < 65536; k += 64) {
        float values[64], expected[64];
        for (uint32_t i = 0; i < 64; i++) {
            values[i] = (float)(k + i) / 65535;
            expected[i] = (float)(k + i);
        }
        expect_beauty(DEPTH_UINT16, COLOR_LINEAR, values, expected, 64);
    }
}

static void
srgb_is_applied_before_quantising(void **state)
{
    (void)state;
    /* 0.5 -> 0.735357; 0.18 -> 0.461356; 0.001 -> 0.01292 */
    float values[] = {0, 1, 0.5F, 0.18F, 0.001F, NAN, 3, -2};
    float bytes[] = {0, 255, 188, 118, 3, 0, 255, 0};
    float words[] = {0, 65535, 48192, 30235, 847, 0, 65535, 0};
    expect_beauty(DEPTH_UINT8, COLOR_SRGB, values, bytes, 8);
    expect_beauty(DEPTH_UINT16, COLOR_SRGB, values, words, 8);
}

static void
only_srgb_colours_say_srgb(void **state)
{
    (void)state;
    float values[3] = {0.5F, 0.5F, 0.5F};
    struct film film = film_of(LAYER_BEAUTY, 3, values, 1);
    film.layers[LAYER_NORMAL] = calloc(3, sizeof(float));
    struct image image;
    struct output output = png_of(LAYER_BEAUTY, DEPTH_UINT8, COLOR_SRGB);
    assert_true(develop(&film, &output, &image, NULL));
    assert_true(image.srgb);
    image_clear(&image);
    output.color_space = COLOR_LINEAR;
    assert_true(develop(&film, &output, &image, NULL));
    assert_false(image.srgb);
    image_clear(&image);
    output = png_of(LAYER_NORMAL, DEPTH_UINT8, COLOR_SRGB);
    assert_true(develop(&film, &output, &image, NULL));
    assert_false(image.srgb);
    image_clear(&image);
    film_free(&film);
}

static void
normals_are_halved_and_lifted(void **state)
{
    (void)state;
    float normals[] = {-1, 0, 1, 0, 0, 0};
    struct film film = film_of(LAYER_NORMAL, 3, normals, 2);
    struct output output = png_of(LAYER_NORMAL, DEPTH_UINT8, COLOR_SRGB);
    struct image image;
    assert_true(develop(&film, &output, &image, NULL));
    float expected[] = {0, 128, 255, 128, 128, 128};
    assert_memory_equal(image.data, expected, sizeof expected);
    image_clear(&image);
    film_free(&film);
}

static void
depth_is_scaled_by_the_farthest_hit(void **state)
{
    (void)state;
    float depth[] = {2, 4, INFINITY, 1, NAN};
    struct film film = film_of(LAYER_DEPTH, 1, depth, 5);
    struct output output = png_of(LAYER_DEPTH, DEPTH_UINT8, COLOR_SRGB);
    struct image image;
    assert_true(develop(&film, &output, &image, NULL));
    assert_int_equal(image.channel_count, 1);
    float expected[] = {128, 255, 0, 64, 0};
    assert_memory_equal(image.data, expected, sizeof expected);
    image_clear(&image);
    /* Nothing hit: black, and no division by zero. */
    for (int i = 0; i < 5; i++)
        film.layers[LAYER_DEPTH][i] = INFINITY;
    assert_true(develop(&film, &output, &image, NULL));
    for (int i = 0; i < 5; i++)
        assert_true(image.data[i] == 0);
    image_clear(&image);
    film_free(&film);
}

static void
exr_keeps_every_bit_in_the_order_asked(void **state)
{
    (void)state;
    float beauty[] = {1, -2, 1e30F, 4, 5, NAN};
    float depth[] = {INFINITY, 7};
    struct film film = film_of(LAYER_BEAUTY, 3, beauty, 2);
    film.layers[LAYER_DEPTH] = malloc(sizeof depth);
    memcpy(film.layers[LAYER_DEPTH], depth, sizeof depth);
    struct output output = {.format = OUTPUT_EXR,
                            .layers = {LAYER_DEPTH, LAYER_BEAUTY},
                            .layer_count = 2,
                            .bit_depth = DEPTH_FLOAT};
    struct image image;
    struct error err = {0};
    assert_true(develop(&film, &output, &image, &err));
    assert_int_equal(develop_format(&output), IMAGE_EXR);
    float expected[] = {INFINITY, 1, -2, 1e30F, 7, 4, 5, NAN};
    assert_memory_equal(image.data, expected, sizeof expected);
    assert_string_equal(image.names[0], "depth.V");
    assert_string_equal(image.names[3], "B");
    assert_string_equal(
        image.manifest,
        "[{\"layer\":\"depth\",\"channels\":[\"depth.V\"],\"kind\":\"scalar\"},"
        "{\"layer\":\"beauty\",\"channels\":[\"R\",\"G\",\"B\"],\"kind\":"
        "\"color\"}]");
    image_clear(&image);
    film_free(&film);
}

static void
a_layer_the_film_lacks_is_refused_by_name(void **state)
{
    (void)state;
    float beauty[] = {1, 2, 3};
    struct film film = film_of(LAYER_BEAUTY, 3, beauty, 1);
    struct output output = png_of(LAYER_ALBEDO, DEPTH_UINT8, COLOR_SRGB);
    struct image image;
    struct error err = {0};
    assert_false(develop(&film, &output, &image, &err));
    assert_int_equal(err.code, ERROR_LAYER_UNKNOWN);
    assert_non_null(strstr(err.text, "albedo"));
    assert_null(image.data);
    film_free(&film);
}

static void
too_many_pixels_are_an_error_and_no_crash(void **state)
{
    (void)state;
    float beauty[] = {1, 2, 3};
    struct film film = film_of(LAYER_BEAUTY, 3, beauty, 1);
    film.width = film.height = UINT32_MAX;
    struct output output = png_of(LAYER_BEAUTY, DEPTH_UINT8, COLOR_SRGB);
    struct image image;
    struct error err = {0};
    assert_false(develop(&film, &output, &image, &err));
    assert_int_equal(err.code, ERROR_MEMORY);
    film_free(&film);
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(linear_bytes_round_half_up_and_clamp),
        cmocka_unit_test(every_byte_survives_the_way_there_and_back),
        cmocka_unit_test(srgb_is_applied_before_quantising),
        cmocka_unit_test(only_srgb_colours_say_srgb),
        cmocka_unit_test(normals_are_halved_and_lifted),
        cmocka_unit_test(depth_is_scaled_by_the_farthest_hit),
        cmocka_unit_test(exr_keeps_every_bit_in_the_order_asked),
        cmocka_unit_test(a_layer_the_film_lacks_is_refused_by_name),
        cmocka_unit_test(too_many_pixels_are_an_error_and_no_crash),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
