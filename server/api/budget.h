/* budget.h - is a render within this service's limits, and what would be?
 * API section 7. */
#ifndef SERVER_API_BUDGET_H
#define SERVER_API_BUDGET_H

#include "server/api/order.h"

/* order->cost against the limits. False: answered 422 budget-exceeded with what
 * was requested, what is allowed and the nearest settings that fit. */
bool
budget_check(struct call *call, const struct order *order);

/* The same answer for a scene that its reader refused with budget.rays. */
enum http_verdict
budget_refuse(struct call *call, const struct order *order);

/* The same members for a document refused with budget.* errors: `user` is the
 * order. Only a film that is too large has numbers to say. */
void
budget_write_pixels(struct json_writer *w, const void *user);

/* The largest film of about the same shape with at most `max_pixels`. */
void
budget_fit_film(double width, double height, double max_pixels,
                uint32_t *fit_width, uint32_t *fit_height);

#endif
