/* progress.h - how far a render is, told to whoever watches.
 *
 * On a terminal one line is drawn again and again:
 *
 *     tracing  [#################---------------]  53%  42 Mray/s  0:13 left
 *
 * ASCII and without escape sequences, never falling, ended by a newline, erased
 * before an error. Elsewhere the same facts are one line per 10 s; with --quiet
 * nothing. The caller passes the time, in microseconds of clock_monotonic_us. */
#ifndef CLI_PROGRESS_H
#define CLI_PROGRESS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "cli/output.h"

struct progress_facts {
    const char *stage;      /* "loading", "building", "tracing", "encoding" */
    double fraction;        /* 0 ... 1 */
    double rays_per_second; /* <= 0: unknown */
    double seconds_left;    /* < 0: unknown */
};

struct progress {
    FILE *file; /* NULL: quiet */
    bool bar;
    unsigned columns;
    double most;     /* the largest fraction shown or seen */
    size_t drawn;    /* characters of the line on the terminal now */
    int64_t next_us; /* when the next line or the first bar is due */
};

enum { PROGRESS_SIZE = 256 };

/* One line without its end, at most `columns` - 1 characters; a narrow
 * terminal shortens the bar first, then the facts behind it. */
size_t
progress_format(char text[PROGRESS_SIZE], const struct progress_facts *facts,
                bool bar, unsigned columns);

void
progress_start(struct progress *progress, const struct channel *to, bool quiet,
               int64_t now_us);
void
progress_show(struct progress *progress, const struct progress_facts *facts,
              int64_t now_us);

/* All done: a bar on the terminal is filled and ended by a newline. */
void
progress_finish(struct progress *progress);

/* A message follows: the line on the terminal is blanked. */
void
progress_erase(struct progress *progress);

#endif
