/* events.h - who waits for which job, and whom a change wakes.
 *
 * The store's writer thread says that a job changed; the parked requests that
 * watch it get their next turn, and the pool looks for work. A ticket is in the
 * table only while its request is alive, and it is woken under the table's
 * lock: once a request is over, nobody touches http for it. Any thread. */
#ifndef SERVER_API_EVENTS_H
#define SERVER_API_EVENTS_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/error.h"
#include "server/http/http.h"
#include "server/pool/pool.h"

struct events;

struct events *
events_new(struct error *err);
void
events_free(struct events *events);

/* NULL: none, and no call to the former one is under way any more. Whoever
 * watched before http was connected is woken now. */
void
events_connect_http(struct events *events, struct http *http);
void
events_connect_pool(struct events *events, struct pool *pool);

/* From now on a change of `job` wakes this ticket. Watch first, then look at
 * the job: no change is missed. False: out of memory. */
bool
events_watch(struct events *events, const char *job, uint64_t ticket);
void
events_unwatch(struct events *events, const char *job, uint64_t ticket);

unsigned
events_watchers(struct events *events, const char *job);

/* Wake everyone who watches `job`. */
void
events_changed(struct events *events, const char *job);

/* pool_kick, if a pool is connected. */
void
events_kick_pool(struct events *events);

/* pool_status; false, and zeroes, if no pool is connected. */
bool
events_pool_status(struct events *events, struct pool_status *status);

#endif
