/* Blobs: whole or absent. */
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#include "core/base/log.h"
#include "server/blobs/blobs.h"

static struct blobs *blobs;
static char folder[PATH_MAX - 200], root[PATH_MAX - 100];

static int
set_up(void **state)
{
    (void)state;
    log_setup(LOG_WARN, LOG_AUTO);
    const char *build = getenv("GLINT_BUILD");
    snprintf(folder, sizeof folder, "%.1000s/blobs-test-XXXXXX",
             build != NULL && build[0] == '/' ? build : "/tmp");
    if (mkdtemp(folder) == NULL)
        return -1;
    snprintf(root, sizeof root, "%s/blobs", folder);
    struct error err = {0};
    blobs = blobs_open_dir(root, &err);
    return blobs == NULL ? -1 : 0;
}

static int
tear_down(void **state)
{
    (void)state;
    blobs_close(blobs);
    blobs = NULL;
    pid_t child = fork();
    if (child == 0) {
        execlp("rm", "rm", "-rf", folder, (char *)NULL);
        _exit(127);
    }
    int status;
    waitpid(child, &status, 0);
    return status;
}

static void
reopen(void)
{
    struct error err = {0};
    blobs_close(blobs);
    blobs = blobs_open_dir(root, &err);
    assert_non_null(blobs);
}

/* --- a put, waited for --- */

struct answer {
    pthread_mutex_t lock;
    pthread_cond_t wake;
    bool done;
    char sha256[SHA256_HEX_SIZE];
    uint64_t len;
    struct error err;
};

static void
put_done(void *user, const char sha256[SHA256_HEX_SIZE], uint64_t len,
         const struct error *err)
{
    struct answer *answer = user;
    pthread_mutex_lock(&answer->lock);
    memcpy(answer->sha256, sha256, strlen(sha256) + 1);
    answer->len = len;
    answer->err = *err;
    answer->done = true;
    pthread_cond_signal(&answer->wake);
    pthread_mutex_unlock(&answer->lock);
}

static int
memory_file(const void *data, size_t len)
{
    int fd = memfd_create("blob", MFD_CLOEXEC | MFD_ALLOW_SEALING);
    assert_true(fd >= 0);
    assert_int_equal(write(fd, data, len), (ssize_t)len);
    fcntl(fd, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE);
    return fd;
}

static struct answer
put_fd(int fd, uint64_t len)
{
    struct answer answer = {.lock = PTHREAD_MUTEX_INITIALIZER,
                            .wake = PTHREAD_COND_INITIALIZER};
    struct timespec deadline;
    clock_gettime(CLOCK_REALTIME, &deadline);
    deadline.tv_sec += 30;
    assert_true(blobs_put(blobs, fd, len, put_done, &answer, NULL));
    pthread_mutex_lock(&answer.lock);
    while (!answer.done)
        assert_int_equal(
            pthread_cond_timedwait(&answer.wake, &answer.lock, &deadline), 0);
    pthread_mutex_unlock(&answer.lock);
    return answer;
}

static struct answer
put(const void *data, size_t len)
{
    return put_fd(memory_file(data, len), len);
}

static void
path_of(const char *sha256, char path[PATH_MAX])
{
    snprintf(path, PATH_MAX, "%s/%.2s/%s", root, sha256, sha256);
}

static void
expect_bytes(const char *sha256, const void *data, size_t len)
{
    uint64_t found = 0;
    struct error err = {0};
    int fd = blobs_get(blobs, sha256, &found, &err);
    assert_true(fd >= 0);
    assert_int_equal(found, len);
    char *bytes = malloc(len + 1);
    size_t at = 0;
    ssize_t n;
    while ((n = read(fd, bytes + at, len + 1 - at)) > 0)
        at += (size_t)n;
    assert_int_equal(at, len);
    assert_memory_equal(bytes, data, len);
    free(bytes);
    close(fd);
}

static enum error_code
get_fails(const char *sha256)
{
    uint64_t len;
    struct error err = {0};
    int fd = blobs_get(blobs, sha256, &len, &err);
    assert_int_equal(fd, -1);
    assert_true(err.text[0] != '\0');
    return err.code;
}

/* --- tests --- */

static void
what_is_put_can_be_got(void **state)
{
    (void)state;
    static const size_t sizes[] = {0,      1, 4096, 256 * 1024, 256 * 1024 + 1,
                                   3 << 20};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        size_t len = sizes[i];
        unsigned char *data = malloc(len + 1);
        for (size_t k = 0; k < len; k++)
            data[k] = (unsigned char)(k * 31 + i);
        char want[SHA256_HEX_SIZE];
        sha256_of(data, len, want);
        struct answer answer = put(data, len);
        assert_int_equal(answer.err.code, ERROR_NONE);
        assert_string_equal(answer.sha256, want);
        assert_int_equal(answer.len, len);
        expect_bytes(want, data, len);
        reopen();
        expect_bytes(want, data, len);
        free(data);
    }
}

static void
only_the_announced_bytes_count(void **state)
{
    (void)state;
    char want[SHA256_HEX_SIZE];
    sha256_of("abc", 3, want);
    struct answer answer = put_fd(memory_file("abcdef", 6), 3);
    assert_string_equal(answer.sha256, want);
    expect_bytes(want, "abc", 3);
    answer = put_fd(memory_file("abc", 3), 4);
    assert_int_equal(answer.err.code, ERROR_IO);
    assert_string_equal(answer.sha256, "");
    assert_non_null(strstr(answer.err.text, "4 were announced"));
    /* It begins at 0, wherever the descriptor stands. */
    int fd = memory_file("abc", 3);
    lseek(fd, 2, SEEK_SET);
    answer = put_fd(fd, 3);
    assert_string_equal(answer.sha256, want);
}

static void
a_descriptor_that_cannot_be_read_is_an_error(void **state)
{
    (void)state;
    int ends[2];
    assert_int_equal(pipe(ends), 0);
    close(ends[1]);
    struct answer answer = put_fd(ends[0], 10);
    assert_int_equal(answer.err.code, ERROR_IO);
    assert_int_equal(fcntl(ends[0], F_GETFD), -1); /* taken over, closed */
}

static void
names_from_outside_never_become_paths(void **state)
{
    (void)state;
    static const char *const names[] = {
        "",
        "a",
        "../../../../../../../../../../../../../../../../../../etc/passwd",
        "ab/../../../../../../../../../../../../../../../../../etc/passwd",
        "0123456789ABCDEF0123456789abcdef0123456789abcdef0123456789abcdef",
        "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcde",
        "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef0",
        "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcde\n",
    };
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        assert_int_equal(get_fails(names[i]), ERROR_NOT_FOUND);
        blobs_delete(blobs, names[i]);
    }
    assert_int_equal(get_fails("0123456789abcdef0123456789abcdef"
                               "0123456789abcdef0123456789abcdef"),
                     ERROR_NOT_FOUND);
}

static void
a_link_is_not_followed(void **state)
{
    (void)state;
    char sha256[SHA256_HEX_SIZE], path[PATH_MAX];
    sha256_of("x", 1, sha256);
    path_of(sha256, path);
    assert_int_equal(symlink("/etc/passwd", path), 0);
    assert_int_equal(get_fails(sha256), ERROR_IO);
}

static void
damage_is_seen_and_healed(void **state)
{
    (void)state;
    char path[PATH_MAX];
    struct answer answer = put("precious", 8);
    expect_bytes(answer.sha256, "precious", 8);
    path_of(answer.sha256, path);

    /* Other bytes, same length, later time. */
    int fd = open(path, O_WRONLY);
    assert_int_equal(pwrite(fd, "X", 1, 3), 1);
    struct timespec later[2] = {{.tv_sec = 2000000000}, {.tv_sec = 2000000000}};
    futimens(fd, later);
    close(fd);
    assert_int_equal(get_fails(answer.sha256), ERROR_IO);
    assert_int_equal(get_fails(answer.sha256), ERROR_IO);

    /* Cut off. */
    assert_int_equal(truncate(path, 4), 0);
    assert_int_equal(get_fails(answer.sha256), ERROR_IO);
    reopen();
    assert_int_equal(get_fails(answer.sha256), ERROR_IO);

    /* The same bytes again: replaced, not taken for present. */
    answer = put("precious", 8);
    assert_int_equal(answer.err.code, ERROR_NONE);
    expect_bytes(answer.sha256, "precious", 8);
}

static void
damage_while_stopped_is_seen(void **state)
{
    (void)state;
    char path[PATH_MAX];
    struct stat st;
    struct answer answer = put("precious", 8);
    path_of(answer.sha256, path);
    assert_int_equal(stat(path, &st), 0);
    blobs_close(blobs);
    int fd = open(path, O_WRONLY);
    assert_int_equal(pwrite(fd, "X", 1, 3), 1);
    struct timespec same[2] = {st.st_atim, st.st_mtim};
    futimens(fd, same); /* bit rot changes no times */
    close(fd);
    blobs = blobs_open_dir(root, NULL);
    assert_int_equal(get_fails(answer.sha256), ERROR_IO);
}

static void
the_same_bytes_are_kept_once(void **state)
{
    (void)state;
    char path[PATH_MAX];
    struct stat before, after;
    struct answer answer = put("twice", 5);
    path_of(answer.sha256, path);
    assert_int_equal(stat(path, &before), 0);
    struct answer again = put("twice", 5);
    assert_string_equal(again.sha256, answer.sha256);
    assert_int_equal(again.err.code, ERROR_NONE);
    assert_int_equal(stat(path, &after), 0);
    assert_int_equal(before.st_ino, after.st_ino);
    assert_int_equal(after.st_mode & 077, 0);
}

static void
deleted_is_gone_and_may_come_back(void **state)
{
    (void)state;
    struct answer answer = put("gone", 4);
    uint64_t len;
    int fd = blobs_get(blobs, answer.sha256, &len, NULL);
    blobs_delete(blobs, answer.sha256);
    struct answer other = put("other", 5); /* queued behind the delete */
    assert_int_equal(other.err.code, ERROR_NONE);
    assert_int_equal(get_fails(answer.sha256), ERROR_NOT_FOUND);
    char bytes[8];
    assert_int_equal(read(fd, bytes, 8), 4); /* who reads, reads on */
    close(fd);
    answer = put("gone", 4);
    expect_bytes(answer.sha256, "gone", 4);
}

static void
count_incoming(unsigned *count)
{
    char path[PATH_MAX];
    *count = 0;
    for (int i = 0; i < 3000; i++) {
        snprintf(path, sizeof path, "%s/incoming/%d", root, i);
        *count += access(path, F_OK) == 0;
    }
}

/* A child is killed in the middle of putting; whatever is there under a name
 * of a blob is whole, and nothing is left half done. */
static void
a_crash_leaves_nothing_half_done(void **state)
{
    (void)state;
    enum { ROUNDS = 8, SIZE = 1 << 20 };
    unsigned char *data = calloc(1, SIZE);
    blobs_close(blobs);
    blobs = NULL;
    unsigned whole = 0, left = 0;
    for (unsigned round = 0; round < ROUNDS; round++) {
        int ends[2];
        assert_int_equal(pipe(ends), 0);
        pid_t child = fork();
        if (child == 0) {
            struct blobs *own = blobs_open_dir(root, NULL);
            for (unsigned i = 0; own != NULL && i < 100; i++) {
                memcpy(data, &round, sizeof round);
                memcpy(data + 8, &i, sizeof i);
                int fd = memory_file(data, SIZE);
                blobs_put(own, fd, SIZE, NULL, NULL, NULL);
                if (i == 3 && write(ends[1], "", 1) != 1)
                    _exit(1);
            }
            pause();
            _exit(0);
        }
        char byte;
        assert_int_equal(read(ends[0], &byte, 1), 1);
        usleep(round * 7000);
        kill(child, SIGKILL);
        waitpid(child, NULL, 0);
        close(ends[0]);
        close(ends[1]);
        unsigned incoming;
        count_incoming(&incoming);
        left += incoming;

        blobs = blobs_open_dir(root, NULL);
        assert_non_null(blobs);
        count_incoming(&incoming);
        assert_int_equal(incoming, 0);
        for (unsigned i = 0; i < 100; i++) {
            char sha256[SHA256_HEX_SIZE];
            memcpy(data, &round, sizeof round);
            memcpy(data + 8, &i, sizeof i);
            sha256_of(data, SIZE, sha256);
            uint64_t len;
            struct error err = {0};
            int fd = blobs_get(blobs, sha256, &len, &err);
            if (fd >= 0) {
                whole++;
                close(fd);
            } else {
                assert_int_equal(err.code, ERROR_NOT_FOUND);
            }
        }
        blobs_close(blobs);
        blobs = NULL;
    }
    print_message("%u whole, %u begun and removed\n", whole, left);
    assert_true(left > 0);
    blobs = blobs_open_dir(root, NULL);
    free(data);
}

static void
a_full_disk_is_an_error_and_passes(void **state)
{
    (void)state;
    struct rlimit before, tight;
    size_t len = 300 * 1024;
    char *data = calloc(1, len);
    int fd = memory_file(data, len);
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before);
    tight = before;
    tight.rlim_cur = 100 * 1024;
    setrlimit(RLIMIT_FSIZE, &tight);
    struct answer answer = put_fd(fd, len);
    setrlimit(RLIMIT_FSIZE, &before);
    assert_int_equal(answer.err.code, ERROR_STORAGE_FULL);
    unsigned incoming;
    count_incoming(&incoming);
    assert_int_equal(incoming, 0);
    answer = put(data, len);
    assert_int_equal(answer.err.code, ERROR_NONE);
    expect_bytes(answer.sha256, data, len);
    free(data);
}

static void
no_descriptor_leaks(void **state)
{
    (void)state;
    int before = dup(0);
    close(before);
    for (int i = 0; i < 50; i++) {
        struct answer answer = put(&i, sizeof i);
        expect_bytes(answer.sha256, &i, sizeof i);
        put_fd(memory_file("abc", 3), 99);
        get_fails("nonsense");
        blobs_delete(blobs, answer.sha256);
    }
    put("last", 4); /* the errands before it are done */
    reopen();
    int after = dup(0);
    close(after);
    assert_int_equal(after, before);
}

static void
closing_finishes_what_waits(void **state)
{
    (void)state;
    char sha256[20][SHA256_HEX_SIZE];
    for (int i = 0; i < 20; i++) {
        sha256_of(&i, sizeof i, sha256[i]);
        assert_true(blobs_put(blobs, memory_file(&i, sizeof i), sizeof i, NULL,
                              NULL, NULL));
    }
    reopen();
    for (int i = 0; i < 20; i++)
        expect_bytes(sha256[i], &i, sizeof i);
}

static void
space_is_told(void **state)
{
    (void)state;
    uint64_t free_bytes = 0, total = 0;
    assert_true(blobs_space(blobs, &free_bytes, &total, NULL));
    assert_true(total > 0 && free_bytes <= total);
}

static void
a_folder_that_cannot_be_made_says_why(void **state)
{
    (void)state;
    struct error err = {0};
    assert_null(blobs_open_dir("/proc/no/such", &err));
    assert_int_equal(err.code, ERROR_IO);
    char path[PATH_MAX];
    snprintf(path, sizeof path, "%s/file", folder);
    close(open(path, O_CREAT | O_WRONLY, 0600));
    err = (struct error){0};
    assert_null(blobs_open_dir(path, &err));
    assert_non_null(strstr(err.text, path));
}

int
main(void)
{
#define T(f) cmocka_unit_test_setup_teardown(f, set_up, tear_down)
    static const struct CMUnitTest tests[] = {
        T(what_is_put_can_be_got),
        T(only_the_announced_bytes_count),
        T(a_descriptor_that_cannot_be_read_is_an_error),
        T(names_from_outside_never_become_paths),
        T(a_link_is_not_followed),
        T(damage_is_seen_and_healed),
        T(damage_while_stopped_is_seen),
        T(the_same_bytes_are_kept_once),
        T(deleted_is_gone_and_may_come_back),
        T(a_crash_leaves_nothing_half_done),
        T(a_full_disk_is_an_error_and_passes),
        T(no_descriptor_leaks),
        T(closing_finishes_what_waits),
        T(space_is_told),
        T(a_folder_that_cannot_be_made_says_why),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
