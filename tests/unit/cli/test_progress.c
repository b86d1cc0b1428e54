/* The bar: how it looks at every width, that it never falls, and what is left
 * of it when something else has to be said. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "cli/progress.h"

static const struct progress_facts half = {.stage = "tracing",
                                           .fraction = 0.53,
                                           .rays_per_second = 42e6,
                                           .seconds_left = 13};

static void
looks_as_documented(void **state)
{
    (void)state;
    char text[PROGRESS_SIZE];
    progress_format(text, &half, true, 80);
    assert_string_equal(text, "tracing  [################----------------]  53"
                              "%  42 Mray/s  0:13 left");
    progress_format(text, &half, false, 80);
    assert_string_equal(text, "tracing   53%  42 Mray/s  0:13 left");
}

static void
unknown_facts_are_left_out(void **state)
{
    (void)state;
    char text[PROGRESS_SIZE];
    struct progress_facts facts = {.stage = "loading", .seconds_left = -1};
    progress_format(text, &facts, false, 80);
    assert_string_equal(text, "loading    0%");
    facts.fraction = 7; /* a server's slip */
    facts.rays_per_second = 1.54e6;
    facts.seconds_left = 4000;
    progress_format(text, &facts, false, 80);
    assert_string_equal(text, "loading  100%  1.5 Mray/s  1:06:40 left");
}

static void
a_line_never_wraps(void **state)
{
    (void)state;
    char text[PROGRESS_SIZE];
    for (unsigned columns = 1; columns < 300; columns++) {
        size_t len = progress_format(text, &half, true, columns);
        assert_true(len < columns);
        assert_int_equal(len, strlen(text));
        for (size_t i = 0; i < len; i++)
            assert_in_range(text[i], ' ', '~');
    }
}

static void
the_bar_never_falls_and_ends_with_a_newline(void **state)
{
    (void)state;
    char *data = NULL;
    size_t len = 0;
    struct channel to = {
        .file = open_memstream(&data, &len), .terminal = true, .columns = 80};
    struct progress progress;
    struct progress_facts facts = half;
    progress_start(&progress, &to, false, 0);
    static const double fractions[] = {0.1, 0.5, 0.3, 0.6, 0.0, 0.9};
    for (size_t i = 0; i < 6; i++) {
        facts.fraction = fractions[i];
        progress_show(&progress, &facts, 300000 + (int64_t)i * 100000);
    }
    progress_finish(&progress);
    fclose(to.file);

    int before = -1, shown = 0;
    for (char *at = strchr(data, '%'); at; at = strchr(at + 1, '%')) {
        int percent = atoi(at - 3);
        assert_true(percent >= before);
        before = percent;
        shown++;
    }
    assert_int_equal(shown, 7);
    assert_int_equal(before, 100);
    assert_int_equal(data[len - 1], '\n');
    free(data);
}

static void
an_erased_bar_leaves_blanks(void **state)
{
    (void)state;
    char *data = NULL;
    size_t len = 0;
    struct channel to = {
        .file = open_memstream(&data, &len), .terminal = true, .columns = 80};
    struct progress progress;
    progress_start(&progress, &to, false, 0);
    progress_show(&progress, &half, 1000000);
    fflush(to.file);
    size_t drawn = len - 1; /* but the carriage return */
    progress_erase(&progress);
    progress_erase(&progress);  /* nothing left to erase */
    progress_finish(&progress); /* nor to finish */
    fclose(to.file);
    assert_int_equal(len, 1 + drawn + 1 + (drawn + 2) + 1);
    for (size_t i = 1 + drawn + 1; i < len - 1; i++)
        assert_int_equal(data[i], ' ');
    assert_int_equal(data[len - 1], '\r');
    free(data);
}

static void
off_a_terminal_a_line_every_ten_seconds(void **state)
{
    (void)state;
    char *data = NULL;
    size_t len = 0;
    struct channel to = {.file = open_memstream(&data, &len), .columns = 80};
    struct progress progress;
    progress_start(&progress, &to, false, 0);
    for (int64_t ms = 0; ms <= 25000; ms += 100)
        progress_show(&progress, &half, ms * 1000);
    progress_finish(&progress);
    fclose(to.file);
    assert_string_equal(data, "tracing   53%  42 Mray/s  0:13 left\n"
                              "tracing   53%  42 Mray/s  0:13 left\n");
    free(data);
}

static void
quiet_and_short_renders_show_nothing(void **state)
{
    (void)state;
    char *data = NULL;
    size_t len = 0;
    struct channel to = {
        .file = open_memstream(&data, &len), .terminal = true, .columns = 80};
    struct progress progress;
    progress_start(&progress, &to, true, 0);
    progress_show(&progress, &half, 60000000);
    progress_finish(&progress);
    progress_start(&progress, &to, false, 0);
    progress_show(&progress, &half, 100000);
    progress_finish(&progress);
    fclose(to.file);
    assert_int_equal(len, 0);
    free(data);
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(looks_as_documented),
        cmocka_unit_test(unknown_facts_are_left_out),
        cmocka_unit_test(a_line_never_wraps),
        cmocka_unit_test(the_bar_never_falls_and_ends_with_a_newline),
        cmocka_unit_test(an_erased_bar_leaves_blanks),
        cmocka_unit_test(off_a_terminal_a_line_every_ten_seconds),
        cmocka_unit_test(quiet_and_short_renders_show_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
