#include "server/worker/serve.h"

#include <malloc.h>
#include <poll.h>
#include <stdio.h>
#include <unistd.h>

#include "core/base/clock.h"
#include "core/base/isa.h"
#include "core/base/log.h"
#include "core/image/image.h"
#include "server/worker/run.h"
#include "server/worker/sandbox.h"

enum {
    PROGRESS_INTERVAL_US = 100000,
    IDLE_MS = 20,    /* then the image library loads */
    RESTING_MS = 500 /* then memory goes back to the system */
};

/* Leave at once: the libraries' static destructors would wait for threads that
 * they started and that may be anywhere. */
_Noreturn static void
leave(int status)
{
    fflush(stderr);
    _exit(status);
}

static void
take_remark(struct turn *turn, const struct message *message)
{
    /* About an earlier ask: its answer and this remark crossed. */
    if (message->ask != turn->ask)
        return;
    if (message->kind == MESSAGE_CANCEL)
        turn->canceled = true;
    else
        atomic_store(&turn->threads, message->body.threads.threads);
}

bool
turn_listen(struct turn *turn)
{
    sandbox_tighten();
    for (;;) {
        struct message message;
        struct error err = {0};
        enum wire_status status =
            wire_receive(turn->socket, false, &message, &err);
        if (status == WIRE_NOTHING)
            return !turn->canceled;
        if (status == WIRE_CLOSED)
            leave(0);
        if (status == WIRE_MESSAGE && (message.kind == MESSAGE_CANCEL ||
                                       message.kind == MESSAGE_THREADS)) {
            take_remark(turn, &message);
            message_clear(&message);
            continue;
        }
        log_write(LOG_ERROR, "worker", "out of turn while ask %u runs: %s",
                  turn->ask,
                  err.code != ERROR_NONE ? err.text : "a second ask");
        leave(1);
    }
}

static bool
has_room(int socket)
{
    struct pollfd one = {.fd = socket, .events = POLLOUT};
    return poll(&one, 1, 0) == 1 && (one.revents & POLLOUT) != 0;
}

void
turn_progress(struct turn *turn, const struct message_progress *progress)
{
    int64_t now = clock_monotonic_us();
    if (now < turn->next_progress_us || !has_room(turn->socket))
        return;
    struct message message = {
        .kind = MESSAGE_PROGRESS, .ask = turn->ask, .body.progress = *progress};
    /* A parent that has gone is noticed by turn_listen. */
    wire_send(turn->socket, &message, NULL);
    turn->next_progress_us = now + PROGRESS_INTERVAL_US;
}

/* One row per kind of ask. */
static const run_fn asks[MESSAGE_KIND_COUNT] = {
    [MESSAGE_RENDER] = run_render,
};

/* Do one ask and send its one answer. False if nobody is there to read it. */
static bool
answer_ask(int socket, const struct message *ask)
{
    struct turn turn = {.socket = socket, .ask = ask->ask};
    struct message answer = {.kind = MESSAGE_DONE, .ask = ask->ask};
    struct error err = {0};
    if (!asks[ask->kind](&turn, ask, &answer, &err)) {
        message_clear(&answer);
        answer.kind = MESSAGE_FAILED;
        answer.ask = ask->ask;
        answer.body.failed.code =
            err.code != ERROR_NONE ? err.code : ERROR_INTERNAL;
        snprintf(answer.body.failed.text, sizeof answer.body.failed.text, "%s",
                 err.text);
    }
    struct error lost = {0};
    bool ok = wire_send(socket, &answer, &lost);
    if (!ok)
        log_write(LOG_WARN, "worker", "%s", lost.text);
    message_clear(&answer);
    return ok;
}

static bool
say_ready(int socket)
{
    struct message message = {.kind = MESSAGE_READY};
    struct message_ready *ready = &message.body.ready;
    snprintf(ready->version, sizeof ready->version, "%s", glint_version);
    snprintf(ready->build, sizeof ready->build, "%s", glint_build);
    isa_class(ready->isa);
    return wire_send(socket, &message, NULL);
}

/* Sleep until something comes, and shut the sandbox before it is read. Idle
 * time is for loading the image library. An ask that is there at once is begun
 * first: while a library loads the C library starts no thread, so the crew
 * would wait for it (run.c loads beside the crew). A worker at rest should be
 * small, but between asks in a row its pages stay: faulting a film in again
 * costs more than clearing it. */
static void
wait_for_ask(int socket)
{
    struct pollfd one = {.fd = socket, .events = POLLIN};
    if (poll(&one, 1, IDLE_MS) == 0) {
        image_codec_load();
        if (poll(&one, 1, RESTING_MS) == 0) {
            malloc_trim(0);
            poll(&one, 1, -1);
        }
    }
    sandbox_tighten();
}

int
serve(int socket)
{
    if (!say_ready(socket))
        return 0;
    for (;;) {
        wait_for_ask(socket);
        struct message message;
        struct error err = {0};
        enum wire_status status = wire_receive(socket, true, &message, &err);
        if (status == WIRE_CLOSED)
            return 0;
        if (status == WIRE_MESSAGE && asks[message.kind] != NULL) {
            bool heard = answer_ask(socket, &message);
            message_clear(&message);
            if (!heard)
                return 0;
            continue;
        }
        /* Remarks about an ask that has just been answered. */
        if (status == WIRE_MESSAGE && (message.kind == MESSAGE_CANCEL ||
                                       message.kind == MESSAGE_THREADS)) {
            message_clear(&message);
            continue;
        }
        log_write(LOG_ERROR, "worker", "protocol broken: %s",
                  err.code != ERROR_NONE ? err.text : "not an ask");
        message_clear(&message);
        return 1;
    }
}
