/* examples.h - the built-in scenes: the files of schemas/examples. */
#ifndef SERVER_API_EXAMPLES_H
#define SERVER_API_EXAMPLES_H

#include "core/base/json.h"
#include "server/api/files.h"

/* "course-table-fresnel" -> its file, or NULL. */
const struct file *
example_find(const char *name);

/* Example i, from 0, in the order of names; NULL after the last. *name is
 * without folder and ending, in `arena`. */
const struct file *
example_at(size_t i, struct arena *arena, const char **name);

/* The scene that {"$example": name} stands for. `node` is that object, `named`
 * its member. NULL after adding to errors what is wrong with it. */
const struct json *
example_read(const struct json *node, const struct json *named,
             struct error_list *errors, const char **name);

/* JSON text of a string, with quotes and escapes, in `arena`. */
const char *
json_quoted(const char *text, struct arena *arena);

#endif
