/* exit.h - what glint's exit status tells a script (API section 11).
 *
 * One row per status: C name, number, the sentence of `glint help exit-codes`,
 * of docs/cli.md and of the manual page. Numbers are public and never reused. */
#ifndef CLI_EXIT_H
#define CLI_EXIT_H

#define EXIT_TABLE(X)                                                          \
    X(STATUS_OK, 0, "done, or yes")                                            \
    X(STATUS_NO, 1, "no: lint found errors")                                   \
    X(STATUS_USAGE, 2,                                                         \
      "usage: a mistake in the command line, or a file that it names cannot "  \
      "be read or written")                                                    \
    X(STATUS_INVALID, 3, "the scene or job document is not valid")             \
    X(STATUS_SERVER, 4,                                                        \
      "the server cannot be reached, is not ready, or failed (5xx)")           \
    X(STATUS_FAILED, 5, "the render failed, or was canceled by someone else")  \
    X(STATUS_TIMEOUT, 6,                                                       \
      "timed out; a job on a server goes on, and its id is printed")           \
    X(STATUS_DENIED, 7, "not allowed, or over a quota")                        \
    X(STATUS_INTERRUPTED, 130, "interrupted by Ctrl-C; no file was written")

enum status {
#define X(name, number, text) name = number,
    EXIT_TABLE(X)
#undef X
};

#endif
