/* examples.h - the lesson scenes of schemas/examples, inside the program. */
#ifndef CLI_EXAMPLES_H
#define CLI_EXAMPLES_H

#include <stddef.h>

struct example {
    const char *name; /* "course-table-fresnel" */
    const char *text; /* NUL-terminated JSON */
    size_t len;
};

/* Sorted by name. */
extern const struct example examples[];
extern const size_t example_count;

/* NULL if there is none of that name. */
const struct example *
example_find(const char *name);

/* The name nearest to a mistyped one, or NULL. */
const char *
example_near(const char *name);

#endif
