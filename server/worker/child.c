#include "server/worker/child.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/pidfd.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/base/isa.h"

enum {
    SOCKET_FD = 3, /* where the worker looks for its socket */
    REPORT_FD = 4, /* where exec's failure comes back; closed by exec */
    SAFE_FD = 10,  /* descriptors made before the fork lie from here on, so
                      that putting them in place overwrites none of them */
    ENV_MAX = 12
};

/* Sanitizers reserve terabytes of addresses: no limit on those with them. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
enum { SANITIZED = 1 };
#elif defined(__has_feature)
enum {
    SANITIZED =
        __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
};
#else
enum { SANITIZED = 0 };
#endif

/* What a worker may know of our environment. */
static const char *const env_kept[] = {
    "PATH",         "GLINT_IMAGE_MODULE", "ASAN_OPTIONS",
    "LSAN_OPTIONS", "TSAN_OPTIONS",       "UBSAN_OPTIONS",
};

/* All that the new process needs, made before the fork: between fork and exec
 * only async-signal-safe calls are allowed, for the caller may have threads. */
struct plan {
    char program[PATH_MAX];
    char env_text[ENV_MAX][PATH_MAX];
    char *env[ENV_MAX + 1];
    char *argv[2];
    int socket, report, null;
    uint64_t memory_limit;
    pid_t parent;
};

static bool
find_program(char path[PATH_MAX], struct error *err)
{
    const char *named = getenv("GLINT_WORKER");
    if (named != NULL && named[0] != '\0') {
        if (snprintf(path, PATH_MAX, "%s", named) >= PATH_MAX)
            return error_set(err, ERROR_IO, "GLINT_WORKER is too long a path");
        return true;
    }
    static const char name[] = "glint-worker";
    ssize_t len = readlink("/proc/self/exe", path, PATH_MAX - sizeof name - 1);
    if (len <= 0)
        return error_errno(err, ERROR_IO, errno,
                           "cannot find the folder of this program");
    path[len] = '\0';
    char *slash = strrchr(path, '/');
    if (slash == NULL)
        return error_set(err, ERROR_IO, "this program has no folder: %s", path);
    memcpy(slash + 1, name, sizeof name);
    return true;
}

static bool
plan_env(struct plan *plan, struct error *err)
{
    size_t count = 0;
    for (size_t i = 0; i < sizeof env_kept / sizeof env_kept[0]; i++) {
        const char *value = getenv(env_kept[i]);
        if (value == NULL)
            continue;
        int len = snprintf(plan->env_text[count], PATH_MAX, "%s=%s",
                           env_kept[i], value);
        if (len >= PATH_MAX)
            return error_set(err, ERROR_IO,
                             "the environment variable %s must be under %d "
                             "bytes, got %zu",
                             env_kept[i], PATH_MAX, strlen(value));
        plan->env[count] = plan->env_text[count];
        count++;
    }
    snprintf(plan->env_text[count], PATH_MAX, "LANG=C");
    plan->env[count] = plan->env_text[count];
    plan->env[count + 1] = NULL;
    return true;
}

/* Replace fd by a close-on-exec copy at SAFE_FD or above. */
static bool
move_up(int *fd, struct error *err)
{
    int high = fcntl(*fd, F_DUPFD_CLOEXEC, SAFE_FD);
    int cause = errno;
    close(*fd);
    *fd = high;
    if (high < 0)
        return error_errno(err, ERROR_IO, cause,
                           "cannot copy a descriptor for a worker");
    return true;
}

_Noreturn static void
give_up(int report)
{
    int cause = errno;
    ssize_t ignored = write(report, &cause, sizeof cause);
    (void)ignored;
    _exit(127);
}

/* A worker starts with no signal blocked, caught or ignored. */
static void
reset_signals(void)
{
    struct sigaction standard = {.sa_handler = SIG_DFL};
    for (int i = 1; i < NSIG; i++)
        sigaction(i, &standard, NULL); /* KILL and STOP refuse: fine */
    sigset_t none;
    sigemptyset(&none);
    pthread_sigmask(SIG_SETMASK, &none, NULL);
}

/* The child's side of the fork: no malloc, no stdio, no way back. */
_Noreturn static void
become_worker(const struct plan *plan)
{
    /* Die with the parent; if it died before we asked, we would never know. */
    if (prctl(PR_SET_PDEATHSIG, SIGKILL) != 0)
        give_up(plan->report);
    if (getppid() != plan->parent)
        _exit(127);
    /* A session of its own: no terminal, so no Ctrl-C from it, and no writing
     * into its input either. */
    setsid();
    reset_signals();
    if (dup2(plan->null, STDIN_FILENO) < 0 ||
        dup2(plan->null, STDOUT_FILENO) < 0 ||
        dup2(plan->socket, SOCKET_FD) < 0 ||
        dup3(plan->report, REPORT_FD, O_CLOEXEC) < 0)
        give_up(plan->report);
    close_range(REPORT_FD + 1, ~0U, 0);
    if (plan->memory_limit > 0 && !SANITIZED) {
        struct rlimit limit = {plan->memory_limit, plan->memory_limit};
        if (setrlimit(RLIMIT_AS, &limit) != 0)
            give_up(REPORT_FD);
    }
    execve(plan->program, plan->argv, plan->env);
    give_up(REPORT_FD);
}

/* Fork with all signals held back, so that no handler of ours ever runs in the
 * child, where it would write into pipes that belong to the parent. */
static pid_t
fork_quietly(const struct plan *plan)
{
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    pid_t pid = fork();
    if (pid == 0)
        become_worker(plan);
    int cause = errno;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    errno = cause;
    return pid;
}

/* Wait until exec has closed the report pipe, or a cause came through it. */
static bool
exec_worked(int report, const struct plan *plan, struct error *err)
{
    int cause = 0;
    ssize_t got;
    do {
        got = read(report, &cause, sizeof cause);
    } while (got < 0 && errno == EINTR);
    if (got == (ssize_t)sizeof cause)
        return error_errno(err, ERROR_IO, cause, "cannot start %s",
                           plan->program);
    return true;
}

static void
close_fd(int *fd)
{
    if (*fd >= 0)
        close(*fd);
    *fd = -1;
}

static bool
make_socket(struct child *child, struct plan *plan, struct error *err)
{
    int pair[2];
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair) != 0)
        return error_errno(err, ERROR_IO, errno,
                           "cannot make a socket for a worker");
    child->socket = pair[0];
    plan->socket = pair[1];
    if (!move_up(&plan->socket, err))
        return false;
    if (fcntl(child->socket, F_SETFL, O_NONBLOCK) != 0)
        return error_errno(err, ERROR_IO, errno,
                           "cannot make a worker's socket non-blocking");
    return true;
}

static bool
plan_make(struct child *child, struct plan *plan, int *report,
          struct error *err)
{
    if (!find_program(plan->program, err) || !plan_env(plan, err))
        return false;
    plan->argv[0] = plan->program;
    plan->parent = getpid();
    if (!make_socket(child, plan, err))
        return false;
    plan->null = open("/dev/null", O_RDWR | O_CLOEXEC);
    if (plan->null < 0)
        return error_errno(err, ERROR_IO, errno, "cannot open /dev/null");
    int pipe_ends[2];
    if (!move_up(&plan->null, err))
        return false;
    if (pipe2(pipe_ends, O_CLOEXEC) != 0)
        return error_errno(err, ERROR_IO, errno,
                           "cannot make a pipe for a worker");
    *report = pipe_ends[0];
    plan->report = pipe_ends[1];
    return move_up(&plan->report, err);
}

bool
child_start(struct child *child, uint64_t memory_limit, struct error *err)
{
    *child = (struct child){.pidfd = -1, .socket = -1};
    int report = -1;
    bool ok = false;
    struct plan *plan = calloc(1, sizeof *plan); /* 50 kB: not on the stack */
    if (plan == NULL)
        return error_set(err, ERROR_MEMORY, "no memory to start a worker");
    plan->socket = plan->report = plan->null = -1;
    plan->memory_limit = memory_limit;
    if (!plan_make(child, plan, &report, err))
        goto out;

    child->pid = fork_quietly(plan);
    if (child->pid < 0) {
        child->pid = 0;
        error_errno(err, ERROR_IO, errno, "cannot fork a worker");
        goto out;
    }
    close_fd(&plan->report);
    /* Nobody else reaps our children, so the number cannot be reused yet. */
    child->pidfd = pidfd_open(child->pid, 0);
    if (child->pidfd < 0) {
        error_errno(err, ERROR_IO, errno, "cannot watch a worker");
        goto out;
    }
    ok = exec_worked(report, plan, err);
out:
    close_fd(&plan->socket);
    close_fd(&plan->report);
    close_fd(&plan->null);
    close_fd(&report);
    free(plan);
    if (!ok) {
        if (child->pid == 0)
            close_fd(&child->socket);
        child_stop(child, NULL);
    }
    return ok;
}

static bool
ask_send(struct child *child, struct message *message, struct error *err)
{
    if (child->pid == 0)
        return error_set(err, ERROR_IO, "there is no worker to ask");
    return wire_send(child->socket, message, err);
}

bool
child_render(struct child *child, const char *scene, size_t scene_len,
             const char *output, size_t output_len, unsigned threads,
             struct error *err)
{
    if (!child->ready || child->busy)
        return error_set(err, ERROR_INTERNAL, "the worker is %s",
                         child->busy ? "busy" : "not ready");
    struct message message = {.kind = MESSAGE_RENDER, .ask = child->ask + 1};
    if (message.ask == 0)
        message.ask = 1; /* after 2^32 asks */
    message.body.threads.threads = threads > 0 ? threads : 1;
    bool ok = false;
    int fd = wire_memfd("glint-scene", scene, scene_len, err);
    if (fd < 0)
        goto out;
    message.fds[message.fd_count++] = fd;
    fd = wire_memfd("glint-output", output, output_len, err);
    if (fd < 0)
        goto out;
    message.fds[message.fd_count++] = fd;
    ok = ask_send(child, &message, err);
    if (ok) {
        child->ask = message.ask;
        child->busy = true;
    }
out:
    message_clear(&message);
    return ok;
}

/* CANCEL or THREADS about the ask under way. With none there is nothing to
 * say: its answer may have crossed our message. */
static bool
remark(struct child *child, struct message *message, struct error *err)
{
    if (!child->busy)
        return true;
    message->ask = child->ask;
    return ask_send(child, message, err);
}

bool
child_cancel(struct child *child, struct error *err)
{
    struct message message = {.kind = MESSAGE_CANCEL};
    return remark(child, &message, err);
}

bool
child_threads(struct child *child, unsigned threads, struct error *err)
{
    struct message message = {.kind = MESSAGE_THREADS};
    message.body.threads.threads = threads > 0 ? threads : 1;
    return remark(child, &message, err);
}

/* READY must come from a worker of our own build: two builds may differ in
 * pixels, and in this very protocol. */
static bool
take_ready(struct child *child, const struct message *message,
           struct error *err)
{
    const struct message_ready *ready = &message->body.ready;
    if (child->ready)
        return error_set(err, ERROR_PROTOCOL, "the worker said READY twice");
    if (strcmp(ready->version, glint_version) != 0 ||
        strcmp(ready->build, glint_build) != 0)
        return error_set(err, ERROR_PROTOCOL,
                         "the worker must be of version %s build %.12s, got "
                         "%s build %.12s",
                         glint_version, glint_build, ready->version,
                         ready->build);
    char isa[ISA_SIZE];
    isa_class(isa);
    if (strcmp(ready->isa, isa) != 0)
        return error_set(err, ERROR_PROTOCOL,
                         "the worker's ISA class must be %s, got %s", isa,
                         ready->isa);
    child->about = *ready;
    child->ready = true;
    return true;
}

static bool
take_answer(struct child *child, const struct message *message,
            struct error *err)
{
    if (!child->busy || message->ask != child->ask)
        return error_set(err, ERROR_PROTOCOL,
                         "the worker answered ask %u, under way is %s %u",
                         message->ask, child->busy ? "ask" : "none after",
                         child->ask);
    if (message->kind != MESSAGE_PROGRESS)
        child->busy = false;
    return true;
}

enum wire_status
child_receive(struct child *child, bool wait, struct message *message,
              struct error *err)
{
    if (child->socket < 0 || child->pid == 0) {
        *message = (struct message){0};
        return WIRE_CLOSED;
    }
    enum wire_status status = wire_receive(child->socket, wait, message, err);
    if (status != WIRE_MESSAGE)
        return status;
    bool ok = false;
    switch (message->kind) {
    case MESSAGE_READY: ok = take_ready(child, message, err); break;
    case MESSAGE_PROGRESS:
    case MESSAGE_DONE:
    case MESSAGE_FAILED: ok = take_answer(child, message, err); break;
    default:
        error_set(err, ERROR_PROTOCOL,
                  "a message of kind %u does not come from a worker",
                  message->kind);
        break;
    }
    if (ok)
        return WIRE_MESSAGE;
    message_clear(message);
    return WIRE_BROKEN;
}

void
child_stop(struct child *child, char how[64])
{
    if (how != NULL)
        snprintf(how, 64, "never started");
    if (child->pid > 0) {
        kill(child->pid, SIGKILL); /* not yet reaped, so surely ours */
        int status = 0;
        pid_t got;
        do {
            got = waitpid(child->pid, &status, 0);
        } while (got < 0 && errno == EINTR);
        if (how != NULL && got < 0)
            snprintf(how, 64, "ended, reaped by another");
        else if (how != NULL && WIFSIGNALED(status))
            snprintf(how, 64, "killed by signal %d", WTERMSIG(status));
        else if (how != NULL)
            snprintf(how, 64, "exited with status %d", WEXITSTATUS(status));
        close_fd(&child->pidfd);
        close_fd(&child->socket);
    }
    *child = (struct child){.pidfd = -1, .socket = -1};
}
