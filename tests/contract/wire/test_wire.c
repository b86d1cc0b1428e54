/* The wire, with a hostile peer at the other end: what is sent is received,
 * everything else is refused, and no descriptor is lost on the way. */
#include <errno.h>
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/worker/wire.h"

struct talk {
    int ours, theirs;
    int open_before;
};

static int
open_descriptors(void)
{
    int count = 0;
    for (int fd = 0; fd < 256; fd++)
        count += fcntl(fd, F_GETFD) >= 0;
    return count;
}

static int
set_up(void **state)
{
    struct talk *talk = calloc(1, sizeof *talk);
    int pair[2];
    talk->open_before = open_descriptors();
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair) != 0)
        return -1;
    talk->ours = pair[0];
    talk->theirs = pair[1];
    *state = talk;
    return 0;
}

/* Every test also checks that it left no descriptor behind. */
static int
tear_down(void **state)
{
    struct talk *talk = *state;
    close(talk->ours);
    if (talk->theirs >= 0)
        close(talk->theirs);
    bool clean = open_descriptors() == talk->open_before;
    if (!clean)
        fprintf(stderr, "descriptors leaked: %d before, %d after\n",
                talk->open_before, open_descriptors());
    free(talk);
    return clean ? 0 : -1;
}

static struct message
ready_message(void)
{
    struct message message = {.kind = MESSAGE_READY};
    strcpy(message.body.ready.version, "0.1.0");
    strcpy(message.body.ready.build, "abc");
    strcpy(message.body.ready.isa, "other");
    return message;
}

/* The bytes of a record as wire.c sends it, caught on the way. */
static size_t
record_bytes(struct talk *talk, const struct message *message, void *bytes,
             size_t size)
{
    assert_true(wire_send(talk->theirs, message, NULL));
    ssize_t got = recv(talk->ours, bytes, size, 0);
    assert_true(got > 0);
    return (size_t)got;
}

static void
raw_send(int socket, const void *bytes, size_t len, const int *fds,
         size_t fd_count)
{
    struct iovec part = {(void *)(uintptr_t)bytes, len};
    struct msghdr header = {.msg_iov = &part, .msg_iovlen = 1};
    char control[CMSG_SPACE(16 * sizeof(int))] = {0};
    if (fd_count > 0) {
        header.msg_control = control;
        header.msg_controllen = CMSG_SPACE(fd_count * sizeof(int));
        struct cmsghdr *item = CMSG_FIRSTHDR(&header);
        item->cmsg_level = SOL_SOCKET;
        item->cmsg_type = SCM_RIGHTS;
        item->cmsg_len = CMSG_LEN(fd_count * sizeof(int));
        memcpy(CMSG_DATA(item), fds, fd_count * sizeof(int));
    }
    assert_int_equal(sendmsg(socket, &header, MSG_NOSIGNAL), len);
}

static void
expect_broken(struct talk *talk, const char *word)
{
    struct message message;
    struct error err = {0};
    assert_int_equal(wire_receive(talk->ours, false, &message, &err),
                     WIRE_BROKEN);
    assert_int_equal(err.code, ERROR_PROTOCOL);
    if (strstr(err.text, word) == NULL)
        fail_msg("\"%s\" does not speak of \"%s\"", err.text, word);
    assert_int_equal(message.kind, 0);
    assert_int_equal(message.fd_count, 0);
}

static void
each_kind_arrives_as_it_was_sent(void **state)
{
    struct talk *talk = *state;
    int files[2] = {wire_memfd("a", "scene", 5, NULL),
                    wire_memfd("b", "output", 6, NULL)};
    struct message sent[] = {
        ready_message(),
        {.kind = MESSAGE_PROGRESS,
         .ask = 7,
         .body.progress = {STAGE_TRACING, 3, 9, 123456789012}},
        {.kind = MESSAGE_DONE,
         .ask = 7,
         .body.done = {.width = 640,
                       .height = 480,
                       .rays = {1, 2, 3},
                       .trace_ms = 12.5,
                       .peak_bytes = 1 << 20},
         .fds = {files[0]},
         .fd_count = 1},
        {.kind = MESSAGE_FAILED,
         .ask = 7,
         .body.failed = {ERROR_CANCELED, "canceled"}},
        {.kind = MESSAGE_RENDER,
         .ask = UINT32_MAX,
         .body.threads = {2},
         .fds = {files[0], files[1]},
         .fd_count = 2},
        {.kind = MESSAGE_CANCEL, .ask = 7},
        {.kind = MESSAGE_THREADS, .ask = 7, .body.threads = {16}},
    };
    for (size_t i = 0; i < sizeof sent / sizeof sent[0]; i++) {
        struct message got;
        struct error err = {0};
        assert_true(wire_send(talk->theirs, &sent[i], &err));
        assert_int_equal(wire_receive(talk->ours, true, &got, &err),
                         WIRE_MESSAGE);
        assert_int_equal(got.kind, sent[i].kind);
        assert_int_equal(got.ask, sent[i].ask);
        assert_int_equal(got.fd_count, sent[i].fd_count);
        assert_memory_equal(&got.body, &sent[i].body, sizeof got.body);
        for (uint32_t f = 0; f < got.fd_count; f++) {
            assert_int_equal(fcntl(got.fds[f], F_GETFD), FD_CLOEXEC);
            const void *data;
            size_t len;
            assert_true(wire_map(got.fds[f], 100, &data, &len, &err));
            assert_memory_equal(data, f == 0 ? "scene" : "output", len);
            wire_unmap(data, len);
        }
        message_clear(&got);
    }
    close(files[0]);
    close(files[1]);
}

static void
nothing_there_is_said_at_once(void **state)
{
    struct talk *talk = *state;
    struct message message;
    assert_int_equal(wire_receive(talk->ours, false, &message, NULL),
                     WIRE_NOTHING);
}

static void
waiting_works_on_a_non_blocking_socket(void **state)
{
    struct talk *talk = *state;
    fcntl(talk->ours, F_SETFL, O_NONBLOCK);
    pid_t pid = fork();
    if (pid == 0) {
        usleep(50000);
        struct message message = ready_message();
        _exit(wire_send(talk->theirs, &message, NULL) ? 0 : 1);
    }
    struct message message;
    assert_int_equal(wire_receive(talk->ours, true, &message, NULL),
                     WIRE_MESSAGE);
    message_clear(&message);
}

static void
a_closed_peer_is_told_from_silence(void **state)
{
    struct talk *talk = *state;
    close(talk->theirs);
    talk->theirs = -1;
    struct message message;
    struct error err = {0};
    assert_int_equal(wire_receive(talk->ours, false, &message, NULL),
                     WIRE_CLOSED);
    assert_int_equal(wire_receive(talk->ours, true, &message, NULL),
                     WIRE_CLOSED);
    message = ready_message();
    assert_false(wire_send(talk->ours, &message, &err)); /* and no SIGPIPE */
    assert_int_equal(err.code, ERROR_IO);
}

static void
last_words_are_heard_though_ours_went_unread(void **state)
{
    struct talk *talk = *state;
    struct message unread = {.kind = MESSAGE_CANCEL, .ask = 1};
    struct message last = {.kind = MESSAGE_FAILED,
                           .ask = 1,
                           .body.failed = {ERROR_MEMORY, "no memory"}};
    struct message message;
    assert_true(wire_send(talk->ours, &unread, NULL));
    assert_true(wire_send(talk->theirs, &last, NULL));
    close(talk->theirs);
    talk->theirs = -1;
    assert_int_equal(wire_receive(talk->ours, false, &message, NULL),
                     WIRE_MESSAGE);
    assert_string_equal(message.body.failed.text, "no memory");
    assert_int_equal(wire_receive(talk->ours, false, &message, NULL),
                     WIRE_CLOSED);
}

static void
a_full_line_is_an_error_and_no_wait(void **state)
{
    struct talk *talk = *state;
    fcntl(talk->ours, F_SETFL, O_NONBLOCK);
    struct message message = {.kind = MESSAGE_CANCEL, .ask = 1};
    struct error err = {0};
    int sent = 0;
    while (sent < 100000 && wire_send(talk->ours, &message, &err))
        sent++;
    assert_in_range(sent, 10, 99999);
    assert_int_equal(err.code, ERROR_IO);
}

static void
every_other_size_is_refused(void **state)
{
    struct talk *talk = *state;
    char bytes[4096] = {0};
    struct message message = {.kind = MESSAGE_CANCEL, .ask = 1};
    size_t whole = record_bytes(talk, &message, bytes, sizeof bytes);
    int null = open("/dev/null", O_RDONLY | O_CLOEXEC);
    for (size_t len = 1; len <= whole + 64; len++) {
        if (len == whole)
            continue;
        raw_send(talk->theirs, bytes, len, &null, len % 2);
        expect_broken(talk, "bytes");
    }
    close(null);
    raw_send(talk->theirs, bytes, sizeof bytes, NULL, 0);
    expect_broken(talk, "bytes");
    raw_send(talk->theirs, bytes, whole, NULL, 0);
    assert_int_equal(wire_receive(talk->ours, false, &message, NULL),
                     WIRE_MESSAGE);
}

/* Overwrite four bytes of an honest record and expect it refused. */
static void
expect_refused_with(struct talk *talk, struct message message, size_t at,
                    uint32_t value, const char *word)
{
    char bytes[4096];
    int fd = wire_memfd("x", "x", 1, NULL);
    for (uint32_t i = 0; i < message.fd_count; i++)
        message.fds[i] = fd;
    /* Caught with recv, so the kernel closes what travelled beside it. */
    size_t len = record_bytes(talk, &message, bytes, sizeof bytes);
    memcpy(bytes + at, &value, sizeof value);
    int fds[WIRE_FD_MAX] = {fd, fd};
    raw_send(talk->theirs, bytes, len, fds, message.fd_count);
    expect_broken(talk, word);
    close(fd);
}

static void
wrong_heads_are_refused(void **state)
{
    struct talk *talk = *state;
    struct message cancel = {.kind = MESSAGE_CANCEL, .ask = 1};
    expect_refused_with(talk, cancel, 0, 0xdeadbeef, "begin with");
    expect_refused_with(talk, cancel, 4, WIRE_VERSION + 1, "version");
    expect_refused_with(talk, cancel, 4, 0, "version");
    expect_refused_with(talk, cancel, 8, 0, "kind");
    expect_refused_with(talk, cancel, 8, MESSAGE_KIND_COUNT, "kind");
    expect_refused_with(talk, cancel, 8, UINT32_MAX, "kind");
    expect_refused_with(talk, cancel, 12, 0, "ask");
    expect_refused_with(talk, ready_message(), 12, 5, "ask");
}

static const struct message done = {
    .kind = MESSAGE_DONE,
    .ask = 1,
    .body.done = {.width = 1, .height = 1},
    .fd_count = 1,
};

static void
wrong_bodies_are_refused(void **state)
{
    struct talk *talk = *state;
    size_t body = 16;
    struct message progress = {.kind = MESSAGE_PROGRESS, .ask = 1};
    struct message failed = {
        .kind = MESSAGE_FAILED, .ask = 1, .body.failed = {ERROR_IO, "x"}};
    struct message render = {
        .kind = MESSAGE_RENDER, .ask = 1, .body.threads = {1}, .fd_count = 2};
    struct message threads = {
        .kind = MESSAGE_THREADS, .ask = 1, .body.threads = {1}};
    expect_refused_with(talk, progress, body, STAGE_ENCODING + 1, "PROGRESS");
    expect_refused_with(talk, progress, body + 4, 1, "PROGRESS"); /* 1 of 0 */
    expect_refused_with(talk, failed, body, ERROR_NONE, "FAILED");
    expect_refused_with(talk, failed, body, ERROR_CODE_COUNT, "FAILED");
    expect_refused_with(talk, render, body, 0, "RENDER");
    expect_refused_with(talk, threads, body, 0, "THREADS");
    expect_refused_with(talk, done, body, 0, "DONE");     /* width */
    expect_refused_with(talk, done, body + 4, 0, "DONE"); /* height */
    /* A NaN and a negative duration: the high half of a double. */
    size_t load_ms = body + offsetof(struct message_done, load_ms);
    expect_refused_with(talk, done, load_ms + 4, 0x7ff80000, "DONE");
    expect_refused_with(talk, done, load_ms + 4, 0xbff00000, "DONE");
    expect_refused_with(talk, done, load_ms + 4, 0x7ff00000, "DONE");
}

static void
texts_without_an_end_are_refused(void **state)
{
    struct talk *talk = *state;
    char bytes[4096];
    struct message failed = {
        .kind = MESSAGE_FAILED, .ask = 1, .body.failed = {ERROR_IO, "x"}};
    size_t len = record_bytes(talk, &failed, bytes, sizeof bytes);
    memset(bytes + 20, 'a', len - 20);
    raw_send(talk->theirs, bytes, len, NULL, 0);
    expect_broken(talk, "FAILED");
    struct message ready = ready_message();
    len = record_bytes(talk, &ready, bytes, sizeof bytes);
    memset(bytes + 16, 'a', len - 16);
    raw_send(talk->theirs, bytes, len, NULL, 0);
    expect_broken(talk, "READY");
}

static void
a_wrong_number_of_descriptors_is_refused(void **state)
{
    struct talk *talk = *state;
    char bytes[4096];
    int fds[16];
    for (int i = 0; i < 16; i++)
        fds[i] = open("/dev/null", O_RDONLY | O_CLOEXEC);
    struct message cancel = {.kind = MESSAGE_CANCEL, .ask = 1};
    size_t len = record_bytes(talk, &cancel, bytes, sizeof bytes);
    for (size_t count = 1; count <= 16; count++) {
        raw_send(talk->theirs, bytes, len, fds, count);
        expect_broken(talk, "descriptors");
    }
    struct message one = done;
    one.fds[0] = fds[0];
    len = record_bytes(talk, &one, bytes, sizeof bytes);
    for (size_t count = 0; count <= 16; count++) {
        if (count == 1)
            continue;
        raw_send(talk->theirs, bytes, len, fds, count);
        expect_broken(talk, "descriptors");
    }
    for (int i = 0; i < 16; i++)
        close(fds[i]);
}

static void
what_must_not_be_sent_is_not(void **state)
{
    struct talk *talk = *state;
    struct error err = {0};
    struct message message = {.kind = MESSAGE_THREADS, .ask = 1};
    assert_false(wire_send(talk->ours, &message, &err));
    assert_int_equal(err.code, ERROR_PROTOCOL);
    assert_int_equal(wire_receive(talk->theirs, false, &message, NULL),
                     WIRE_NOTHING);
}

/* A memory file with these seals. */
static int
file_with(unsigned seals, size_t len)
{
    int fd = memfd_create("test", MFD_CLOEXEC | MFD_ALLOW_SEALING);
    assert_true(fd >= 0);
    assert_int_equal(ftruncate(fd, (off_t)len), 0);
    assert_int_equal(fcntl(fd, F_ADD_SEALS, seals), 0);
    return fd;
}

static void
memory_files_must_be_sealed(void **state)
{
    (void)state;
    const unsigned all = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE;
    const unsigned bad[] = {0,
                            F_SEAL_SHRINK,
                            F_SEAL_SHRINK | F_SEAL_GROW,
                            F_SEAL_SHRINK | F_SEAL_WRITE,
                            F_SEAL_GROW | F_SEAL_WRITE,
                            F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_FUTURE_WRITE};
    const void *data;
    size_t len;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct error err = {0};
        int fd = file_with(bad[i], 10);
        assert_false(wire_map(fd, 100, &data, &len, &err));
        assert_int_equal(err.code, ERROR_PROTOCOL);
        close(fd);
    }
    int fd = file_with(all, 10);
    assert_true(wire_map(fd, 100, &data, &len, NULL));
    assert_int_equal(len, 10);
    wire_unmap(data, len);
    close(fd);
}

static void
other_descriptors_are_no_memory_files(void **state)
{
    struct talk *talk = *state;
    const void *data;
    size_t len;
    struct error err = {0};
    int null = open("/dev/null", O_RDONLY | O_CLOEXEC);
    int file = open("/proc/self/exe", O_RDONLY | O_CLOEXEC);
    assert_false(wire_map(null, 100, &data, &len, &err));
    assert_int_equal(err.code, ERROR_PROTOCOL);
    assert_false(wire_map(file, 1 << 30, &data, &len, NULL));
    assert_false(wire_map(talk->ours, 100, &data, &len, NULL));
    assert_false(wire_map(-1, 100, &data, &len, NULL));
    close(null);
    close(file);
}

static void
memory_files_have_a_limit(void **state)
{
    (void)state;
    const void *data;
    size_t len;
    struct error err = {0};
    int fd = wire_memfd("test", "0123456789", 10, NULL);
    assert_false(wire_map(fd, 9, &data, &len, &err));
    assert_int_equal(err.code, ERROR_TOO_LARGE);
    assert_non_null(strstr(err.text, "9 bytes, got 10"));
    assert_true(wire_map(fd, 10, &data, &len, NULL));
    assert_memory_equal(data, "0123456789", 10);
    wire_unmap(data, len);
    close(fd);
    /* A hole of a tebibyte costs its maker nothing, and us a refusal. */
    fd = file_with(F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE, (size_t)1 << 40);
    assert_false(wire_map(fd, 1 << 20, &data, &len, NULL));
    close(fd);
}

static void
our_memory_files_cannot_be_changed(void **state)
{
    (void)state;
    int fd = wire_memfd("test", "abc", 3, NULL);
    assert_int_equal(write(fd, "x", 1), -1);
    assert_int_equal(ftruncate(fd, 0), -1);
    assert_int_equal(fcntl(fd, F_GETFD), FD_CLOEXEC);
    assert_true(mmap(NULL, 3, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0) ==
                MAP_FAILED);
    close(fd);
    const void *data;
    size_t len;
    fd = wire_memfd("empty", NULL, 0, NULL);
    assert_true(wire_map(fd, 0, &data, &len, NULL));
    assert_int_equal(len, 0);
    assert_string_equal(data, "");
    wire_unmap(data, len);
    close(fd);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)

int
main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(each_kind_arrives_as_it_was_sent),
        TEST(nothing_there_is_said_at_once),
        TEST(waiting_works_on_a_non_blocking_socket),
        TEST(a_closed_peer_is_told_from_silence),
        TEST(last_words_are_heard_though_ours_went_unread),
        TEST(a_full_line_is_an_error_and_no_wait),
        TEST(every_other_size_is_refused),
        TEST(wrong_heads_are_refused),
        TEST(wrong_bodies_are_refused),
        TEST(texts_without_an_end_are_refused),
        TEST(a_wrong_number_of_descriptors_is_refused),
        TEST(what_must_not_be_sent_is_not),
        TEST(memory_files_must_be_sealed),
        TEST(other_descriptors_are_no_memory_files),
        TEST(memory_files_have_a_limit),
        TEST(our_memory_files_cannot_be_changed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
