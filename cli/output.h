/* output.h - how glint speaks: data on standard output, messages on standard
 * error, colour only for eyes.
 *
 * Text that came from outside (file names, JSON, a server's answer) may hold
 * terminal escapes; everything here prints control characters as '?'. One
 * thread. */
#ifndef CLI_OUTPUT_H
#define CLI_OUTPUT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "core/base/bytes.h"
#include "core/base/error.h"
#include "core/base/json.h"
#include "core/scene/scene_lint.h"

struct channel {
    FILE *file;
    bool terminal;    /* a terminal that can move its cursor (not TERM=dumb) */
    bool color;       /* terminal, and neither NO_COLOR nor --no-color */
    unsigned columns; /* of the terminal; 80 where unknown */
};

struct channel
channel_open(FILE *file, bool no_color);

/* "glint: sentence", then what was tried ("glint render: ..."). */
void
say_error(const struct channel *to, const char *who, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Text with every control character but tab and newline made '?', and every
 * byte that is not UTF-8 too. */
void
text_put_safe(struct bytes *out, const char *text, size_t len);

/* "412 KB" (1000 bytes), "28.4 s" or "3:07". */
enum { AMOUNT_SIZE = 32 };
void
amount_bytes(uint64_t bytes, char text[AMOUNT_SIZE]);
void
amount_seconds(double seconds, char text[AMOUNT_SIZE]);

/* One thing wrong with a document, from our reader, our lint or a server. */
struct finding {
    bool warning;
    const char *code, *detail;
    const char *pointer;   /* NULL: no place */
    const char *hint;      /* or NULL */
    const char *fix;       /* JSON Patch text, or NULL */
    uint32_t line, column; /* 0: no place */
};

struct finding
finding_of_error(const struct error_item *item);
struct finding
finding_of_lint(const struct lint_item *item);

/* A finding with its source line, a caret and the help line:
 *
 *     mine.json:14:17: error: /objects/2/radius must be ...  [number.too_small]
 *        14 |       "radius": -1,
 *           |                 ^^
 *        help: a radius is a length
 *
 * `text` is the document the line counts in; NULL prints no excerpt. Long lines
 * are cut around the caret. */
void
finding_print(const struct channel *to, const char *name, const char *text,
              size_t len, const struct finding *finding);

/* One member of errors[] or warnings[] of a problem body. */
struct json_writer;
void
finding_write(struct json_writer *w, const struct finding *finding);

#endif
