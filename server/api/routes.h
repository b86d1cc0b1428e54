/* routes.h - the table of everything the service can do. */
#ifndef SERVER_API_ROUTES_H
#define SERVER_API_ROUTES_H

#include "server/api/inside.h"

typedef enum http_verdict (*route_fn)(struct call *call);

enum route_body {
    BODY_NONE,  /* at most a few bytes, ignored or an empty object */
    BODY_SCENE, /* max_scene_bytes */
    BODY_FORM   /* a scene in a form: each byte may be written as three */
};

struct route {
    const char *method;
    const char *path;  /* "{...}" stands for one part of a path */
    const char *query; /* parameters allowed, separated by spaces */
    enum route_body body;
    route_fn handle;
};

extern const struct route routes[];
extern const size_t route_count;

/* The row for method and path; HEAD is GET. NULL if there is none: then
 * *path_known tells 405 from 404. *param, in `arena`, is the part at {...}. */
const struct route *
route_find(const char *method, const char *path, struct arena *arena,
           const char **param, bool *path_known);

/* The Allow header of a path: "GET, HEAD, DELETE". */
const char *
route_allow(const char *path, struct arena *arena);

/* A path of the table that is nearly this one, or NULL. */
const char *
route_near(const char *path);

/* Is the parameter in the row's list? */
bool
route_has_query(const struct route *route, const char *name);

/* What the routes do, by file. */
enum http_verdict
render_post(struct call *call); /* render.c */
enum http_verdict
render_form(struct call *call); /* of the page, a form */
enum http_verdict
jobs_post(struct call *call); /* jobs.c */
enum http_verdict
jobs_list(struct call *call); /* job_list.c */
enum http_verdict
job_get(struct call *call);
enum http_verdict
job_cancel(struct call *call);
enum http_verdict
job_delete(struct call *call);
enum http_verdict
job_result(struct call *call); /* results.c */
enum http_verdict
scenes_validate(struct call *call); /* scenes.c */
enum http_verdict
scenes_examples(struct call *call);
enum http_verdict
scenes_example(struct call *call);
enum http_verdict
meta_livez(struct call *call); /* meta.c */
enum http_verdict
meta_readyz(struct call *call);
enum http_verdict
meta_version(struct call *call);
enum http_verdict
meta_openapi(struct call *call);
enum http_verdict
meta_schema(struct call *call);
enum http_verdict
page_form(struct call *call); /* pages.c */
enum http_verdict
page_problem(struct call *call);
enum http_verdict
page_style(struct call *call);

#endif
