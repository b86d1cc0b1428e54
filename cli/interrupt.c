#include "cli/interrupt.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "cli/exit.h"

static volatile sig_atomic_t came;
static int event = -1;

static void
on_signal(int number)
{
    (void)number;
    if (came)
        _exit(STATUS_INTERRUPTED);
    came = 1;
    int cause = errno;
    uint64_t one = 1;
    ssize_t n = write(event, &one, sizeof one);
    (void)n; /* the flag is set in any case */
    errno = cause;
}

void
interrupt_start(void)
{
    if (event >= 0)
        return;
    event = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    struct sigaction action = {.sa_handler = on_signal};
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);

    /* Under nohup SIGHUP is ignored, and stays so. */
    struct sigaction hangup;
    if (sigaction(SIGHUP, NULL, &hangup) == 0 && hangup.sa_handler != SIG_IGN)
        sigaction(SIGHUP, &action, NULL);
}

bool
interrupted(void)
{
    return came != 0;
}

int
interrupt_fd(void)
{
    return event;
}

void
interrupt_wait(int ms)
{
    struct pollfd fd = {.fd = event, .events = POLLIN};
    poll(&fd, 1, ms);
}
