/* A module that is not there: one sentence, no crash, at every call. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/image/image.h"

static void
a_missing_module_is_an_error_that_names_it(void **state)
{
    (void)state;
    setenv("GLINT_IMAGE_MODULE", "/nonexistent/glint-image.so", 1);
    float pixel[3] = {0};
    struct image image = {.width = 1,
                          .height = 1,
                          .channel_count = 3,
                          .data = pixel,
                          .sample = IMAGE_UINT8};
    for (int i = 0; i < 2; i++) {
        struct bytes bytes = {0};
        struct error err = {0};
        assert_false(image_encode(&image, IMAGE_PNG, &bytes, &err));
        assert_int_equal(err.code, ERROR_INTERNAL);
        assert_non_null(strstr(err.text, "/nonexistent/glint-image.so"));
        bytes_clear(&bytes);
    }
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_missing_module_is_an_error_that_names_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
