/* files.h - the files that are part of the program: schemas, examples, help
 * pages and web pages, put into it by cmake/embed.cmake. */
#ifndef SERVER_API_FILES_H
#define SERVER_API_FILES_H

#include <stddef.h>

struct file {
    const char *name; /* path in the source tree: "schemas/scene.json" */
    const unsigned char *data;
    size_t len;
    const char *sha256; /* 64 hex digits */
};

/* Sorted by name. */
extern const struct file files[];
extern const size_t file_count;

/* NULL if there is none. */
const struct file *
file_find(const char *name);

/* The first file whose name is not before `prefix`; the files below a folder
 * follow one another. file_count if there is none. */
size_t
file_first(const char *prefix);

#endif
