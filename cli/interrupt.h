/* interrupt.h - Ctrl-C: the first asks, the second leaves.
 *
 * After interrupt_start, SIGINT, SIGTERM and SIGHUP set a flag and make
 * interrupt_fd readable; a second one ends the process at once with status 130.
 * A worker dies with its parent, so nothing stays behind. */
#ifndef CLI_INTERRUPT_H
#define CLI_INTERRUPT_H

#include <stdbool.h>

/* Once per process; harmless if called again. */
void
interrupt_start(void);

bool
interrupted(void);

/* For poll: readable from the first interruption on; -1 before start. */
int
interrupt_fd(void);

/* Sleep, unless interrupted before or meanwhile. */
void
interrupt_wait(int ms);

#endif
