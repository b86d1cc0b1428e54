/* utf8.h - one character of UTF-8 at a time (RFC 3629). Pure; any thread. */
#ifndef CORE_BASE_UTF8_H
#define CORE_BASE_UTF8_H

#include <stddef.h>
#include <stdint.h>

/* Bytes of the well-formed character at `text`, 1...4; 0 if there is none
 * within `len` bytes: overlong, surrogate, beyond U+10FFFF or cut short. */
size_t
utf8_length(const char *text, size_t len);

/* Write a code point (no surrogate, at most U+10FFFF); returns 1...4. */
size_t
utf8_put(uint32_t code_point, char text[4]);

/* Characters in `len` bytes of well-formed text. */
size_t
utf8_count(const char *text, size_t len);

#endif
