/* clock.h - two clocks. Monotonic time measures and expires (leases, deadlines,
 * stages); wall time is for display only. Any thread. */
#ifndef CORE_BASE_CLOCK_H
#define CORE_BASE_CLOCK_H

#include <stdint.h>

int64_t
clock_monotonic_us(void);
int64_t
clock_wall_ms(void); /* since 1970-01-01T00:00:00Z */

enum {
    CLOCK_RFC3339_SIZE = 32 /* "2026-11-22T11:30:00.123Z" and a NUL */
};

/* RFC 3339 in UTC with milliseconds. */
void
clock_rfc3339(int64_t wall_ms, char text[CLOCK_RFC3339_SIZE]);

#endif
