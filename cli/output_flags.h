/* output_flags.h - how the picture is delivered: the options of glint render
 * over the job's own output member over the defaults.
 *
 * The file name's ending is as good as --format. A job's bit depth and colour
 * space count only while its format does. */
#ifndef CLI_OUTPUT_FLAGS_H
#define CLI_OUTPUT_FLAGS_H

#include <stdbool.h>

#include "cli/command.h"
#include "cli/document.h"
#include "core/base/error.h"
#include "core/scene/output.h"

/* Before anything is read: does the ending say a format, and no other one than
 * --format? ERROR_USAGE. */
bool
output_flags_check(const struct invocation *in, const char *path,
                   struct error *err);

/* After document_check. ERROR_USAGE names the option that does not fit. */
bool
output_flags_read(const struct invocation *in, const char *path,
                  const struct document *document, struct output *output,
                  struct error *err);

#endif
