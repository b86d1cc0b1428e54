#include "server/worker/sandbox.h"

#include <errno.h>
#include <fcntl.h>
#include <sched.h>
#include <seccomp.h>
#include <signal.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include "core/base/log.h"
#include "core/image/image.h"

enum { SOCKET_FD = 3 }; /* as child.h gives it */

/* One row: a system call, and what must hold of one argument for the row to
 * apply (`any`: nothing). Several rows of one call are alternatives. */
enum condition { ANY, EQUAL, MASKED };
struct rule {
    int call;
    enum condition when;
    unsigned argument;
    uint64_t mask,
        value; /* EQUAL: value · MASKED: (argument & mask) == value */
};

#define CALL(name) SCMP_SYS(name)

/* Step one: what a worker may do at all. Everything else is EPERM: a library
 * that tries something odd gets an error it can live with. */
static const struct rule allowed[] = {
    /* memory */
    {.call = CALL(brk)},
    {.call = CALL(mmap)},
    {.call = CALL(munmap)},
    {.call = CALL(mremap)},
    {.call = CALL(mprotect)},
    {.call = CALL(madvise)},
    {.call = CALL(mincore)},
    {.call = CALL(membarrier)},
    {.call = CALL(mlock)}, /* a library of the library keeps keys there */
    {.call = CALL(munlock)},
    {.call = CALL(get_mempolicy)},
    /* threads and signals, within the process */
    {CALL(clone), MASKED, 0, CLONE_THREAD | CLONE_VM, CLONE_THREAD | CLONE_VM},
    {.call = CALL(futex)},
    {.call = CALL(set_robust_list)},
    {.call = CALL(rseq)},
    {.call = CALL(sched_yield)},
    {.call = CALL(sched_getaffinity)},
    {.call = CALL(sched_setaffinity)},
    {.call = CALL(sched_getparam)},
    {.call = CALL(sched_getscheduler)},
    {.call = CALL(getcpu)},
    {.call = CALL(gettid)},
    {.call = CALL(getpid)},
    {.call = CALL(rt_sigaction)},
    {.call = CALL(rt_sigprocmask)},
    {.call = CALL(rt_sigreturn)},
    {.call = CALL(sigaltstack)},
    {.call = CALL(restart_syscall)},
    {.call = CALL(exit)},
    {.call = CALL(exit_group)},
    {.call = CALL(arch_prctl)},
    {CALL(prctl), EQUAL, 0, 0, PR_SET_NAME},
    {CALL(prctl), EQUAL, 0, 0, PR_GET_NAME},
    {CALL(prctl), EQUAL, 0, 0, PR_SET_NO_NEW_PRIVS}, /* for step two */
    {.call = CALL(seccomp)},
    /* time */
    {.call = CALL(clock_gettime)},
    {.call = CALL(clock_getres)},
    {.call = CALL(clock_nanosleep)},
    {.call = CALL(nanosleep)},
    {.call = CALL(gettimeofday)},
    {.call = CALL(time)},
    /* what it is told about itself */
    {.call = CALL(getrusage)},
    {.call = CALL(getrandom)},
    {.call = CALL(uname)},
    {.call = CALL(sysinfo)},
    {.call = CALL(getuid)},
    {.call = CALL(geteuid)},
    {.call = CALL(getgid)},
    {.call = CALL(getegid)},
    {.call = CALL(getppid)},
    {.call = CALL(getcwd)},
    {CALL(prlimit64), EQUAL, 2, 0, 0}, /* read a limit, set none */
    {.call = CALL(getrlimit)},
    /* descriptors it has */
    {.call = CALL(read)},
    {.call = CALL(readv)},
    {.call = CALL(pread64)},
    {.call = CALL(write)},
    {.call = CALL(writev)},
    {.call = CALL(lseek)},
    {.call = CALL(close)},
    {.call = CALL(fcntl)},
    {.call = CALL(fstat)},
    {.call = CALL(poll)},
    {.call = CALL(ppoll)},
    {CALL(ioctl), EQUAL, 1, 0, TCGETS}, /* is it a terminal? */
    /* its socket, and the memory files that travel over it */
    {CALL(recvmsg), EQUAL, 0, 0, SOCKET_FD},
    {CALL(sendmsg), EQUAL, 0, 0, SOCKET_FD},
    {.call = CALL(memfd_create)},
    /* the image library, until step two: opening to read, looking */
    {CALL(open), MASKED, 1, O_ACCMODE | O_CREAT | O_TRUNC, O_RDONLY},
    {CALL(openat), MASKED, 2, O_ACCMODE | O_CREAT | O_TRUNC, O_RDONLY},
    {.call = CALL(newfstatat)},
    {.call = CALL(stat)},
    {.call = CALL(lstat)},
    {.call = CALL(statx)},
    {.call = CALL(statfs)},
    {.call = CALL(access)},
    {.call = CALL(faccessat)},
    {.call = CALL(faccessat2)},
    {.call = CALL(readlink)},
    {.call = CALL(readlinkat)},
    {.call = CALL(getdents64)},
};

/* Step two: what is taken back once the image library has loaded. */
static const struct rule taken_back[] = {
    {.call = CALL(open)},
    {.call = CALL(openat)},
    {.call = CALL(stat)},
    {.call = CALL(lstat)},
    {.call = CALL(statfs)},
    {.call = CALL(access)},
    {.call = CALL(faccessat)},
    {.call = CALL(faccessat2)},
    {.call = CALL(readlink)},
    {.call = CALL(readlinkat)},
    {.call = CALL(getdents64)},
    /* fstat(fd) is newfstatat(fd, "", AT_EMPTY_PATH) in the C library */
    {CALL(newfstatat), MASKED, 3, AT_EMPTY_PATH, 0},
    {CALL(statx), MASKED, 2, AT_EMPTY_PATH, 0},
    {CALL(mmap), MASKED, 2, PROT_EXEC, PROT_EXEC},
    {CALL(mprotect), MASKED, 2, PROT_EXEC, PROT_EXEC},
};

static int
add_rule(scmp_filter_ctx filter, uint32_t action, const struct rule *rule)
{
    if (rule->when == ANY)
        return seccomp_rule_add(filter, action, rule->call, 0);
    struct scmp_arg_cmp compare = {
        .arg = rule->argument,
        .op = rule->when == EQUAL ? SCMP_CMP_EQ : SCMP_CMP_MASKED_EQ,
        .datum_a = rule->when == EQUAL ? rule->value : rule->mask,
        .datum_b = rule->when == EQUAL ? 0 : rule->value,
    };
    return seccomp_rule_add_array(filter, action, rule->call, 1, &compare);
}

/* Load a filter on all threads. `otherwise` is for calls no row names. */
static int
load_filter(uint32_t otherwise, uint32_t action, const struct rule *rules,
            size_t count)
{
    scmp_filter_ctx filter = seccomp_init(otherwise);
    if (filter == NULL)
        return -ENOMEM;
    int result = seccomp_attr_set(filter, SCMP_FLTATR_CTL_TSYNC, 1);
    for (size_t i = 0; i < count && result == 0; i++)
        result = add_rule(filter, action, &rules[i]);
    /* glibc tries clone3 first, whose flags a filter cannot see, and falls back
     * to clone if there is no such call. */
    if (result == 0 && otherwise != SCMP_ACT_ALLOW)
        result =
            seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), CALL(clone3), 0);
    if (result == 0)
        result = seccomp_load(filter);
    seccomp_release(filter);
    return result;
}

/* Per process; the memory limit is the parent's business. */
static void
set_limits(void)
{
    static const struct {
        int resource;
        rlim_t most;
        const char *what;
    } limits[] = {
        {RLIMIT_CORE, 0, "core size"},
        {RLIMIT_NOFILE, 64, "descriptors"},
        /* Memory files count as files: the largest image that may leave. */
        {RLIMIT_FSIZE, (rlim_t)8 << 30, "file size"},
    };
    for (size_t i = 0; i < sizeof limits / sizeof limits[0]; i++) {
        struct rlimit limit = {limits[i].most, limits[i].most};
        if (setrlimit((__rlimit_resource_t)limits[i].resource, &limit) != 0)
            log_write(LOG_WARN, "worker", "cannot limit the %s: %s",
                      limits[i].what, strerrordesc_np(errno));
    }
}

void
sandbox_enter(int socket)
{
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    prctl(PR_SET_DUMPABLE, 0); /* nobody of our user may trace us either */
    close_range((unsigned)socket + 1, ~0U, 0);
    set_limits();
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0)
        log_write(LOG_WARN, "worker", "cannot give up new privileges: %s",
                  strerrordesc_np(errno));
    int result = load_filter(SCMP_ACT_ERRNO(EPERM), SCMP_ACT_ALLOW, allowed,
                             sizeof allowed / sizeof allowed[0]);
    if (result != 0)
        log_write(LOG_WARN, "worker", "no system call filter: %s",
                  strerrordesc_np(-result));
}

void
sandbox_tighten(void)
{
    static bool done;
    if (done || !image_codec_settled())
        return;
    done = true;
    int result = load_filter(SCMP_ACT_ALLOW, SCMP_ACT_ERRNO(EACCES), taken_back,
                             sizeof taken_back / sizeof taken_back[0]);
    if (result != 0)
        log_write(LOG_WARN, "worker", "no second system call filter: %s",
                  strerrordesc_np(-result));
}
