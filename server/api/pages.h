/* pages.h - the page with the form, which works without JavaScript, and how a
 * render answers there. English and German: ?lang= or Accept-Language. */
#ifndef SERVER_API_PAGES_H
#define SERVER_API_PAGES_H

#include "server/api/inside.h"

/* The scene posted by the form, into visit->form_scene; from now on problems
 * are shown on the page. False: answered. */
bool
page_read_form(struct call *call, size_t *len);

/* 200: the page with the result of this job. */
enum http_verdict
page_picture(struct call *call, const struct job *job);

#endif
