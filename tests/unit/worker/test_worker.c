/* The real glint-worker at the other end: start, ask, cancel, kill, replace,
 * and everything a scene or a parent may do to it. */
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/pidfd.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "core/base/bytes.h"
#include "core/base/clock.h"
#include "server/worker/child.h"
#include "tests/unit/image/read_back.h"

/* Sanitizers slow everything down, and the machine may be busy; what is a
 * promise in milliseconds is printed, and asserted with this much room. */
enum { PATIENCE = 20 };

static const char png[] = "{\"format\":\"png\"}";
static const char exr[] =
    "{\"bit_depth\":\"half\",\"format\":\"exr\",\"layers\":[\"beauty\","
    "\"depth\",\"normal\",\"albedo\",\"object_id\"]}";
static const char small[] =
    "{\"film\":{\"width\":64,\"height\":48},\"objects\":[{\"type\":\"sphere\","
    "\"center\":[0,0,0]},{\"type\":\"plane\",\"offset\":-1}]}";
/* Minutes of work on any machine. */
static const char endless[] =
    "{\"film\":{\"width\":4096,\"height\":4096},\"sampler\":{\"type\":"
    "\"stratified\",\"spp\":100},\"objects\":[{\"type\":\"sphere\"},"
    "{\"type\":\"plane\",\"offset\":-1}]}";

static double
ms_since(int64_t start_us)
{
    return (double)(clock_monotonic_us() - start_us) / 1000;
}

static struct child
started(void)
{
    struct child child;
    struct error err = {0};
    if (!child_start(&child, 0, &err))
        fail_msg("%s", err.text);
    return child;
}

/* The next message of this kind; others but PROGRESS fail the test. */
static struct message
await(struct child *child, enum message_kind kind)
{
    for (;;) {
        struct message message;
        struct error err = {0};
        enum wire_status status = child_receive(child, true, &message, &err);
        if (status != WIRE_MESSAGE)
            fail_msg("status %d while waiting for kind %d: %s", status, kind,
                     err.text);
        if (message.kind == kind)
            return message;
        if (message.kind == MESSAGE_FAILED)
            fail_msg("failed: %s", message.body.failed.text);
        assert_int_equal(message.kind, MESSAGE_PROGRESS);
        message_clear(&message);
    }
}

static struct child
ready_child(void)
{
    struct child child = started();
    struct message message = await(&child, MESSAGE_READY);
    message_clear(&message);
    return child;
}

static void
ask(struct child *child, const char *scene, const char *output)
{
    struct error err = {0};
    if (!child_render(child, scene, strlen(scene), output, strlen(output), 2,
                      &err))
        fail_msg("%s", err.text);
}

static struct bytes
render(struct child *child, const char *scene, const char *output)
{
    ask(child, scene, output);
    struct message message = await(child, MESSAGE_DONE);
    const void *data;
    size_t len;
    struct bytes bytes = {0};
    struct error err = {0};
    if (!wire_map(message.fds[0], (size_t)1 << 30, &data, &len, &err))
        fail_msg("%s", err.text);
    bytes_append(&bytes, data, len);
    wire_unmap(data, len);
    message_clear(&message);
    return bytes;
}

static void
expect_failed(struct child *child, const char *scene, const char *output,
              enum error_code code, const char *word)
{
    ask(child, scene, output);
    struct message message = await(child, MESSAGE_FAILED);
    assert_string_equal(error_code_name(message.body.failed.code),
                        error_code_name(code));
    if (strstr(message.body.failed.text, word) == NULL)
        fail_msg("\"%s\" does not speak of \"%s\"", message.body.failed.text,
                 word);
    message_clear(&message);
}

/* True once the process has ended, within ms. */
static bool
ends_within(int pidfd, int ms)
{
    struct pollfd one = {.fd = pidfd, .events = POLLIN};
    return poll(&one, 1, ms) == 1;
}

static void
await_progress(struct child *child, enum render_stage stage)
{
    for (;;) {
        struct message message = await(child, MESSAGE_PROGRESS);
        bool there = message.body.progress.stage == stage;
        message_clear(&message);
        if (there)
            return;
    }
}

static void
ready_comes_before_the_image_library(void **state)
{
    (void)state;
    double worst = 0;
    for (int i = 0; i < 5; i++) {
        int64_t start = clock_monotonic_us();
        struct child child = ready_child();
        double ms = ms_since(start);
        worst = ms > worst ? ms : worst;
        assert_true(child.ready && !child.busy);
        child_stop(&child, NULL);
    }
    print_message("READY after at most %.1f ms\n", worst);
    assert_true(worst < 20 * PATIENCE);
}

static void
a_scene_becomes_a_png_twice_the_same(void **state)
{
    (void)state;
    struct child child = ready_child();
    ask(&child, small, png);
    struct message message = await(&child, MESSAGE_DONE);
    assert_int_equal(message.body.done.width, 64);
    assert_int_equal(message.body.done.height, 48);
    assert_true(message.body.done.rays[0] >= 64 * 48);
    assert_true(message.body.done.peak_bytes > 1 << 20);
    assert_false(child.busy);
    print_message("load %.1f build %.1f trace %.1f encode %.1f ms, %llu MB\n",
                  message.body.done.load_ms, message.body.done.build_ms,
                  message.body.done.trace_ms, message.body.done.encode_ms,
                  (unsigned long long)message.body.done.peak_bytes >> 20);
    message_clear(&message);
    struct bytes first = render(&child, small, png);
    struct child other = ready_child();
    struct bytes second = render(&other, small, png);
    struct picture picture;
    assert_true(read_back("png", first.data, first.len, &picture));
    assert_int_equal(picture.width, 64);
    assert_int_equal(picture.channel_count, 3);
    assert_string_equal(picture.sample, "uint8");
    assert_int_equal(first.len, second.len);
    assert_memory_equal(first.data, second.data, first.len);
    picture_clear(&picture);
    bytes_clear(&first);
    bytes_clear(&second);
    child_stop(&child, NULL);
    child_stop(&other, NULL);
}

static void
an_exr_carries_every_layer(void **state)
{
    (void)state;
    struct child child = ready_child();
    struct bytes file = render(&child, small, exr);
    struct picture picture;
    assert_true(read_back("exr", file.data, file.len, &picture));
    static const char *const names[] = {"R",        "G",          "B",
                                        "depth.V",  "normal.X",   "normal.Y",
                                        "normal.Z", "albedo.R",   "albedo.G",
                                        "albedo.B", "object_id.V"};
    assert_int_equal(picture.channel_count, 11);
    for (size_t i = 0; i < 11; i++)
        assert_true(picture_channel(&picture, names[i]) >= 0);
    assert_string_equal(picture.sample, "half");
    assert_non_null(strstr(picture.manifest, "{\"layer\":\"object_id\","
                                             "\"channels\":[\"object_id.V\"],"
                                             "\"kind\":\"scalar\"}"));
    picture_clear(&picture);
    bytes_clear(&file);
    child_stop(&child, NULL);
}

/* Triangles enough for Embree to build with its own threads. */
static void
a_big_mesh_builds_behind_the_filter(void **state)
{
    (void)state;
    enum { SIDE = 60 };
    struct bytes scene = {0};
    bytes_text(&scene, "{\"film\":{\"width\":64,\"height\":48},\"objects\":[{"
                       "\"type\":\"mesh\",\"positions\":[");
    for (int i = 0; i < SIDE * SIDE; i++)
        bytes_printf(&scene, "%s[%g,%g,%g]", i > 0 ? "," : "",
                     (double)(i % SIDE) / SIDE - 0.5,
                     (double)(i * 7 % 11) / 100,
                     (double)(i / SIDE) / SIDE - 0.5);
    bytes_text(&scene, "],\"indices\":[");
    for (int i = 0; i < (SIDE - 1) * (SIDE - 1); i++) {
        int corner = i / (SIDE - 1) * SIDE + i % (SIDE - 1);
        bytes_printf(&scene, "%s[%d,%d,%d],[%d,%d,%d]", i > 0 ? "," : "",
                     corner, corner + 1, corner + SIDE, corner + 1,
                     corner + SIDE + 1, corner + SIDE);
    }
    bytes_text(&scene, "]}]}");
    struct child child = ready_child();
    for (int i = 0; i < 3; i++) {
        struct bytes file = render(&child, scene.data, png);
        assert_memory_equal(file.data, "\x89PNG", 4);
        bytes_clear(&file);
    }
    bytes_clear(&scene);
    child_stop(&child, NULL);
}

static void
cancel_is_heard_while_rendering(void **state)
{
    (void)state;
    struct child child = ready_child();
    ask(&child, endless, png);
    await_progress(&child, STAGE_TRACING);
    int64_t start = clock_monotonic_us();
    assert_true(child_threads(&child, 1, NULL));
    assert_true(child_cancel(&child, NULL));
    struct message message = await(&child, MESSAGE_FAILED);
    print_message("canceled after %.0f ms\n", ms_since(start));
    assert_true(ms_since(start) < 100 * PATIENCE);
    assert_int_equal(message.body.failed.code, ERROR_CANCELED);
    message_clear(&message);
    /* A remark that crossed the answer concerns nobody. */
    struct message late = {.kind = MESSAGE_CANCEL, .ask = child.ask};
    assert_true(wire_send(child.socket, &late, NULL));
    struct bytes file = render(&child, small, png);
    assert_memory_equal(file.data, "\x89PNG", 4);
    bytes_clear(&file);
    child_stop(&child, NULL);
}

static void
progress_comes_ten_times_a_second_at_most(void **state)
{
    (void)state;
    struct child child = ready_child();
    ask(&child, endless, png);
    int64_t start = clock_monotonic_us();
    int count = 0;
    uint64_t rays = 0;
    /* At least a second, and until the first tile is done. */
    while (ms_since(start) < 1050 || rays == 0) {
        struct message message = await(&child, MESSAGE_PROGRESS);
        assert_true(message.body.progress.rays >= rays);
        rays = message.body.progress.rays;
        count++;
        message_clear(&message);
    }
    assert_in_range(count, 3, 2 + (int)(ms_since(start) / 100));
    child_stop(&child, NULL);
}

static void
garbage_fails_with_the_first_error_and_the_worker_lives(void **state)
{
    (void)state;
    struct child child = ready_child();
    pid_t pid = child.pid;
    expect_failed(&child, "", png, ERROR_JSON_SYNTAX, "line 1");
    expect_failed(&child, "{\"objects\": [", png, ERROR_JSON_SYNTAX, "line 1");
    expect_failed(&child, "\xff\xfe\x80", png, ERROR_JSON_UTF8, "line 1");
    expect_failed(&child,
                  "{\"objects\":[{\"type\":\"sphere\",\"radius\":-1}],"
                  "\"unheard\":1}",
                  png, ERROR_NUMBER_TOO_SMALL, "/objects/0/radius");
    expect_failed(&child, small, "{\"format\":", ERROR_JSON_SYNTAX, "line 1");
    expect_failed(&child, small, "{\"format\":\"bmp\"}", ERROR_ENUM_UNKNOWN,
                  "bmp");
    struct bytes file = render(&child, small, png);
    assert_memory_equal(file.data, "\x89PNG", 4);
    bytes_clear(&file);
    assert_int_equal(child.pid, pid);
    child_stop(&child, NULL);
}

static void
unsealed_files_are_refused_and_the_worker_lives(void **state)
{
    (void)state;
    struct child child = ready_child();
    int fd = open("/dev/null", O_RDONLY | O_CLOEXEC);
    struct message message = {.kind = MESSAGE_RENDER,
                              .ask = 1,
                              .body.threads = {1},
                              .fds = {fd, fd},
                              .fd_count = 2};
    assert_true(wire_send(child.socket, &message, NULL));
    child.ask = 1;
    child.busy = true;
    struct message answer = await(&child, MESSAGE_FAILED);
    assert_int_equal(answer.body.failed.code, ERROR_PROTOCOL);
    message_clear(&answer);
    message_clear(&message);
    struct bytes file = render(&child, small, png);
    bytes_clear(&file);
    child_stop(&child, NULL);
}

static void
a_killed_worker_is_seen_at_once_and_replaced(void **state)
{
    (void)state;
    struct child child = ready_child();
    ask(&child, endless, png);
    await_progress(&child, STAGE_TRACING);
    int64_t start = clock_monotonic_us();
    kill(child.pid, SIGKILL);
    assert_true(ends_within(child.pidfd, 100 * PATIENCE));
    print_message("death seen after %.2f ms\n", ms_since(start));
    struct message message;
    enum wire_status status;
    do {
        status = child_receive(&child, false, &message, NULL);
        message_clear(&message);
    } while (status == WIRE_MESSAGE);
    assert_int_equal(status, WIRE_CLOSED);
    char how[64];
    child_stop(&child, how);
    assert_string_equal(how, "killed by signal 9");
    child = ready_child();
    print_message("successor ready after %.2f ms\n", ms_since(start));
    struct bytes file = render(&child, small, png);
    assert_memory_equal(file.data, "\x89PNG", 4);
    bytes_clear(&file);
    child_stop(&child, NULL);
}

static void
it_leaves_when_nobody_listens_any_more(void **state)
{
    (void)state;
    for (int busy = 0; busy < 2; busy++) {
        struct child child = ready_child();
        if (busy) {
            ask(&child, endless, png);
            await_progress(&child, STAGE_TRACING);
        }
        close(child.socket);
        child.socket = -1;
        assert_true(ends_within(child.pidfd, 250 * PATIENCE));
        char how[64];
        child_stop(&child, how);
        assert_string_equal(how, "exited with status 0");
    }
}

static void
it_leaves_when_the_talk_makes_no_sense(void **state)
{
    (void)state;
    for (int busy = 0; busy < 2; busy++) {
        struct child child = ready_child();
        if (busy) {
            ask(&child, endless, png);
            await_progress(&child, STAGE_TRACING);
        }
        assert_int_equal(send(child.socket, "nonsense", 8, 0), 8);
        assert_true(ends_within(child.pidfd, 250 * PATIENCE));
        char how[64];
        child_stop(&child, how);
        assert_string_equal(how, "exited with status 1");
    }
}

/* A parent in the middle, so that it can die and we can look. */
static void
it_dies_with_its_parent(void **state)
{
    (void)state;
    int report[2];
    assert_int_equal(pipe(report), 0);
    pid_t parent = fork();
    if (parent == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL); /* should the test be stopped */
        struct child child;
        struct message message;
        if (!child_start(&child, 0, NULL) ||
            child_receive(&child, true, &message, NULL) != WIRE_MESSAGE ||
            !child_render(&child, endless, strlen(endless), png, strlen(png), 2,
                          NULL) ||
            write(report[1], &child.pid, sizeof child.pid) < 0)
            _exit(1);
        pause();
        _exit(0);
    }
    close(report[1]); /* or read would wait for us, should the parent fail */
    pid_t worker = 0;
    assert_int_equal(read(report[0], &worker, sizeof worker), sizeof worker);
    int pidfd = pidfd_open(worker, 0);
    assert_true(pidfd >= 0);
    assert_false(ends_within(pidfd, 100));
    int64_t start = clock_monotonic_us();
    kill(parent, SIGKILL);
    assert_true(ends_within(pidfd, 100 * PATIENCE));
    print_message("orphan gone after %.1f ms\n", ms_since(start));
    waitpid(parent, NULL, 0);
    close(pidfd);
    close(report[0]);
}

static struct bytes
proc_file(pid_t pid, const char *name)
{
    char path[64];
    snprintf(path, sizeof path, "/proc/%d/%s", (int)pid, name);
    struct bytes bytes = {0};
    struct error err = {0};
    if (!bytes_read_file(&bytes, path, 1 << 20, &err))
        fail_msg("%s", err.text);
    return bytes;
}

static void
it_knows_little_and_may_do_less(void **state)
{
    (void)state;
    setenv("GLINT_SECRET", "hidden", 1);
    struct child child = ready_child();
    unsetenv("GLINT_SECRET");
    struct bytes file = render(&child, small, png);
    bytes_clear(&file);
    struct bytes knows = proc_file(child.pid, "environ");
    assert_null(memmem(knows.data, knows.len, "GLINT_SECRET", 12));
    assert_null(memmem(knows.data, knows.len, "HOME=", 5));
    assert_non_null(memmem(knows.data, knows.len, "LANG=C", 6));
    struct bytes status = proc_file(child.pid, "status");
    assert_non_null(strstr(status.data, "NoNewPrivs:\t1"));
    assert_non_null(strstr(status.data, "Seccomp:\t2"));
    if (getsid(child.pid) != child.pid)
        fail_msg("the worker must lead a session of its own");
    bytes_clear(&knows);
    bytes_clear(&status);
    child_stop(&child, NULL);
}

static void
too_little_memory_is_an_answer(void **state)
{
    (void)state;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    skip(); /* their shadow memory needs more addresses than any limit */
#endif
    struct child child;
    assert_true(child_start(&child, (uint64_t)1000 << 20, NULL));
    struct message message = await(&child, MESSAGE_READY);
    message_clear(&message);
    struct bytes file = render(&child, small, png);
    bytes_clear(&file);
    expect_failed(&child,
                  "{\"film\":{\"width\":4096,\"height\":4096},\"objects\":[{"
                  "\"type\":\"sphere\"}]}",
                  exr, ERROR_MEMORY, "memory");
    file = render(&child, small, png);
    assert_memory_equal(file.data, "\x89PNG", 4);
    bytes_clear(&file);
    child_stop(&child, NULL);
}

static void
by_hand_it_says_what_to_do_instead(void **state)
{
    (void)state;
    int out[2];
    assert_int_equal(pipe(out), 0);
    pid_t pid = fork();
    if (pid == 0) {
        dup2(out[1], STDERR_FILENO);
        close_range(3, ~0U, 0);
        execl(getenv("GLINT_WORKER"), "glint-worker", (char *)NULL);
        _exit(127);
    }
    close(out[1]);
    char text[512] = "";
    assert_true(read(out[0], text, sizeof text - 1) > 0);
    close(out[0]);
    int status;
    waitpid(pid, &status, 0);
    assert_int_equal(WEXITSTATUS(status), 2);
    assert_non_null(strstr(text, "glint render"));
}

static int
find_worker(void **state)
{
    (void)state;
    const char *build = getenv("GLINT_BUILD");
    char path[4096];
    snprintf(path, sizeof path, "%s/bin/glint-worker",
             build != NULL ? build : ".");
    return setenv("GLINT_WORKER", path, 0);
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ready_comes_before_the_image_library),
        cmocka_unit_test(a_scene_becomes_a_png_twice_the_same),
        cmocka_unit_test(an_exr_carries_every_layer),
        cmocka_unit_test(a_big_mesh_builds_behind_the_filter),
        cmocka_unit_test(cancel_is_heard_while_rendering),
        cmocka_unit_test(progress_comes_ten_times_a_second_at_most),
        cmocka_unit_test(
            garbage_fails_with_the_first_error_and_the_worker_lives),
        cmocka_unit_test(unsealed_files_are_refused_and_the_worker_lives),
        cmocka_unit_test(a_killed_worker_is_seen_at_once_and_replaced),
        cmocka_unit_test(it_leaves_when_nobody_listens_any_more),
        cmocka_unit_test(it_leaves_when_the_talk_makes_no_sense),
        cmocka_unit_test(it_dies_with_its_parent),
        cmocka_unit_test(it_knows_little_and_may_do_less),
        cmocka_unit_test(too_little_memory_is_an_answer),
        cmocka_unit_test(by_hand_it_says_what_to_do_instead),
    };
    return cmocka_run_group_tests(tests, find_worker, NULL);
}
