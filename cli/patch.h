/* patch.h - one value of a JSON text replaced, the rest left as it stands.
 *
 * The text is spliced, not rewritten: a replaced value keeps its number of
 * lines, so a line number in a message stays that of the user's own file.
 * Columns behind a replaced value may differ. Pure; any thread. */
#ifndef CLI_PATCH_H
#define CLI_PATCH_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/arena.h"
#include "core/base/bytes.h"
#include "core/base/error.h"

/* Put `value` in place of text[begin, end): its line breaks become blanks, and
 * as many line breaks as were removed follow it. */
void
patch_splice(struct bytes *text, size_t begin, size_t end, const char *value,
             size_t value_len);

/* `assignment` is "/pointer=value": an RFC 6901 pointer into `text`, and JSON;
 * a value that is no JSON is taken as a string. A member that an object lacks
 * is made, with the objects on the way to it; "-" appends to an array.
 * *place (in `arena`) becomes the pointer of the outermost value touched.
 * ERROR_USAGE without "=" or with a malformed pointer, ERROR_NOT_FOUND naming
 * the pointer that does not exist, ERROR_INTERNAL if `text` is no JSON. */
bool
patch_set(struct bytes *text, const char *assignment, struct arena *arena,
          const char **place, struct error *err);

#endif
