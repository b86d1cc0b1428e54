/* Documents that nobody wrote: examples with bytes and values changed at
 * random (a fixed seed), and memory that ends at every possible point. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/unit/scene/documents.h"
#include "tests/unit/scene/property.h"

enum { FILES_MAX = 64 };

static struct bytes files[FILES_MAX];
static size_t file_count;
static uint64_t state = 0x9e3779b97f4a7c15;

static uint32_t
below(uint32_t n)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (uint32_t)((state >> 32) % n);
}

static void
load_folder(const char *folder)
{
    char *names[FILES_MAX];
    size_t count = document_list(folder, names, FILES_MAX);
    for (size_t i = 0; i < count; i++) {
        char path[4096];
        struct error err = {0};
        snprintf(path, sizeof path, "%s/%s/%s", source_root(), folder,
                 names[i]);
        if (file_count < FILES_MAX && strcmp(names[i], "expected.json") != 0 &&
            bytes_read_file(&files[file_count], path, 1 << 20, &err)) {
            if (files[file_count].len < 16 * 1024) /* keep the test short */
                file_count++;
            else
                bytes_clear(&files[file_count]);
        }
        free(names[i]);
    }
}

static int
load_files(void **unused)
{
    (void)unused;
    load_folder("schemas/examples");
    load_folder("schemas/examples/bad");
    load_folder("tests/fuzz/regression/scene");
    return file_count > 0 ? 0 : -1;
}

static int
clear_files(void **unused)
{
    (void)unused;
    for (size_t i = 0; i < file_count; i++)
        bytes_clear(&files[i]);
    return 0;
}

/* What may stand in place of a value. */
static const char *const values[] = {
    "null",
    "true",
    "false",
    "0",
    "-0",
    "1",
    "-1",
    "0.5",
    "2",
    "3",
    "1e-320",
    "1e6",
    "1e7",
    "-1e6",
    "1.7976931348623157e308",
    "2147483648",
    "4294967296",
    "8192",
    "65536",
    "180",
    "\"\"",
    "\"red\"",
    "\"#ff8000\"",
    "\"#ff00\"",
    "\"sphere\"",
    "\"mirror\"",
    "\"mean\"",
    "\"floor-checker\"",
    "[]",
    "{}",
    "[0]",
    "[0, 0, 0]",
    "[1, 2, 3]",
    "[1e-9, 0, 0]",
    "[1, 1, 1, 1]",
    "[[0, 1, 2]]",
    "[[0, 0, 0], [1, 0, 0], [0, 1, 0]]",
    "{\"type\": \"lambert\"}",
    "{\"type\": \"checkerboard\"}",
    "{\"type\": \"constant\", \"color\": [2, 0, 0]}",
    "[{\"scale\": 1e6}]",
    "[{\"scale\": [1, 2, 1e-6]}]",
    "[{\"rotate\": {\"axis\": [0, 1, 1e-200], \"angle\": 33}}]",
    "[{\"type\": \"sphere\"}]",
    "[{\"type\": \"group\", \"children\": [{\"type\": \"plane\"}]}]"};

static const char *const keys[] = {
    "type",         "name",        "material", "radius",   "center",
    "transform",    "children",    "window",   "distance", "fov",
    "focal_length", "spp",         "scale",    "normals",  "smooth",
    "ambient",      "diffuse",     "visible",  "point",    "offset",
    "fresnel",      "clamp_local", "min",      "max",      "vertices",
    "uvs",          "to_light",    "direction"};

static const struct json *
random_node(const struct json *node)
{
    while (node->count > 0 && below(8) != 0) {
        uint32_t skip = below(node->count);
        for (node = node->child; skip > 0; skip--)
            node = node->next;
    }
    return node;
}

/* Replace one value, or insert a member, so that the text stays JSON. */
static void
change_value(const struct bytes *text, struct bytes *out)
{
    struct arena arena;
    arena_init(&arena, 0);
    struct error_list errors = {.arena = &arena};
    const struct json *root =
        json_read(text->data, text->len, NULL, &arena, &errors);
    out->len = 0;
    if (root == NULL) {
        bytes_append(out, text->data, text->len);
        arena_clear(&arena);
        return;
    }
    const struct json *node = random_node(root);
    const char *value = values[below(sizeof values / sizeof values[0])];
    if (node->type == JSON_OBJECT && below(2) == 0) {
        bytes_append(out, text->data, node->begin + 1);
        bytes_printf(out, "\"%s\": %s%s", keys[below(28)], value,
                     node->count > 0 ? ", " : "");
        bytes_append(out, text->data + node->begin + 1,
                     text->len - node->begin - 1);
    } else {
        bytes_append(out, text->data, node->begin);
        bytes_text(out, value);
        bytes_append(out, text->data + node->end, text->len - node->end);
    }
    arena_clear(&arena);
}

static void
change_bytes(struct bytes *text)
{
    static const char bytes[] = "{}[],:\"\\0123456789.eE+-tfn \n\x01\x80\xff";
    for (uint32_t i = below(4) + 1; i > 0 && text->len > 1; i--) {
        size_t at = below((uint32_t)text->len);
        switch (below(3)) {
        case 0: text->data[at] = bytes[below(sizeof bytes - 1)]; break;
        case 1: text->len = at; break;
        default: {
            size_t n = below((uint32_t)(text->len - at));
            memmove(text->data + at, text->data + at + n, text->len - at - n);
            text->len -= n;
            break;
        }
        }
    }
}

static void
changed_values_are_read_or_refused(void **unused)
{
    struct bytes a = {0}, b = {0};
    unsigned good = 0, all = 6000;
    (void)unused;
    for (unsigned i = 0; i < all; i++) {
        a.len = 0;
        const struct bytes *file = &files[below((uint32_t)file_count)];
        bytes_append(&a, file->data, file->len);
        for (uint32_t n = below(3) + 1; n > 0; n--) {
            change_value(&a, &b);
            struct bytes swap = a;
            a = b;
            b = swap;
        }
        good += scene_property(a.data, a.len);
    }
    /* Both ways must have been walked often. */
    assert_true(good > all / 100 && good < all);
    bytes_clear(&a);
    bytes_clear(&b);
}

static void
changed_bytes_are_read_or_refused(void **unused)
{
    struct bytes text = {0};
    (void)unused;
    for (unsigned i = 0; i < 6000; i++) {
        text.len = 0;
        const struct bytes *file = &files[below((uint32_t)file_count)];
        bytes_append(&text, file->data, file->len);
        change_bytes(&text);
        scene_property(text.data, text.len);
        json_property(text.data, text.len);
    }
    bytes_clear(&text);
}

/* The arena ends after `limit` bytes, with `filler` of them gone before. */
static bool
read_within(const struct bytes *text, size_t limit, size_t filler)
{
    struct arena arena;
    struct scene scene;
    arena_init(&arena, limit);
    for (; filler >= 2048; filler -= 2048)
        arena_alloc(&arena, 2048);
    if (filler > 0)
        arena_alloc(&arena, filler);
    struct error_list errors = {.arena = &arena};
    bool good =
        scene_read_text(text->data, text->len, NULL, &arena, &scene, &errors);
    assert_true(good == (errors.count == 0));
    for (size_t i = 0; i < errors.count; i++)
        assert_non_null(errors.items[i].detail);
    arena_clear(&arena);
    return good;
}

static void
memory_may_end_anywhere(void **unused)
{
    (void)unused;
    for (size_t f = 0; f < file_count; f++) {
        bool done = false;
        for (size_t blocks = 1; blocks < 40 && !done; blocks++) {
            done = true;
            for (size_t filler = 0; filler < 16384; filler += 208)
                done = read_within(&files[f], blocks * 16500, filler) && done;
        }
    }
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(changed_values_are_read_or_refused),
        cmocka_unit_test(changed_bytes_are_read_or_refused),
        cmocka_unit_test(memory_may_end_anywhere),
    };
    return cmocka_run_group_tests(tests, load_files, clear_files);
}
