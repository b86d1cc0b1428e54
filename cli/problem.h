/* problem.h - a server's refusal (RFC 9457) in the words of glint lint. */
#ifndef CLI_PROBLEM_H
#define CLI_PROBLEM_H

#include "cli/document.h"
#include "cli/remote.h"

/* Print what the server said and give the exit status that fits: places of its
 * errors are turned back into places of `document`, of which document_write_job
 * made what was sent with `lines_before`. `document` may be NULL. */
int
problem_print(const struct remote_reply *reply, const struct channel *to,
              const char *who, const struct document *document,
              unsigned lines_before);

/* The exit status for an HTTP status that is no success. */
int
problem_status(long http_status);

#endif
