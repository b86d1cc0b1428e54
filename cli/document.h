/* document.h - a file that says what to render: a scene, or a job that holds
 * one. Text, tree, scene and everything that is wrong with it.
 *
 * Zero it, document_open, then document_set for each --set, then document_check;
 * clear it in any case. The text stays line for line the user's own, so that
 * every place found in it is a place in the file. One owner. */
#ifndef CLI_DOCUMENT_H
#define CLI_DOCUMENT_H

#include <stdbool.h>
#include <stddef.h>

#include "cli/output.h"
#include "core/base/arena.h"
#include "core/base/bytes.h"
#include "core/base/error.h"
#include "core/base/json.h"
#include "core/scene/output.h"
#include "core/scene/scene.h"
#include "core/scene/scene_lint.h"

enum { DOCUMENT_SET_MAX = 256 };

struct document {
    const char *name; /* for messages: the path, or "standard input" */
    struct arena arena;
    struct bytes text;
    const struct json *root;        /* NULL: no JSON */
    const struct json *scene_root;  /* root, or a job's scene; NULL: none */
    const struct json *output_root; /* a job's output, or NULL */
    bool is_job;
    struct scene scene;   /* valid after document_check gave true */
    struct output output; /* the job's, or the default; likewise */
    struct error_list errors;
    const struct lint_item *lint;
    size_t lint_count;
    struct {
        const char *assignment, *place;
    } sets[DOCUMENT_SET_MAX];
    size_t set_count;
};

/* Read the file ("-": standard input) and parse it. False with err set: the
 * file cannot be read. True says nothing about its content: a document that is
 * no JSON has items in `errors`. {"$example": NAME} is replaced by that
 * example. */
bool
document_open(struct document *document, const char *path, struct error *err);

/* One --set. Nothing happens if the document is no JSON. */
bool
document_set(struct document *document, const char *assignment,
             struct error *err);

/* Read scene, output and the other members of a job; lint the scene if it is
 * valid. True if nothing is wrong. */
bool
document_check(struct document *document);

/* Print one finding with its place in this document, or with the --set that
 * brought it in. */
void
document_print(const struct document *document, const struct channel *to,
               const struct finding *finding);

/* All errors, then the warnings if wanted. */
void
document_print_all(const struct document *document, const struct channel *to,
                   bool warnings);

/* A job document for a server: the user's job with this output in it, or this
 * scene wrapped in one; the scene begins *lines_before lines later than in
 * `text`. The document must be JSON with a scene_root. */
void
document_write_job(const struct document *document, const char *output,
                   struct bytes *job, unsigned *lines_before);

void
document_clear(struct document *document);

#endif
