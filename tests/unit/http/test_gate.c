/* gate.c: one reading or none, wherever the bytes are cut. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/http/gate.h"
#include "tests/unit/http/shapes.h"

static unsigned
status_of(const struct gate *gate)
{
    static const unsigned table[] = {
        [GATE_NONE] = 0,
        [GATE_MALFORMED] = 400,
        [GATE_CODING] = 501,
        [GATE_VERSION] = 505,
    };
    return table[gate->refusal];
}

/* Feed in pieces of `step` bytes; false when it was refused. */
static bool
feed(struct gate *gate, const char *text, size_t len, size_t step)
{
    size_t whole;
    for (size_t i = 0; i < len; i += step) {
        size_t n = len - i < step ? len - i : step;
        if (!gate_feed(gate, text + i, n, &whole))
            return false;
    }
    return true;
}

static void
test_malformed_in_pieces(void **state)
{
    (void)state;
    for (size_t i = 0; i < MALFORMED_COUNT; i++) {
        const struct shape *shape = &malformed[i];
        for (size_t step = 1; step <= shape->len; step++) {
            struct gate gate = {0};
            if (feed(&gate, shape->text, shape->len, step))
                fail_msg("let through: %s", shape->name);
            if (status_of(&gate) != shape->status)
                fail_msg("%s: %u, %s", shape->name, status_of(&gate),
                         gate.detail);
            assert_non_null(gate.detail);
            /* It stays shut. */
            size_t whole;
            assert_false(
                gate_feed(&gate, "GET / HTTP/1.0\r\n\r\n", 18, &whole));
            assert_int_equal(whole, 0);
        }
    }
}

static void
test_wellformed_in_pieces(void **state)
{
    (void)state;
    for (size_t i = 0; i < WELLFORMED_COUNT; i++)
        for (size_t step = 1; step <= wellformed[i].len; step++) {
            struct gate gate = {0};
            if (!feed(&gate, wellformed[i].text, wellformed[i].len, step))
                fail_msg("%s: %s", wellformed[i].name, gate.detail);
            assert_int_equal(gate.heads, wellformed[i].requests);
            assert_true(gate_between(&gate));
        }
}

/* Given a good request and a bad one in one piece, then `whole` is the good
 * one's length. */
static void
test_whole(void **state)
{
    (void)state;
    char text[4096];
    for (size_t i = 0; i < WELLFORMED_COUNT; i++)
        for (size_t k = 0; k < MALFORMED_COUNT; k++) {
            size_t len = wellformed[i].len, whole;
            struct gate gate = {0};
            memcpy(text, wellformed[i].text, len);
            memcpy(text + len, malformed[k].text, malformed[k].len);
            assert_false(
                gate_feed(&gate, text, len + malformed[k].len, &whole));
            /* Behind HTTP/1.0 as well: the gate knows no closing. */
            assert_int_equal(whole, len);
        }
}

/* A bad byte in the middle of a request that came in an earlier piece leaves
 * nothing whole in this piece. */
static void
test_nothing_whole(void **state)
{
    (void)state;
    struct gate gate = {0};
    size_t whole;
    assert_true(gate_feed(&gate, "GET / HT", 8, &whole));
    assert_int_equal(whole, 0);
    assert_false(gate_between(&gate));
    assert_false(gate_feed(&gate, "TP/1.1\nHost", 11, &whole));
    assert_int_equal(whole, 0);
}

/* Any single byte put in place of any byte of a head: the gate answers the
 * same whether it sees the text at once or byte by byte. */
static void
test_one_byte_changed(void **state)
{
    (void)state;
    static const char text[] =
        POST "Content-Length: 5\r\nX-Y: z\r\n\r\nhello" GET H "\r\n";
    for (size_t i = 0; i < sizeof text - 1; i++)
        for (int c = 0; c < 256; c++) {
            char copy[sizeof text];
            memcpy(copy, text, sizeof text);
            copy[i] = (char)c;
            struct gate once = {0}, slowly = {0};
            bool a = feed(&once, copy, sizeof text - 1, sizeof text);
            bool b = feed(&slowly, copy, sizeof text - 1, 1);
            assert_int_equal(a, b);
            assert_int_equal(once.heads, slowly.heads);
            assert_int_equal(once.state, slowly.state);
            assert_ptr_equal(once.detail, slowly.detail);
        }
}

/* Noise made of the bytes that matter never confuses the counters. */
static void
test_noise(void **state)
{
    (void)state;
    static const char alphabet[] = "GET /HTTP/1.1\r\n\r\nHost:Content-Length: "
                                   "05;,chunked\0\t\x80%";
    uint32_t x = 12345;
    for (int round = 0; round < 20000; round++) {
        char text[200];
        for (size_t i = 0; i < sizeof text; i++) {
            x = x * 1664525u + 1013904223u;
            text[i] = alphabet[(x >> 16) % (sizeof alphabet - 1)];
        }
        struct gate gate = {0};
        size_t whole;
        if (!gate_feed(&gate, text, sizeof text, &whole)) {
            assert_in_range(whole, 0, sizeof text);
            assert_non_null(gate.detail);
        }
    }
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_malformed_in_pieces),
        cmocka_unit_test(test_wellformed_in_pieces),
        cmocka_unit_test(test_whole),
        cmocka_unit_test(test_nothing_whole),
        cmocka_unit_test(test_one_byte_changed),
        cmocka_unit_test(test_noise),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
