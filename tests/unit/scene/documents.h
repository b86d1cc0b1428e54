/* documents.h - scene documents for tests: read one, see what came out. */
#ifndef TESTS_UNIT_SCENE_DOCUMENTS_H
#define TESTS_UNIT_SCENE_DOCUMENTS_H

#include "core/scene/scene_json.h"

struct document {
    struct arena arena;
    struct error_list errors;
    struct bytes text; /* files only */
    const struct json *root;
    struct scene scene;
    bool good;
};

/* A document in the source tree, "schemas/examples/smallest.json". */
void
document_load(struct document *d, const char *path);

void
document_read(struct document *d, const char *text, size_t len,
              const struct scene_limits *limits);

/* Single quotes stand for double ones. */
void
document_quoted(struct document *d, const char *text);

void
document_clear(struct document *d);

/* "code pointer line:column\n" for every error. */
void
document_errors(const struct document *d, struct bytes *out);

/* Every number, name and index of a scene, bit by bit. */
void
scene_dump(const struct scene *scene, struct bytes *out);

/* Where examples are: the file names (without folder) of one folder, sorted;
 * returns how many. The names are the caller's to free. */
size_t
document_list(const char *folder, char **names, size_t most);

/* The source tree's root. */
const char *
source_root(void);

/* A document as text with one JSON Patch of remove, move and replace applied;
 * false if it is none of those. */
bool
patch_apply(const char *text, size_t len, const char *patch, struct bytes *out);

#endif
