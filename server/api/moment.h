/* moment.h - RFC 3339 text -> wall time. Pure; any thread. */
#ifndef SERVER_API_MOMENT_H
#define SERVER_API_MOMENT_H

#include <stdbool.h>
#include <stdint.h>

/* "2026-11-22T11:30:00Z", "2026-11-22T12:30:00.5+01:00" -> milliseconds since
 * 1970-01-01T00:00:00Z. False if it is no such text or no such moment. */
bool
moment_read(const char *text, int64_t *wall_ms);

#endif
