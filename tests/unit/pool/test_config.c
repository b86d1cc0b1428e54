/* Flags, environment, file and defaults -> one struct, or every mistake named.
 *
 * Each row of the tables is one call of the program: what was said where, and
 * what comes of it. Runs in a folder of its own, with standard output and error
 * in files. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "server/config.h"

enum { ARGS_MAX = 12, TEXT_SIZE = 16384 };

extern char **environ;

static char folder[64];
static char said[TEXT_SIZE];   /* standard output */
static char errors[TEXT_SIZE]; /* standard error */
static struct config config;
static int status;

static void
write_file(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

static void
slurp(const char *path, char text[TEXT_SIZE])
{
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    size_t len = fread(text, 1, TEXT_SIZE - 1, file);
    text[len] = '\0';
    fclose(file);
}

static int
redirect(int fd, const char *path)
{
    int kept = dup(fd);
    int file = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    assert_true(kept >= 0 && file >= 0);
    dup2(file, fd);
    close(file);
    return kept;
}

static void
restore(int fd, int kept)
{
    dup2(kept, fd);
    close(kept);
}

/* One call with the arguments up to NULL. */
static enum config_wish
call(const char *const *args)
{
    char texts[ARGS_MAX][256];
    char *argv[ARGS_MAX + 1];
    int argc = 0;
    snprintf(texts[0], sizeof texts[0], "glintd");
    argv[argc++] = texts[0];
    for (; args != NULL && *args != NULL; args++, argc++) {
        assert_true(argc < ARGS_MAX);
        snprintf(texts[argc], sizeof texts[argc], "%s", *args);
        argv[argc] = texts[argc];
    }
    argv[argc] = NULL;
    fflush(stdout);
    fflush(stderr);
    int out = redirect(STDOUT_FILENO, "out.txt");
    int err = redirect(STDERR_FILENO, "err.txt");
    status = -1;
    enum config_wish wish = config_read(argc, argv, &config, &status);
    fflush(stdout);
    fflush(stderr);
    restore(STDOUT_FILENO, out);
    restore(STDERR_FILENO, err);
    slurp("out.txt", said);
    slurp("err.txt", errors);
    return wish;
}

#define CALL(...) call((const char *const[]){__VA_ARGS__, NULL})

/* Nothing said anywhere: no variables, no files. */
static int
clean(void **state)
{
    (void)state;
    static char *none[] = {NULL};
    environ = none;
    unlink("glint.json");
    setenv("HOME", folder, 1);
    return 0;
}

static int
enter_folder(void **state)
{
    (void)state;
    snprintf(folder, sizeof folder, "/tmp/glint-config-XXXXXX");
    return mkdtemp(folder) != NULL && chdir(folder) == 0 ? 0 : -1;
}

static int
leave_folder(void **state)
{
    (void)state;
    static const char *const made[] = {"out.txt",
                                       "err.txt",
                                       "glint.json",
                                       "other.json",
                                       "xdg/glint/config.json",
                                       ".config/glint/config.json"};
    static const char *const folders[] = {"xdg/glint", "xdg", ".config/glint",
                                          ".config"};
    for (size_t i = 0; i < sizeof made / sizeof made[0]; i++)
        unlink(made[i]);
    for (size_t i = 0; i < sizeof folders / sizeof folders[0]; i++)
        rmdir(folders[i]);
    return chdir("/") == 0 && rmdir(folder) == 0 ? 0 : -1;
}

/* --- values --- */

static void
test_defaults(void **state)
{
    (void)state;
    assert_int_equal(call(NULL), CONFIG_RUN);
    assert_string_equal(errors, "");
    assert_string_equal(config.host, "127.0.0.1");
    assert_int_equal(config.port, 8080);
    assert_string_equal(config.data, "./glint-data");
    long cores = sysconf(_SC_NPROCESSORS_ONLN);
    assert_int_equal(config.threads, cores);
    assert_int_equal(config.workers, cores / 8 > 2 ? cores / 8 : 2);
    assert_false(config.insecure_open);
    assert_int_equal(config.log_level, LOG_INFO);
    assert_int_equal(config.log_format, LOG_AUTO);
    assert_int_equal(config.max_scene_bytes, 1048576);
    assert_int_equal(config.scene_limits.max_pixels, 16777216);
    assert_int_equal(config.scene_limits.max_triangles, 10000000);
    assert_int_equal(config.scene_limits.max_rays, 20000000000);
    assert_int_equal(config.scene_limits.max_spp, 65536);
    assert_int_equal(config.scene_limits.max_bounces, 64);
    assert_float_equal(config.max_render_seconds, 600, 0);
    assert_int_equal(config.max_render_bytes, 2147483648);
    assert_float_equal(config.stall_seconds, 60, 0);
    assert_float_equal(config.default_wait, 20, 0);
    assert_float_equal(config.max_wait, 60, 0);
    assert_int_equal(config.max_connections, 10240);
    assert_int_equal(config.max_queued, 100000);
}

static void
test_flag_before_environment_before_file(void **state)
{
    (void)state;
    write_file("glint.json",
               "{\"max_spp\": 1, \"max_bounces\": 1, \"max_queued\": 1}");
    setenv("GLINT_MAX_BOUNCES", "2", 1);
    setenv("GLINT_MAX_QUEUED", "2", 1);
    assert_int_equal(CALL("--max-queued", "3"), CONFIG_RUN);
    assert_int_equal(config.scene_limits.max_spp, 1);
    assert_int_equal(config.scene_limits.max_bounces, 2);
    assert_int_equal(config.max_queued, 3);
    assert_string_equal(errors, "");
}

static void
make_places(void)
{
    assert_int_equal(system("mkdir -p xdg/glint .config/glint"), 0);
    write_file("xdg/glint/config.json", "{\"max_spp\": 20}");
    write_file(".config/glint/config.json", "{\"max_spp\": 30}");
    write_file("other.json", "{\"max_spp\": 40}");
}

static void
test_the_first_file_found_counts(void **state)
{
    (void)state;
    make_places();
    assert_int_equal(call(NULL), CONFIG_RUN);
    assert_int_equal(config.scene_limits.max_spp, 30);
    char xdg[128];
    snprintf(xdg, sizeof xdg, "%s/xdg", folder);
    setenv("XDG_CONFIG_HOME", xdg, 1);
    assert_int_equal(call(NULL), CONFIG_RUN);
    assert_int_equal(config.scene_limits.max_spp, 20);
    write_file("glint.json", "{\"max_spp\": 10}");
    assert_int_equal(call(NULL), CONFIG_RUN);
    assert_int_equal(config.scene_limits.max_spp, 10);
    setenv("GLINT_CONFIG", "other.json", 1);
    assert_int_equal(call(NULL), CONFIG_RUN);
    assert_int_equal(config.scene_limits.max_spp, 40);
    assert_int_equal(CALL("--config", "glint.json"), CONFIG_RUN);
    assert_int_equal(config.scene_limits.max_spp, 10);
    unlink("xdg/glint/config.json");
    unlink(".config/glint/config.json");
}

static void
test_every_kind_in_a_file(void **state)
{
    (void)state;
    write_file("glint.json",
               "{\"listen\": \"[::1]:99\", \"data\": \"/x\", \"workers\": 3,\n"
               " \"threads\": \"auto\", \"insecure_open\": true,\n"
               " \"log_level\": \"warn\", \"log_format\": \"json\",\n"
               " \"max_rays\": 1.5e9, \"default_wait\": 0.5}");
    assert_int_equal(call(NULL), CONFIG_RUN);
    assert_string_equal(config.host, "::1");
    assert_int_equal(config.port, 99);
    assert_string_equal(config.data, "/x");
    assert_int_equal(config.workers, 3);
    assert_int_equal(config.threads, sysconf(_SC_NPROCESSORS_ONLN));
    assert_true(config.insecure_open);
    assert_int_equal(config.log_level, LOG_WARN);
    assert_int_equal(config.log_format, LOG_JSON);
    assert_int_equal(config.scene_limits.max_rays, 1500000000);
    assert_float_equal(config.default_wait, 0.5, 0);
}

static void
test_addresses(void **state)
{
    (void)state;
    static const struct {
        const char *text, *host;
        uint16_t port;
    } good[] = {
        {"127.0.0.1:0", "127.0.0.1", 0},
        {":9", "127.0.0.1", 9},
        {"localhost:1", "127.0.0.1", 1},
        {"[::1]:65535", "::1", 65535},
        {"127.1.2.3:80", "127.1.2.3", 80},
        {"[::ffff:127.0.0.1]:5", "::ffff:127.0.0.1", 5},
    };
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        assert_int_equal(CALL("--listen", good[i].text), CONFIG_RUN);
        assert_string_equal(config.host, good[i].host);
        assert_int_equal(config.port, good[i].port);
    }
    static const char *const wrong[] = {
        "8080",          "127.0.0.1",     "127.0.0.1:",       "127.0.0.1:65536",
        "127.0.0.1:-1",  "example.com:1", "::1:80",           "[::1:80",
        "[127.0.0.1]:1", "127.0.0.1:8a",  "127.0.0.1:000080", "",
        "300.1.1.1:1",
    };
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        assert_int_equal(CALL("--listen", wrong[i]), CONFIG_EXIT_BAD);
        assert_int_equal(status, 3);
        assert_non_null(strstr(errors, "--listen must be HOST:PORT"));
    }
}

static void
test_open_addresses_need_a_word(void **state)
{
    (void)state;
    static const char *const open[] = {"0.0.0.0:80", "[::]:80", "10.0.0.1:80",
                                       "[::ffff:10.0.0.1]:80", "[fe80::1]:80"};
    for (size_t i = 0; i < sizeof open / sizeof open[0]; i++) {
        assert_int_equal(CALL("--listen", open[i]), CONFIG_EXIT_BAD);
        assert_int_equal(status, 3);
        assert_non_null(strstr(errors, "--insecure-open"));
        assert_int_equal(CALL("--listen", open[i], "--insecure-open"),
                         CONFIG_RUN);
        assert_true(config.insecure_open);
    }
}

static void
test_switches(void **state)
{
    (void)state;
    static const struct {
        const char *flag;
        bool on;
    } rows[] = {
        {"--insecure-open", true},      {"--insecure-open=on", true},
        {"--insecure-open=true", true}, {"--insecure-open=1", true},
        {"--insecure-open=off", false}, {"--insecure-open=0", false},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        assert_int_equal(CALL(rows[i].flag), CONFIG_RUN);
        assert_int_equal(config.insecure_open, rows[i].on);
    }
    setenv("GLINT_INSECURE_OPEN", "yes", 1);
    assert_int_equal(call(NULL), CONFIG_EXIT_BAD);
    assert_non_null(
        strstr(errors, "GLINT_INSECURE_OPEN must be on or off, got \"yes\""));
}

static void
test_an_empty_variable_is_none(void **state)
{
    (void)state;
    setenv("GLINT_MAX_SPP", "", 1);
    assert_int_equal(call(NULL), CONFIG_RUN);
    assert_int_equal(config.scene_limits.max_spp, 65536);
}

static void
test_bounds(void **state)
{
    (void)state;
    static const struct {
        const char *flag, *value;
        bool good;
    } rows[] = {
        {"--workers", "1", true},          {"--workers", "256", true},
        {"--workers", "0", false},         {"--workers", "257", false},
        {"--workers", "-1", false},        {"--workers", "1.5", false},
        {"--workers", "two", false},       {"--workers", "Auto", false},
        {"--workers", "", false},          {"--workers", " 2", false},
        {"--workers", "0x2", false},       {"--workers", "2e0", true},
        {"--threads", "1024", true},       {"--threads", "1025", false},
        {"--max-spp", "65537", false},     {"--max-bounces", "65", false},
        {"--max-rays", "2e10", true},      {"--max-rays", "1e999", false},
        {"--max-rays", "nan", false},      {"--max-rays", "inf", false},
        {"--max-wait", "3600.5", false},   {"--stall-seconds", "0.5", true},
        {"--stall-seconds", "0.4", false}, {"--max-scene-bytes", "1023", false},
        {"--log-level", "loud", false},    {"--log-level", "debug", true},
        {"--log-format", "xml", false},    {"--data", "", false},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        enum config_wish wish = CALL(rows[i].flag, rows[i].value);
        assert_int_equal(wish, rows[i].good ? CONFIG_RUN : CONFIG_EXIT_BAD);
        assert_int_equal(status, rows[i].good ? 0 : 3);
        if (!rows[i].good)
            assert_non_null(strstr(errors, rows[i].flag));
    }
    CALL("--workers", "two");
    assert_non_null(strstr(errors, "--workers must be auto or a whole number "
                                   "from 1 to 256, got \"two\""));
}

/* --- mistakes --- */

static void
test_all_mistakes_at_once(void **state)
{
    (void)state;
    write_file("glint.json", "{\"max_sppp\": 4,\n \"workers\": \"2\",\n"
                             " \"insecure_open\": 1, \"data\": 7,\n"
                             " \"config\": \"x\", \"auth\": \"keys\"}");
    setenv("GLINT_MAX_WAIT", "long", 1);
    assert_int_equal(CALL("--max-bounces", "900", "--log-level=loud"),
                     CONFIG_EXIT_BAD);
    assert_int_equal(status, 3);
    static const char *const wanted[] = {
        "./glint.json:1:2: unknown key \"max_sppp\", did you mean \"max_spp\"?",
        "./glint.json:2:13: \"workers\" must be auto or a whole number",
        "./glint.json:3:19: \"insecure_open\" must be true or false, got 1",
        "./glint.json:3:30: \"data\" must be a path",
        "./glint.json:4:2: unknown key \"config\"",
        "\"auth\" is not built yet",
        "GLINT_MAX_WAIT must be a number from 0 to 3600, got \"long\"",
        "--max-bounces must be a whole number from 1 to 64, got \"900\"",
        "--log-level must be debug, info, warn or error, got \"loud\"",
    };
    for (size_t i = 0; i < sizeof wanted / sizeof wanted[0]; i++) {
        if (strstr(errors, wanted[i]) == NULL)
            fail_msg("'%s' is not in:\n%s", wanted[i], errors);
    }
}

static void
test_usage(void **state)
{
    (void)state;
    static const struct {
        const char *args[3];
        const char *text;
    } rows[] = {
        {{"--lisen", ":1"}, "unknown option --lisen, did you mean --listen?"},
        {{"--max-pixel=3"}, "did you mean --max-pixels?"},
        {{"--max_spp", "4"},
         "unknown option --max_spp, did you mean --max-spp?"},
        {{"--verson"}, "did you mean --version?"},
        {{"--workers"}, "--workers needs a value"},
        {{"--print-config=yes"}, "--print-config takes no value"},
        {{"-w", "2"}, "unexpected argument '-w'"},
        {{"backup"}, "unexpected argument 'backup'"},
        {{"--zzzzzzzzzz"}, "unknown option --zzzzzzzzzz\n"},
        {{"--"}, "unexpected argument '--'"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        assert_int_equal(call(rows[i].args), CONFIG_EXIT_BAD);
        assert_int_equal(status, 2);
        if (strstr(errors, rows[i].text) == NULL)
            fail_msg("'%s' is not in:\n%s", rows[i].text, errors);
    }
}

static void
test_not_built_yet(void **state)
{
    (void)state;
    static const char *const flags[] = {
        "--auth=keys",
        "--keys-file=k",
        "--database=postgresql:",
        "--blobs=s3:b",
        "--share-cache=on",
        "--metrics-auth=keys",
        "--isa=x86-64-v2",
        "--public-url=x",
        "--webhook-hosts=x",
        "--admin-key-file=k",
        "--course-secret-file=k",
        "--http=off",
        "--no-http",
        "--listen=unix:/tmp/x",
    };
    for (size_t i = 0; i < sizeof flags / sizeof flags[0]; i++) {
        assert_int_equal(CALL(flags[i]), CONFIG_EXIT_BAD);
        assert_int_equal(status, 3);
        if (strstr(errors, "not built yet") == NULL)
            fail_msg("%s: %s", flags[i], errors);
    }
    /* The default, said aloud, is no wish for more. */
    assert_int_equal(CALL("--auth=none", "--blobs=dir"), CONFIG_RUN);
}

static void
test_bad_files(void **state)
{
    (void)state;
    static const struct {
        const char *text, *wanted;
    } rows[] = {
        {"{\"max_spp\": 4,}", "./glint.json:1:"},
        {"{\"max_spp\": 4, \"max_spp\": 5}", "json.duplicate_key"},
        {"[]", "must be an object"},
        {"", "json.syntax"},
        {"{\"max_spp\": 1e999}", "json.number_range"},
        {"{\"max_spp\": null}", "got null"},
        {"{\"max_spp\": [1]}", "got [1]"},
        {"{\"data\": \"a\\u0000b\"}", "json."},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        write_file("glint.json", rows[i].text);
        assert_int_equal(call(NULL), CONFIG_EXIT_BAD);
        assert_int_equal(status, 3);
        if (strstr(errors, rows[i].wanted) == NULL)
            fail_msg("'%s' is not in:\n%s", rows[i].wanted, errors);
    }
    unlink("glint.json");
    assert_int_equal(CALL("--config", "nowhere.json"), CONFIG_EXIT_BAD);
    assert_int_equal(status, 3);
    assert_non_null(strstr(errors, "nowhere.json"));
}

static void
test_unknown_variables_are_warnings(void **state)
{
    (void)state;
    setenv("GLINT_PORT", "tcp://10.0.0.1:80", 1);
    setenv("GLINT_PORT_80_TCP", "tcp://10.0.0.1:80", 1);
    setenv("GLINT_SERVICE_HOST", "10.0.0.1", 1);
    setenv("GLINT_WORKER", "/x", 1);
    setenv("GLINT_IMAGE_MODULE", "/x", 1);
    setenv("GLINT_SERVER", "http://x", 1);
    setenv("GLINT_BUILD", "x", 1);
    setenv("GLINT_SOURCE", "x", 1);
    assert_int_equal(call(NULL), CONFIG_RUN);
    assert_string_equal(errors, "");
    setenv("GLINT_WORKERZ", "2", 1);
    assert_int_equal(call(NULL), CONFIG_RUN);
    assert_non_null(strstr(errors, "warning"));
    assert_non_null(strstr(errors, "GLINT_WORKERZ"));
}

static void
test_waits_must_fit(void **state)
{
    (void)state;
    assert_int_equal(CALL("--default-wait=30", "--max-wait=10"),
                     CONFIG_EXIT_BAD);
    assert_int_equal(status, 3);
    assert_non_null(strstr(errors, "default_wait must be at most max_wait"));
}

/* --- what is printed --- */

static void
test_print_config_names_value_and_origin(void **state)
{
    (void)state;
    write_file("glint.json", "{\"max_spp\": 7}");
    setenv("GLINT_MAX_BOUNCES", "5", 1);
    assert_int_equal(CALL("--print-config", "--max-queued", "9"),
                     CONFIG_EXIT_OK);
    assert_int_equal(status, 0);
    static const char *const rows[] = {"./glint.json", "GLINT_MAX_BOUNCES",
                                       "--max-queued", "(default)"};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        assert_non_null(strstr(said, rows[i]));
    char *line = strstr(said, "max_spp");
    assert_non_null(line);
    assert_true(strstr(line, " 7 ") < strchr(line, '\n'));
}

static void
test_check_config(void **state)
{
    (void)state;
    assert_int_equal(CALL("--check-config"), CONFIG_EXIT_OK);
    assert_int_equal(status, 0);
    assert_int_equal(CALL("--check-config", "--workers", "0"), CONFIG_EXIT_BAD);
    assert_int_equal(status, 3);
    assert_int_equal(CALL("--check-config", "--nonsense"), CONFIG_EXIT_BAD);
    assert_int_equal(status, 2);
}

static void
test_help_names_every_option(void **state)
{
    (void)state;
    assert_int_equal(CALL("--help"), CONFIG_EXIT_OK);
    assert_int_equal(status, 0);
    assert_non_null(strstr(said, "--listen HOST:PORT"));
    assert_non_null(strstr(said, "--stall-seconds"));
    /* Examples come first. */
    assert_true(strstr(said, "--listen 127.0.0.1:0") <
                strstr(said, "--listen HOST:PORT"));
    assert_null(strstr(said, "keys-file"));
    assert_int_equal(CALL("--version"), CONFIG_EXIT_OK);
    assert_int_equal(strncmp(said, "glintd ", 7), 0);
}

int
main(void)
{
#define T(name) cmocka_unit_test_setup(test_##name, clean)
    const struct CMUnitTest tests[] = {
        T(defaults),
        T(flag_before_environment_before_file),
        T(the_first_file_found_counts),
        T(every_kind_in_a_file),
        T(addresses),
        T(open_addresses_need_a_word),
        T(switches),
        T(an_empty_variable_is_none),
        T(bounds),
        T(all_mistakes_at_once),
        T(usage),
        T(not_built_yet),
        T(bad_files),
        T(unknown_variables_are_warnings),
        T(waits_must_fit),
        T(print_config_names_value_and_origin),
        T(check_config),
        T(help_names_every_option),
    };
    return cmocka_run_group_tests(tests, enter_folder, leave_folder);
}
