/* A page elsewhere must not drive the service of this machine. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "server/api/origin.h"

static void
hosts_of_this_machine(void **state)
{
    static const char *const ours[] = {
        "localhost",     "LocalHost:80", "127.0.0.1",  "127.0.0.1:8080",
        "127.255.0.9:1", "[::1]",        "[::1]:8080", "glint.example:8080"};
    static const char *const others[] = {"",
                                         "example.org",
                                         "localhost.example.org",
                                         "127.0.0.1.example.org",
                                         "127.0.0.1:8080:1",
                                         "127.0.0.1:x",
                                         "127.0.0",
                                         "127.0.0.256",
                                         "128.0.0.1",
                                         "[::2]",
                                         "[::1",
                                         "::1",
                                         "localhost:123456",
                                         "127.0.0.1@evil",
                                         "evil@127.0.0.1",
                                         "127.1",
                                         "127.0.0.1.",
                                         ":80",
                                         "[::1]x",
                                         "2130706433"};
    size_t i;

    (void)state;
    for (i = 0; i < sizeof ours / sizeof ours[0]; i++)
        assert_true(host_is_ours(ours[i], "glint.example"));
    for (i = 0; i < sizeof others / sizeof others[0]; i++)
        assert_false(host_is_ours(others[i], "glint.example"));
    assert_false(host_is_ours(NULL, "localhost"));
    assert_true(host_is_ours("[fd00::5]:80", "fd00::5"));
    assert_false(host_is_ours("x", ""));
}

static void
origins_are_exact(void **state)
{
    (void)state;
    assert_true(origin_is_ours(NULL, "127.0.0.1:80"));
    assert_true(origin_is_ours("http://127.0.0.1:80", "127.0.0.1:80"));
    assert_true(origin_is_ours("https://LOCALHOST", "localhost"));
    assert_false(origin_is_ours("http://127.0.0.1:81", "127.0.0.1:80"));
    assert_false(origin_is_ours("http://localhost:80", "127.0.0.1:80"));
    assert_false(origin_is_ours("null", "127.0.0.1:80"));
    assert_false(origin_is_ours("", "127.0.0.1:80"));
    assert_false(origin_is_ours("file://127.0.0.1:80", "127.0.0.1:80"));
    assert_false(origin_is_ours("http://127.0.0.1:80.evil", "127.0.0.1:80"));
    assert_false(origin_is_ours("http://x", NULL));
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(hosts_of_this_machine),
        cmocka_unit_test(origins_are_exact),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
