#include "cli/render.h"

#include <poll.h>
#include <sched.h>
#include <string.h>

#include "cli/exit.h"
#include "cli/interrupt.h"
#include "core/base/clock.h"
#include "core/scene/scene_json.h"
#include "server/worker/child.h"

enum {
    READY_MS = 30 * 1000, /* a worker that takes longer to start is given up */
    CANCEL_MS = 2 * 1000, /* then it is killed */
    PICTURE_MAX_MB = 4096
};

/* One worker at work. */
struct session {
    const struct render_ask *ask;
    struct bytes *picture;
    struct child child;
    int64_t started_us, tracing_us; /* tracing_us 0: not yet */
    int64_t stop_us; /* when the worker is given up; 0: no need */
    int why;         /* the status once it ended: STATUS_OK ... */
    bool canceled;   /* CANCEL was sent */
};

static unsigned
cores(void)
{
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) != 0)
        return 1;
    int count = CPU_COUNT(&set);
    return count > 0 ? (unsigned)count : 1;
}

static int
fail(struct session *s, int status, const char *text)
{
    progress_erase(s->ask->progress);
    say_error(s->ask->messages, "glint render", "%s", text);
    return status;
}

static void
on_progress(struct session *s, const struct message_progress *p)
{
    static const char *const stages[] = {"loading", "building", "tracing",
                                         "encoding"};
    int64_t now = clock_monotonic_us();
    if (p->stage == STAGE_TRACING && s->tracing_us == 0)
        s->tracing_us = now;
    double seconds =
        s->tracing_us > 0 ? (double)(now - s->tracing_us) / 1e6 : 0;
    double fraction = p->total > 0 ? (double)p->done / p->total : 0;
    struct progress_facts facts = {
        .stage = stages[p->stage <= STAGE_ENCODING ? p->stage : 0],
        .fraction = p->stage >= STAGE_TRACING ? fraction : 0,
        .rays_per_second = seconds > 0.05 ? (double)p->rays / seconds : 0,
        .seconds_left = fraction > 0 && seconds > 0.2
                            ? seconds * (1 - fraction) / fraction
                            : -1,
    };
    progress_show(s->ask->progress, &facts, now);
}

/* Send RENDER: the canonical scene, as a server would store it. */
static bool
send_ask(struct session *s, struct error *err)
{
    const struct render_ask *ask = s->ask;
    struct bytes scene = {0}, output = {0};
    bool ok = false;

    scene_write_canonical(ask->document->scene_root, &scene);
    output_write(ask->output, &output);
    if (scene.failed || output.failed) {
        error_set(err, ERROR_MEMORY, "no memory for the scene");
        goto out;
    }
    unsigned threads = ask->threads > 0 ? ask->threads : cores();
    ok = child_render(&s->child, scene.data, scene.len, output.data, output.len,
                      threads, err);
out:
    bytes_clear(&scene);
    bytes_clear(&output);
    return ok;
}

static int
on_done(struct session *s, const struct message *message)
{
    const void *data;
    size_t len;
    struct error err = {0};
    if (!wire_map(message->fds[0], (size_t)PICTURE_MAX_MB << 20, &data, &len,
                  &err))
        return fail(s, STATUS_FAILED, err.text);
    bytes_append(s->picture, data, len);
    wire_unmap(data, len);
    if (s->picture->failed)
        return fail(s, STATUS_FAILED, "no memory for the picture");
    return STATUS_OK;
}

/* FAILED, unless we asked for the end ourselves. */
static int
on_failed(struct session *s, const struct message_failed *failed)
{
    if (s->why != STATUS_OK)
        return s->why;
    return fail(s, STATUS_FAILED, failed->text);
}

/* -1: go on listening. */
static int
on_message(struct session *s, const struct message *message)
{
    struct error err = {0};
    switch (message->kind) {
    case MESSAGE_READY:
        s->stop_us = 0;
        return send_ask(s, &err) ? -1 : fail(s, STATUS_FAILED, err.text);
    case MESSAGE_PROGRESS: on_progress(s, &message->body.progress); return -1;
    case MESSAGE_DONE: return on_done(s, message);
    case MESSAGE_FAILED: return on_failed(s, &message->body.failed);
    default:
        return fail(s, STATUS_FAILED, "the worker sent what only we may send");
    }
}

static int
on_gone(struct session *s, enum wire_status status, const struct error *err)
{
    char how[64] = "", text[WIRE_TEXT_SIZE + 128];
    child_stop(&s->child, how);
    if (s->why != STATUS_OK)
        return s->why;
    if (status == WIRE_BROKEN)
        snprintf(text, sizeof text, "the worker was given up: %s", err->text);
    else
        snprintf(text, sizeof text, "the worker process was lost: %s",
                 how[0] ? how : "it closed its socket");
    return fail(s, STATUS_FAILED, text);
}

/* Take what has arrived. -1: go on. */
static int
take_messages(struct session *s)
{
    for (;;) {
        struct message message = {0};
        struct error err = {0};
        enum wire_status status =
            child_receive(&s->child, false, &message, &err);
        if (status == WIRE_NOTHING)
            return -1;
        if (status != WIRE_MESSAGE)
            return on_gone(s, status, &err);
        int end = on_message(s, &message);
        message_clear(&message);
        if (end >= 0)
            return end;
    }
}

/* Ask the worker to stop, once; it is killed if it does not. */
static void
stop(struct session *s, int why)
{
    if (s->canceled)
        return;
    s->canceled = true;
    s->why = why;
    s->stop_us = clock_monotonic_us() + CANCEL_MS * 1000;
    if (!s->child.busy || !child_cancel(&s->child, NULL))
        s->stop_us = clock_monotonic_us();
}

static int
wait_ms(const struct session *s, int64_t now)
{
    int64_t until = s->ask->deadline_us;
    if (s->stop_us > 0 && (until == 0 || s->canceled || s->stop_us < until))
        until = s->stop_us;
    if (until == 0)
        return -1;
    int64_t ms = (until - now + 999) / 1000;
    return ms < 0 ? 0 : ms > 60000 ? 60000 : (int)ms;
}

static int
listen_to(struct session *s)
{
    s->stop_us = s->started_us + READY_MS * 1000;
    for (;;) {
        int64_t now = clock_monotonic_us();
        if (interrupted())
            stop(s, STATUS_INTERRUPTED);
        else if (s->ask->deadline_us > 0 && now >= s->ask->deadline_us)
            stop(s, STATUS_TIMEOUT);
        if (s->stop_us > 0 && now >= s->stop_us)
            return s->canceled ? s->why
                               : fail(s, STATUS_FAILED,
                                      "the worker was not ready within 30 s");
        struct pollfd fds[2] = {
            {.fd = s->child.socket, .events = POLLIN},
            /* Once noticed it stays readable: look no more. */
            {.fd = interrupted() ? -1 : interrupt_fd(), .events = POLLIN},
        };
        if (poll(fds, 2, wait_ms(s, now)) <= 0)
            continue; /* a time-out or a signal: the loop's head decides */
        if (fds[0].revents != 0) {
            int end = take_messages(s);
            if (end >= 0)
                return end;
        }
    }
}

int
render_local(const struct render_ask *ask, struct bytes *picture)
{
    struct session s = {.ask = ask, .picture = picture, .why = STATUS_OK};
    struct error err = {0};

    s.child.pidfd = s.child.socket = -1;
    s.started_us = clock_monotonic_us();
    if (!child_start(&s.child, 0, &err))
        return fail(&s, STATUS_FAILED, err.text);
    int status = listen_to(&s);
    child_stop(&s.child, NULL);
    if (status == STATUS_TIMEOUT)
        return fail(&s, status, "timed out; nothing was written");
    if (status == STATUS_INTERRUPTED)
        return fail(&s, status, "interrupted; nothing was written");
    return status;
}
