#include "server/api/excerpt.h"

#include <string.h>

enum { WIDTH = 72, BEFORE = 48 };

/* Bytes of the character at text[0]; 1 for what is not UTF-8, *good false. */
static size_t
character(const char *text, size_t len, bool *good)
{
    unsigned char first = (unsigned char)text[0];
    size_t size = first < 0x80             ? 1
                  : (first & 0xe0) == 0xc0 ? 2
                  : (first & 0xf0) == 0xe0 ? 3
                  : (first & 0xf8) == 0xf0 ? 4
                                           : 0;
    size_t i;

    *good = size > 0 && size <= len && !(first >= 0xc0 && first < 0xc2) &&
            first < 0xf5;
    for (i = 1; *good && i < size; i++)
        *good = ((unsigned char)text[i] & 0xc0) == 0x80;
    if (*good && size == 3) {
        unsigned char second = (unsigned char)text[1];

        *good = !(first == 0xe0 && second < 0xa0) &&
                !(first == 0xed && second >= 0xa0);
    } else if (*good && size == 4) {
        unsigned char second = (unsigned char)text[1];

        *good = !(first == 0xf0 && second < 0x90) &&
                !(first == 0xf4 && second >= 0x90);
    }
    return *good ? size : 1;
}

static size_t
line_begin(const char *text, size_t len, uint32_t line)
{
    size_t at = len >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0 ? 3 : 0;
    uint32_t k;

    for (k = 1; k < line && at < len; at++) {
        if (text[at] == '\r' && at + 1 < len && text[at + 1] == '\n')
            continue;
        if (text[at] == '\n' || text[at] == '\r')
            k++;
    }
    return at;
}

size_t
excerpt_offset(const char *text, size_t len, uint32_t line, uint32_t column)
{
    size_t at = line_begin(text, len, line);
    uint32_t k;
    bool good;

    for (k = 1; k < column && at < len; k++)
        at += character(text + at, len - at, &good);
    return at;
}

void
excerpt_write(const char *text, size_t len, uint32_t line, uint32_t column,
              struct bytes *out)
{
    uint32_t first = column > BEFORE ? column - BEFORE + 1 : 1;
    size_t at = excerpt_offset(text, len, line, first);
    uint32_t k;

    for (k = 0; k < WIDTH && at < len; k++) {
        bool good;
        size_t size = character(text + at, len - at, &good);

        if (text[at] == '\n' || text[at] == '\r')
            break;
        if (text[at] == '\t')
            bytes_text(out, " ");
        else if (!good || (unsigned char)text[at] < 0x20 || text[at] == 0x7f)
            bytes_text(out, "?");
        else
            bytes_append(out, text + at, size);
        at += size;
    }
    bytes_text(out, "\n");
    for (k = first; k < column; k++)
        bytes_text(out, " ");
    bytes_text(out, "^");
}
