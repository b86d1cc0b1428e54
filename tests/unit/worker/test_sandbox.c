/* What a worker has given up: tried from inside, in a process of its own. */
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#include "core/image/image.h"
#include "server/worker/sandbox.h"

/* Inside the process under test nothing may assert: each attempt that comes
 * out otherwise than it should is counted by its line. */
static int wrong_line;
#define EXPECT(condition)                                                      \
    do {                                                                       \
        if (!(condition) && wrong_line == 0)                                   \
            wrong_line = __LINE__;                                             \
    } while (0)

static void
try_what_is_forbidden(void)
{
    EXPECT(socket(AF_INET, SOCK_STREAM, 0) == -1 && errno == EPERM);
    EXPECT(socket(AF_UNIX, SOCK_STREAM, 0) == -1 && errno == EPERM);
    EXPECT(fork() == -1);
    EXPECT(open("/tmp/glint-sandbox-test", O_WRONLY | O_CREAT, 0600) == -1);
    EXPECT(open("/dev/null", O_RDWR) == -1);
    EXPECT(open("/dev/null", O_RDONLY | O_TRUNC) == -1);
    EXPECT(unlink("/tmp/glint-sandbox-none") == -1 && errno == EPERM);
    EXPECT(mkdir("/tmp/glint-sandbox-dir", 0700) == -1 && errno == EPERM);
    EXPECT(kill(getppid(), 0) == -1 && errno == EPERM);
    EXPECT(ptrace(PTRACE_ATTACH, getppid(), 0, 0) == -1 && errno == EPERM);
    char *argv[] = {(char *)(uintptr_t) "/bin/true", NULL};
    EXPECT(execve("/bin/true", argv, argv + 1) == -1 && errno == EPERM);
    struct rlimit more = {1024, 1024};
    EXPECT(setrlimit(RLIMIT_NOFILE, &more) == -1);
    EXPECT(prctl(PR_SET_PDEATHSIG, 0) == -1);
    EXPECT(prctl(PR_SET_DUMPABLE, 1) == -1);
    EXPECT(prctl(PR_GET_NO_NEW_PRIVS, 0, 0, 0, 0) == -1); /* not in the list */
    struct rlimit core;
    EXPECT(getrlimit(RLIMIT_CORE, &core) == 0 && core.rlim_max == 0);
}

static void *
idle(void *nothing)
{
    return nothing;
}

static void
try_what_is_needed(void)
{
    pthread_t thread;
    EXPECT(pthread_create(&thread, NULL, idle, NULL) == 0);
    EXPECT(pthread_join(thread, NULL) == 0);
    int fd = memfd_create("test", MFD_CLOEXEC | MFD_ALLOW_SEALING);
    EXPECT(fd >= 0 && write(fd, "x", 1) == 1);
    EXPECT(fcntl(fd, F_ADD_SEALS, F_SEAL_WRITE) == 0);
    close(fd);
    void *memory = mmap(NULL, 1 << 20, PROT_READ | PROT_WRITE,
                        MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    EXPECT(memory != MAP_FAILED && munmap(memory, 1 << 20) == 0);
}

static void
try_files_after_tightening(void)
{
    EXPECT(open("/etc/passwd", O_RDONLY) == -1 && errno == EACCES);
    EXPECT(access("/etc/passwd", R_OK) == -1 && errno == EACCES);
    char link[8];
    EXPECT(readlink("/proc/self/exe", link, sizeof link) == -1);
    struct stat st;
    EXPECT(stat("/", &st) == -1);
    EXPECT(fstat(0, &st) == 0);
    EXPECT(mmap(NULL, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS,
                -1, 0) == MAP_FAILED);
}

static void
encode_something(enum image_format format, enum image_sample sample)
{
    float pixels[48] = {0};
    struct image image = {.width = 4,
                          .height = 4,
                          .channel_count = 3,
                          .names = {"R", "G", "B"},
                          .data = pixels,
                          .sample = sample};
    struct bytes bytes = {0};
    struct error err = {0};
    EXPECT(image_encode(&image, format, &bytes, &err));
    if (err.code != ERROR_NONE)
        fprintf(stderr, "%s\n", err.text);
    bytes_clear(&bytes);
}

/* As main.c does it. */
_Noreturn static void
be_sandboxed(void)
{
    int pair[2];
    socketpair(AF_UNIX, SOCK_SEQPACKET, 0, pair);
    if (pair[0] != 3)
        dup2(pair[0], 3);
    dup2(1, 4);
    sandbox_enter(3);
    EXPECT(fcntl(4, F_GETFD) == -1); /* was open before */
    image_codec_load();
    sandbox_tighten();
    try_what_is_forbidden();
    try_what_is_needed();
    while (!image_codec_settled())
        usleep(1000);
    sandbox_tighten();
    sandbox_tighten();
    try_what_is_forbidden();
    try_files_after_tightening();
    try_what_is_needed();
    /* The image library works though it loaded and runs behind the filters. */
    encode_something(IMAGE_PNG, IMAGE_UINT8);
    encode_something(IMAGE_EXR, IMAGE_HALF);
    if (wrong_line != 0)
        fprintf(stderr, "sandbox: line %d did not hold\n", wrong_line);
    fflush(stderr);
    _exit(wrong_line != 0);
}

static void
the_sandbox_holds_and_leaves_what_is_needed(void **state)
{
    (void)state;
    pid_t pid = fork();
    if (pid == 0)
        be_sandboxed();
    int status;
    assert_int_equal(waitpid(pid, &status, 0), pid);
    assert_int_equal(status, 0);
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_sandbox_holds_and_leaves_what_is_needed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
