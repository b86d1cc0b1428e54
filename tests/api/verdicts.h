/* verdicts.h - what a reader says about many documents, for the tests that
 * compare it with a JSON Schema.
 *
 * On standard input stand documents, each behind a line with its length in
 * bytes. On standard output comes one line of JSON for each:
 *
 *     {"ok":false,"truncated":false,
 *      "errors":[{"code":...,"pointer":...,"line":...,"column":...,
 *                 "detail":...}]}
 *
 * Exit status 0; 2 if the input is not of that form. */
#ifndef TESTS_API_VERDICTS_H
#define TESTS_API_VERDICTS_H

#include <stddef.h>

#include "core/base/arena.h"
#include "core/base/error.h"

/* Read one document; what is wrong with it goes into `errors`. */
typedef void (*verdicts_fn)(const char *text, size_t len, struct arena *arena,
                            struct error_list *errors);

int
verdicts_main(verdicts_fn read);

#endif
