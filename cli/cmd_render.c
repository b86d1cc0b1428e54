/* glint render SCENE -o FILE */
#include <errno.h>
#include <limits.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "cli/command.h"
#include "cli/document.h"
#include "cli/examples.h"
#include "cli/exit.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "cli/output_flags.h"
#include "cli/progress.h"
#include "cli/remote.h"
#include "cli/render.h"
#include "core/base/clock.h"

/* All of one run. */
struct run {
    const struct invocation *in;
    struct channel messages;
    bool quiet;
    const char *path; /* of the picture */
    struct document document;
    struct output output;
    struct progress progress;
    struct bytes picture;
};

static int
usage(const struct run *run, const char *text)
{
    say_error(&run->messages, "glint render", "%s", text);
    return STATUS_USAGE;
}

/* The folder that the picture goes to must be there and writable. */
static bool
folder_check(const char *path, struct error *err)
{
    struct stat st;
    const char *slash = strrchr(path, '/');
    char folder[4096];
    size_t len = slash == NULL ? 0 : slash == path ? 1 : (size_t)(slash - path);
    /* bytes_write_file makes a neighbour with 7 more characters first. */
    const char *name = slash == NULL ? path : slash + 1;
    if (len >= sizeof folder || strlen(name) + 7 > NAME_MAX)
        return error_set(err, ERROR_IO,
                         "cannot write %.64s...: the name is "
                         "too long",
                         path);
    memcpy(folder, path, len);
    folder[len] = '\0';
    const char *where = len > 0 ? folder : ".";
    if (stat(where, &st) != 0)
        return error_set(err, ERROR_IO,
                         "cannot write %.200s: there is no folder %.120s", path,
                         where);
    if (!S_ISDIR(st.st_mode))
        return error_set(err, ERROR_IO,
                         "cannot write %.200s: %.120s is no folder", path,
                         where);
    if (access(where, W_OK | X_OK) != 0)
        return error_set(err, ERROR_IO,
                         "cannot write %.200s: the folder %.120s is not "
                         "writable",
                         path, where);
    return true;
}

/* Find out before the render, not after it, that the picture cannot be
 * written. */
static bool
path_check(const char *path, struct error *err)
{
    struct stat st;
    if (strcmp(path, "-") == 0) {
        if (isatty(STDOUT_FILENO))
            return error_set(err, ERROR_USAGE,
                             "-o - would print a picture on the terminal; "
                             "redirect it: > out.png");
        return true;
    }
    bool exists = stat(path, &st) == 0;
    if (!exists && errno != ENOENT && errno != ENOTDIR)
        return error_errno(err, ERROR_IO, errno, "cannot write %.200s", path);
    if (exists && S_ISDIR(st.st_mode))
        return error_set(err, ERROR_IO, "cannot write %.200s: it is a folder",
                         path);
    if (exists && !S_ISREG(st.st_mode))
        return true; /* a device or a pipe is written in place */
    return folder_check(path, err);
}

static bool
open_document(struct run *run, struct error *err)
{
    const char *path = run->in->args[0];
    if (document_open(&run->document, path, err))
        return true;
    /* A name without a file may be an example's. */
    if (example_find(path) != NULL) {
        *err = (struct error){0};
        error_set(err, ERROR_IO,
                  "there is no file %s, but an example: glint "
                  "examples %s | glint render - -o ...",
                  path, path);
    }
    return false;
}

static bool
apply_sets(struct run *run, struct error *err)
{
    for (size_t i = 0; i < run->in->given_count; i++) {
        const struct given *given = &run->in->given[i];
        struct error why = {0};
        if (strcmp(given->option->name, "set") == 0 &&
            !document_set(&run->document, given->value, &why))
            return error_set(err, why.code, "--set %.80s: %s", given->value,
                             why.text);
    }
    return true;
}

static void
print_summary(const struct run *run)
{
    const struct scene *scene = &run->document.scene;
    fprintf(run->messages.file, "%s  %ux%u, %u spp, %u %s, %u %s",
            run->document.name, scene->width, scene->height, scene->sampler.spp,
            scene->integrator.max_bounces,
            scene->integrator.max_bounces == 1 ? "bounce" : "bounces",
            scene->object_count,
            scene->object_count == 1 ? "object" : "objects");
    if (scene->sampler.kind != SAMPLER_CENTER)
        fprintf(run->messages.file, ", seed %u", scene->sampler.seed);
    fprintf(run->messages.file, "\n");
}

static int
render(struct run *run, const char *server, int64_t started_us)
{
    long timeout = invocation_integer(run->in, "timeout", 0);
    struct render_ask ask = {
        .document = &run->document,
        .output = &run->output,
        .messages = &run->messages,
        .progress = &run->progress,
        .threads = (unsigned)invocation_integer(run->in, "threads", 0),
        .deadline_us = timeout > 0 ? started_us + timeout * 1000000 : 0,
        .quiet = run->quiet,
        .server = server,
    };
    interrupt_start();
    progress_start(&run->progress, &run->messages, run->quiet, started_us);
    int status = server != NULL ? render_remote(&ask, &run->picture)
                                : render_local(&ask, &run->picture);
    /* Ctrl-C between the last message and the file still means no file. */
    if (status == STATUS_OK && interrupted()) {
        progress_erase(&run->progress);
        say_error(&run->messages, "glint render",
                  "interrupted; nothing was written");
        status = STATUS_INTERRUPTED;
    }
    return status;
}

static int
deliver(struct run *run, int64_t started_us)
{
    struct error err = {0};
    progress_finish(&run->progress);
    if (!bytes_write_file(&run->picture, run->path, &err))
        return usage(run, err.text);
    if (run->quiet)
        return STATUS_OK;
    char size[AMOUNT_SIZE], time[AMOUNT_SIZE];
    amount_bytes(run->picture.len, size);
    amount_seconds((double)(clock_monotonic_us() - started_us) / 1e6, time);
    fprintf(run->messages.file, "wrote %s (%s) in %s\n",
            strcmp(run->path, "-") == 0 ? "standard output" : run->path, size,
            time);
    return STATUS_OK;
}

/* Read and check: everything that can be wrong before a ray is traced. */
static int
prepare(struct run *run, const char *server)
{
    struct error err = {0};
    run->path = invocation_value(run->in, "output");
    if (run->path == NULL)
        return usage(run, "say where the picture goes: -o out.png");
    if (!output_flags_check(run->in, run->path, &err) ||
        !path_check(run->path, &err) || !open_document(run, &err) ||
        !apply_sets(run, &err))
        return usage(run, err.text);

    bool valid = document_check(&run->document);
    /* A server judges the scene itself: it may know more than this program.
     * What is no JSON at all need not be sent. */
    if (!valid && (server == NULL || run->document.root == NULL)) {
        document_print_all(&run->document, &run->messages, false);
        return STATUS_INVALID;
    }
    if (!output_flags_read(run->in, run->path, &run->document, &run->output,
                           &err))
        return usage(run, err.text);
    if (server != NULL && invocation_has(run->in, "threads"))
        return usage(run, "--threads is for this desk: a server shares its "
                          "cores out itself");
    if (valid && !run->quiet)
        print_summary(run);
    return STATUS_OK;
}

int
cmd_render(const struct invocation *in)
{
    int64_t started_us = clock_monotonic_us();
    const char *server = remote_server(invocation_value(in, "server"));
    struct run run = {.in = in, .quiet = invocation_has(in, "quiet")};

    run.messages = channel_open(stderr, invocation_has(in, "no-color"));
    int status = prepare(&run, server);
    if (status == STATUS_OK)
        status = render(&run, server, started_us);
    if (status == STATUS_OK)
        status = deliver(&run, started_us);
    bytes_clear(&run.picture);
    document_clear(&run.document);
    return status;
}
