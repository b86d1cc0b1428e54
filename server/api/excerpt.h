/* excerpt.h - a place in a text, shown to a reader. Lines end with LF, CR LF or
 * CR; columns count characters; a leading byte-order mark is no column (as in
 * core/base/json.h). Pure; any thread. */
#ifndef SERVER_API_EXCERPT_H
#define SERVER_API_EXCERPT_H

#include <stdint.h>

#include "core/base/bytes.h"

/* Bytes before that character; len if the text ends earlier. */
size_t
excerpt_offset(const char *text, size_t len, uint32_t line, uint32_t column);

/* Two lines: the text's line, cut to 72 characters around the place, and a
 * caret below it. Control characters and broken UTF-8 are shown as '?', tabs as
 * one space. */
void
excerpt_write(const char *text, size_t len, uint32_t line, uint32_t column,
              struct bytes *out);

#endif
