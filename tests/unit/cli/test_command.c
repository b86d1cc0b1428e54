/* The parser on a small table of its own: what is read, and what is said about
 * what cannot be read. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "cli/command.h"

static const char *const depths[] = {"half", "float", NULL};
static const struct option common[] = {
    {.name = "help", .letter = 'h', .help = "help"},
    {0},
};
static const struct option paint_options[] = {
    {.name = "output", .letter = 'o', .value = "FILE", .help = "file"},
    {.name = "set", .value = "P=V", .repeatable = true, .help = "set"},
    {.name = "depth", .value = "DEPTH", .choices = depths, .help = "depth"},
    {.name = "threads", .value = "N", .min = 1, .max = 64, .help = "threads"},
    {.name = "quiet", .letter = 'q', .help = "quiet"},
    {0},
};
static const struct option none[] = {{0}};
static const struct command commands[] = {
    {.name = "paint",
     .arguments = "SCENE",
     .options = paint_options,
     .min_args = 1,
     .max_args = 2},
    {.name = "version", .arguments = "", .options = none},
};
static const struct program program = {
    .name = "art", .commands = commands, .command_count = 2, .common = common};

/* Words end with NULL; returns whether they were read. */
static bool
read_words(struct invocation *in, struct error *err, ...)
{
    static char words[16][64];
    char *argv[17] = {"art"};
    int argc = 1;
    va_list args;
    va_start(args, err);
    const char *word;
    while ((word = va_arg(args, const char *)) != NULL) {
        strcpy(words[argc], word);
        argv[argc] = words[argc];
        argc++;
    }
    va_end(args);
    *err = (struct error){0};
    return invocation_read(in, &program, argc, argv, err);
}

static void
reads_every_way_to_write_an_option(void **state)
{
    (void)state;
    struct invocation in;
    struct error err;
    assert_true(read_words(&in, &err, "paint", "--output", "a.png", "s.json",
                           "--set=/a=1", "--set", "/b=x=y", "-q", NULL));
    assert_string_equal(in.command->name, "paint");
    assert_string_equal(invocation_value(&in, "output"), "a.png");
    assert_int_equal(in.arg_count, 1);
    assert_string_equal(in.args[0], "s.json");
    assert_true(invocation_has(&in, "quiet"));
    assert_false(invocation_has(&in, "help"));
    assert_string_equal(invocation_value(&in, "set"), "/b=x=y");
    assert_int_equal(in.given_count, 4);
    assert_string_equal(in.given[1].value, "/a=1");
    invocation_clear(&in);

    assert_true(read_words(&in, &err, "paint", "-qoa.png", "-", NULL));
    assert_string_equal(invocation_value(&in, "output"), "a.png");
    assert_true(invocation_has(&in, "quiet"));
    assert_string_equal(in.args[0], "-");
    invocation_clear(&in);

    assert_true(read_words(&in, &err, "paint", "-o", "-", "--", "--set", NULL));
    assert_string_equal(invocation_value(&in, "output"), "-");
    assert_string_equal(in.args[0], "--set");
    invocation_clear(&in);

    assert_true(read_words(&in, &err, "-h", NULL));
    assert_null(in.command);
    assert_true(invocation_has(&in, "help"));
    invocation_clear(&in);
}

static void
an_absent_option_has_no_value(void **state)
{
    (void)state;
    struct invocation in;
    struct error err;
    assert_true(read_words(&in, &err, "paint", "s", NULL));
    assert_null(invocation_value(&in, "output"));
    assert_int_equal(invocation_integer(&in, "threads", 7), 7);
    invocation_clear(&in);
    assert_true(read_words(&in, &err, "paint", "s", "--threads", "12", NULL));
    assert_int_equal(invocation_integer(&in, "threads", 7), 12);
    invocation_clear(&in);
}

#define REFUSED(sentence, ...)                                                 \
    do {                                                                       \
        struct invocation in;                                                  \
        struct error err;                                                      \
        assert_false(read_words(&in, &err, __VA_ARGS__, NULL));                \
        assert_int_equal(err.code, ERROR_USAGE);                               \
        assert_string_equal(err.text, sentence);                               \
        invocation_clear(&in);                                                 \
    } while (0)

static void
mistakes_are_named(void **state)
{
    (void)state;
    REFUSED("there is no command 'pant', did you mean 'paint'?", "pant");
    REFUSED("there is no command 'zzzzzz'; 'art help' lists them", "zzzzzz");
    REFUSED("there is no option --ouput, did you mean --output?", "paint",
            "--ouput=x");
    REFUSED("there is no option --zzzzzz; 'art help paint' lists what there is",
            "paint", "--zzzzzz");
    REFUSED("there is no option --zzzzzz; 'art help' lists what there is",
            "--zzzzzz");
    REFUSED("there is no option -z in '-qz'", "paint", "-qz");
    REFUSED("--output needs a FILE", "paint", "s", "--output");
    REFUSED("-o needs a FILE", "paint", "s", "-o");
    REFUSED("--output needs a FILE, got nothing", "paint", "--output=");
    REFUSED("--quiet takes no value", "paint", "--quiet=1");
    REFUSED("--output is given twice: 'a' and 'b'", "paint", "-oa", "-ob");
    REFUSED("--depth knows no 'floatt', did you mean 'float'?", "paint",
            "--depth", "floatt");
    REFUSED("--depth takes one of half, float, got 'uint32'", "paint",
            "--depth", "uint32");
    REFUSED("an argument is missing: art paint SCENE", "paint");
    REFUSED("'c' is one argument too many: art paint SCENE", "paint", "a", "b",
            "c");
    REFUSED("'a' is one argument too many: art version ", "version", "a");
}

static void
numbers_stay_in_range(void **state)
{
    (void)state;
    static const char *const bad[] = {
        "0", "65", "-1", "1.5", "x", "1x", "99999999999999999999"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct invocation in;
        struct error err;
        assert_false(
            read_words(&in, &err, "paint", "s", "--threads", bad[i], NULL));
        assert_non_null(
            strstr(err.text, "--threads takes a whole number from 1 to 64"));
        assert_non_null(strstr(err.text, bad[i]));
        invocation_clear(&in);
    }
}

static void
help_needs_no_arguments(void **state)
{
    (void)state;
    struct invocation in;
    struct error err;
    assert_true(read_words(&in, &err, "paint", "--help", NULL));
    invocation_clear(&in);
}

static void
a_switch_may_come_often(void **state)
{
    (void)state;
    struct invocation in;
    struct error err;
    assert_true(read_words(&in, &err, "paint", "s",
                           "-qqqqqqqqqqqqqqqqqqqqqqqqqqqqqqqq", "-q", NULL));
    assert_true(invocation_has(&in, "quiet"));
    assert_int_equal(in.given_count, 33);
    invocation_clear(&in);
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reads_every_way_to_write_an_option),
        cmocka_unit_test(an_absent_option_has_no_value),
        cmocka_unit_test(mistakes_are_named),
        cmocka_unit_test(numbers_stay_in_range),
        cmocka_unit_test(help_needs_no_arguments),
        cmocka_unit_test(a_switch_may_come_often),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
