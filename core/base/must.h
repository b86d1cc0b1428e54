/* must.h - our own promises, always checked.
 *
 * MUST(x) stops the process with file and line when x is false. It guards what
 * our code promised itself, never what a client sent: a dead worker costs one
 * attempt, so wrong is worse than dead. */
#ifndef CORE_BASE_MUST_H
#define CORE_BASE_MUST_H

_Noreturn void
must_fail(const char *file, int line, const char *promise);

#define MUST(promise)                                                          \
    ((promise) ? (void)0 : must_fail(__FILE__, __LINE__, #promise))

#endif
