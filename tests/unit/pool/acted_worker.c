/* acted_worker.c - stands in for glint-worker where a test needs one that
 * misbehaves. What it does is told by the scene's first word, or, for what
 * happens before the first scene, by the last word of its own name:
 *
 *   mute      never says READY            stranger  is of another build
 *   dies      exits before READY
 *
 *   done      an image                    failed    FAILED, internal
 *   slow      works until canceled        deaf      works, hears no CANCEL
 *   silent    works and says nothing      crash     exits with status 3
 *   unsealed  result in an open file      pipe      result in a pipe
 *   twice     two answers                 early     exits right after DONE
 *   noise     a record that is no message hog       wants all memory */
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "core/base/isa.h"
#include "server/worker/wire.h"

enum { SOCKET = 3 };

static void
nap(void)
{
    struct timespec time = {0, 20 * 1000 * 1000};
    nanosleep(&time, NULL);
}

static void
say_ready(bool stranger)
{
    struct message message = {.kind = MESSAGE_READY};
    struct message_ready *ready = &message.body.ready;
    snprintf(ready->version, sizeof ready->version, "%s", glint_version);
    snprintf(ready->build, sizeof ready->build, "%s",
             stranger ? "0123456789" : glint_build);
    char isa[ISA_SIZE];
    isa_class(isa);
    snprintf(ready->isa, sizeof ready->isa, "%s", isa);
    wire_send(SOCKET, &message, NULL);
}

static void
say_done(uint32_t ask, int fd)
{
    struct message message = {.kind = MESSAGE_DONE, .ask = ask, .fd_count = 1};
    message.fds[0] = fd;
    message.body.done.width = message.body.done.height = 1;
    message.body.done.rays[0] = 1000000;
    message.body.done.trace_ms = 100;
    wire_send(SOCKET, &message, NULL);
}

static void
say_failed(uint32_t ask, enum error_code code)
{
    struct message message = {.kind = MESSAGE_FAILED, .ask = ask};
    message.body.failed.code = code;
    snprintf(message.body.failed.text, sizeof message.body.failed.text,
             "acted");
    wire_send(SOCKET, &message, NULL);
}

static void
work(uint32_t ask, bool talks, bool hears)
{
    for (uint32_t i = 0;; i++, nap()) {
        struct message message = {0};
        if (talks) {
            struct message news = {.kind = MESSAGE_PROGRESS, .ask = ask};
            news.body.progress.stage = STAGE_TRACING;
            news.body.progress.done = i < 999 ? i : 999;
            news.body.progress.total = 1000;
            if (!wire_send(SOCKET, &news, NULL))
                _exit(1);
        }
        if (!hears)
            continue;
        enum wire_status status = wire_receive(SOCKET, false, &message, NULL);
        bool stop = status == WIRE_MESSAGE && message.kind == MESSAGE_CANCEL;
        message_clear(&message);
        if (status == WIRE_CLOSED)
            _exit(1);
        if (stop) {
            say_failed(ask, ERROR_CANCELED);
            return;
        }
    }
}

/* Straight from the kernel: a sanitizer's malloc would rather abort. */
static void
hog(uint32_t ask)
{
    for (size_t i = 0; i < 4096; i++) {
        char *chunk = mmap(NULL, 1 << 20, PROT_READ | PROT_WRITE,
                           MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (chunk == MAP_FAILED) {
            say_failed(ask, ERROR_MEMORY);
            return;
        }
        memset(chunk, 1, 1 << 20);
    }
    say_failed(ask, ERROR_INTERNAL); /* 4 GiB and no limit met */
}

static void
act(const char *part, uint32_t ask)
{
    int image = wire_memfd("image", part, strlen(part), NULL);
    int ends[2];
    if (strcmp(part, "done") == 0) {
        say_done(ask, image);
    } else if (strcmp(part, "failed") == 0) {
        say_failed(ask, ERROR_INTERNAL);
    } else if (strcmp(part, "slow") == 0) {
        work(ask, true, true);
    } else if (strcmp(part, "deaf") == 0) {
        work(ask, true, false);
    } else if (strcmp(part, "silent") == 0) {
        work(ask, false, false);
    } else if (strcmp(part, "crash") == 0) {
        _exit(3);
    } else if (strcmp(part, "unsealed") == 0) {
        int open = memfd_create("x", MFD_ALLOW_SEALING);
        if (write(open, "x", 1) == 1)
            say_done(ask, open);
    } else if (strcmp(part, "pipe") == 0) {
        if (pipe(ends) == 0)
            say_done(ask, ends[0]);
        pause();
    } else if (strcmp(part, "twice") == 0) {
        say_done(ask, image);
        say_done(ask, image);
    } else if (strcmp(part, "early") == 0) {
        say_done(ask, image);
        _exit(0);
    } else if (strcmp(part, "noise") == 0) {
        send(SOCKET, "hello", 5, 0);
        pause();
    } else if (strcmp(part, "hog") == 0) {
        hog(ask);
    }
    close(image);
}

int
main(int argc, char **argv)
{
    (void)argc;
    const char *name = strrchr(argv[0], '_');
    name = name != NULL ? name + 1 : "";
    if (strcmp(name, "dies") == 0)
        return 4;
    if (strcmp(name, "mute") == 0)
        pause();
    say_ready(strcmp(name, "stranger") == 0);
    for (;;) {
        struct message message = {0};
        if (wire_receive(SOCKET, true, &message, NULL) != WIRE_MESSAGE)
            return 0;
        const void *text;
        size_t len;
        if (message.kind == MESSAGE_RENDER &&
            wire_map(message.fds[0], 64, &text, &len, NULL)) {
            char part[65];
            snprintf(part, sizeof part, "%.*s", (int)len, (const char *)text);
            wire_unmap(text, len);
            act(part, message.ask);
        }
        message_clear(&message);
    }
}
