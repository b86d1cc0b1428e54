/* child.h without a worker: programs that are not there, and peers that answer
 * out of turn. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "core/base/isa.h"
#include "server/worker/child.h"

static void
a_program_that_is_not_there_is_named(void **state)
{
    (void)state;
    setenv("GLINT_WORKER", "/nonexistent/glint-worker", 1);
    struct child child;
    struct error err = {0};
    assert_false(child_start(&child, 0, &err));
    assert_int_equal(err.code, ERROR_IO);
    assert_non_null(strstr(err.text, "/nonexistent/glint-worker"));
    assert_int_equal(child.pid, 0);
    /* No zombie is left of the fork. */
    assert_int_equal(waitpid(-1, NULL, WNOHANG), -1);
}

static void
stopping_what_never_started_is_harmless(void **state)
{
    (void)state;
    struct child child = {0};
    char how[64];
    child_stop(&child, how);
    child_stop(&child, NULL);
    assert_string_equal(how, "never started");
    assert_int_equal(write(STDOUT_FILENO, "", 0), 0); /* 0...2 stay open */
}

static void
one_that_ends_by_itself_tells_its_status(void **state)
{
    (void)state;
    setenv("GLINT_WORKER", "/bin/false", 1);
    struct child child;
    assert_true(child_start(&child, 0, NULL));
    struct message message;
    assert_int_equal(child_receive(&child, true, &message, NULL), WIRE_CLOSED);
    usleep(100000); /* the socket closes a moment before the process ends */
    char how[64];
    child_stop(&child, how);
    assert_string_equal(how, "exited with status 1");
}

/* A child whose other end is in our hand. */
static struct child
puppet(int *theirs)
{
    int pair[2];
    assert_int_equal(
        socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair), 0);
    *theirs = pair[1];
    return (struct child){.pid = getpid(), .pidfd = -1, .socket = pair[0]};
}

static struct message
honest_ready(void)
{
    struct message message = {.kind = MESSAGE_READY};
    struct message_ready *ready = &message.body.ready;
    snprintf(ready->version, sizeof ready->version, "%s", glint_version);
    snprintf(ready->build, sizeof ready->build, "%s", glint_build);
    isa_class(ready->isa);
    return message;
}

static void
expect(struct child *child, int theirs, const struct message *sent,
       enum wire_status status, const char *word)
{
    struct message message;
    struct error err = {0};
    assert_true(wire_send(theirs, sent, &err));
    assert_int_equal(child_receive(child, false, &message, &err), status);
    if (strstr(err.text, word) == NULL)
        fail_msg("\"%s\" does not speak of \"%s\"", err.text, word);
    message_clear(&message);
}

static void
ready_comes_once_and_from_our_own_build(void **state)
{
    (void)state;
    int theirs;
    struct child child = puppet(&theirs);
    struct message ready = honest_ready();
    strcpy(ready.body.ready.build, "another");
    expect(&child, theirs, &ready, WIRE_BROKEN, "build another");
    ready = honest_ready();
    strcpy(ready.body.ready.isa, "pdp11");
    expect(&child, theirs, &ready, WIRE_BROKEN, "pdp11");
    assert_false(child.ready);
    ready = honest_ready();
    expect(&child, theirs, &ready, WIRE_MESSAGE, "");
    assert_true(child.ready);
    assert_string_equal(child.about.version, glint_version);
    expect(&child, theirs, &ready, WIRE_BROKEN, "twice");
    close(theirs);
    close(child.socket);
}

static void
answers_must_be_about_the_ask_under_way(void **state)
{
    (void)state;
    int theirs;
    struct child child = puppet(&theirs);
    struct message ready = honest_ready();
    struct message failed = {
        .kind = MESSAGE_FAILED, .ask = 1, .body.failed = {ERROR_IO, "x"}};
    struct message progress = {.kind = MESSAGE_PROGRESS, .ask = 1};
    struct message cancel = {.kind = MESSAGE_CANCEL, .ask = 1};
    struct message message;
    struct error err = {0};
    assert_false(child_render(&child, "{}", 2, "{}", 2, 1, &err));
    assert_non_null(strstr(err.text, "not ready"));
    expect(&child, theirs, &ready, WIRE_MESSAGE, "");
    expect(&child, theirs, &failed, WIRE_BROKEN, "answered ask 1");

    assert_true(child_cancel(&child, NULL)); /* about nothing: says nothing */
    assert_true(child_render(&child, "{}", 2, "{}", 2, 3, NULL));
    assert_true(child.busy);
    assert_false(child_render(&child, "{}", 2, "{}", 2, 1, NULL));
    assert_int_equal(wire_receive(theirs, false, &message, NULL), WIRE_MESSAGE);
    assert_int_equal(message.kind, MESSAGE_RENDER);
    assert_int_equal(message.body.threads.threads, 3);
    message_clear(&message);

    expect(&child, theirs, &cancel, WIRE_BROKEN, "does not come from");
    progress.ask = 2;
    expect(&child, theirs, &progress, WIRE_BROKEN, "answered ask 2");
    progress.ask = 1;
    expect(&child, theirs, &progress, WIRE_MESSAGE, "");
    assert_true(child.busy);
    expect(&child, theirs, &failed, WIRE_MESSAGE, "");
    assert_false(child.busy);
    expect(&child, theirs, &failed, WIRE_BROKEN, "answered ask 1");
    close(theirs);
    close(child.socket);
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_program_that_is_not_there_is_named),
        cmocka_unit_test(stopping_what_never_started_is_harmless),
        cmocka_unit_test(one_that_ends_by_itself_tells_its_status),
        cmocka_unit_test(ready_comes_once_and_from_our_own_build),
        cmocka_unit_test(answers_must_be_about_the_ask_under_way),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
