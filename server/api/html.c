#include "server/api/html.h"

#include <string.h>

void
html_text(struct bytes *out, const char *text, size_t len)
{
    size_t i;

    for (i = 0; i < len; i++) {
        switch (text[i]) {
        case '&': bytes_text(out, "&amp;"); break;
        case '<': bytes_text(out, "&lt;"); break;
        case '>': bytes_text(out, "&gt;"); break;
        case '"': bytes_text(out, "&quot;"); break;
        case '\'': bytes_text(out, "&#39;"); break;
        default: bytes_append(out, text + i, 1); break;
        }
    }
}

/* The distance to the next `mark` in a line, or 0 if there is none. */
static size_t
reach(const char *text, size_t len, const char *mark)
{
    size_t n = strlen(mark), i;

    for (i = 0; i + n <= len; i++)
        if (memcmp(text + i, mark, n) == 0)
            return i;
    return 0;
}

/* [text](target) at the beginning; returns its length, 0 if it is none. */
static size_t
write_link(struct bytes *out, const char *text, size_t len)
{
    size_t close = reach(text, len, "]("), end;

    if (close == 0)
        return 0;
    end = reach(text + close + 2, len - close - 2, ")");
    if (end == 0)
        return 0;
    bytes_text(out, "<a href=\"");
    html_text(out, text + close + 2, end);
    bytes_text(out, "\">");
    html_text(out, text + 1, close - 1);
    bytes_text(out, "</a>");
    return close + 2 + end + 1;
}

/* One line with its inner marks. */
static void
write_inline(struct bytes *out, const char *text, size_t len)
{
    size_t i = 0, n;

    while (i < len) {
        const char *at = text + i;
        size_t left = len - i;

        if (at[0] == '`' && (n = reach(at + 1, left - 1, "`")) > 0) {
            bytes_text(out, "<code>");
            html_text(out, at + 1, n);
            bytes_text(out, "</code>");
            i += n + 2;
        } else if (left > 4 && memcmp(at, "**", 2) == 0 &&
                   (n = reach(at + 2, left - 2, "**")) > 0) {
            bytes_text(out, "<strong>");
            html_text(out, at + 2, n);
            bytes_text(out, "</strong>");
            i += n + 4;
        } else if (at[0] == '[' && (n = write_link(out, at, left)) > 0) {
            i += n;
        } else {
            html_text(out, at, 1);
            i++;
        }
    }
}

static void
write_heading(struct bytes *out, const char *line, size_t len, size_t level,
              const char *suffix)
{
    const char *text = line + level + 1;
    size_t n = len - level - 1;

    bytes_printf(out, "<h%zu", level);
    if (n > 2 && text[0] == '`' && text[n - 1] == '`') {
        bytes_text(out, " id=\"");
        html_text(out, text + 1, n - 2);
        html_text(out, suffix, strlen(suffix));
        bytes_text(out, "\"");
    }
    bytes_text(out, ">");
    write_inline(out, text, n);
    bytes_printf(out, "</h%zu>\n", level);
}

/* What is open, and must be closed before another block. */
enum block { BLOCK_NONE, BLOCK_PARAGRAPH, BLOCK_LIST, BLOCK_CODE };

static void
turn_to(struct bytes *out, enum block *open, enum block next)
{
    static const char *const begin[] = {"", "<p>", "<ul>\n", "<pre>"};
    static const char *const end[] = {"", "</p>\n", "</ul>\n", "</pre>\n"};

    if (*open == next)
        return;
    bytes_text(out, end[*open]);
    bytes_text(out, begin[next]);
    *open = next;
}

static size_t
heading_level(const char *line, size_t len)
{
    size_t level = 0;

    while (level < len && level < 3 && line[level] == '#')
        level++;
    return level > 0 && level < len && line[level] == ' ' ? level : 0;
}

static void
write_line(struct bytes *out, enum block *open, const char *line, size_t len,
           const char *suffix)
{
    size_t level = heading_level(line, len);

    if (len == 0) {
        turn_to(out, open, BLOCK_NONE);
    } else if (level > 0) {
        turn_to(out, open, BLOCK_NONE);
        write_heading(out, line, len, level, suffix);
    } else if (len > 2 && memcmp(line, "- ", 2) == 0) {
        turn_to(out, open, BLOCK_LIST);
        bytes_text(out, "<li>");
        write_inline(out, line + 2, len - 2);
        bytes_text(out, "</li>\n");
    } else {
        if (*open == BLOCK_LIST)
            turn_to(out, open, BLOCK_NONE);
        if (*open == BLOCK_PARAGRAPH)
            bytes_text(out, "\n");
        turn_to(out, open, BLOCK_PARAGRAPH);
        write_inline(out, line, len);
    }
}

void
html_marks(struct bytes *out, const char *text, size_t len, const char *suffix)
{
    enum block open = BLOCK_NONE;
    size_t i = 0;

    while (i < len) {
        const char *line = text + i;
        const char *end = memchr(line, '\n', len - i);
        size_t n = end ? (size_t)(end - line) : len - i;
        bool fence = n >= 3 && memcmp(line, "```", 3) == 0;

        i += n + 1;
        if (fence) {
            turn_to(out, &open, open == BLOCK_CODE ? BLOCK_NONE : BLOCK_CODE);
        } else if (open == BLOCK_CODE) {
            html_text(out, line, n);
            bytes_text(out, "\n");
        } else {
            write_line(out, &open, line, n, suffix);
        }
    }
    turn_to(out, &open, BLOCK_NONE);
}

static int
hex_digit(char c)
{
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
}

size_t
form_decode(const char *text, size_t len, char *out)
{
    size_t i, n = 0;

    for (i = 0; i < len; i++) {
        int high = i + 2 < len ? hex_digit(text[i + 1]) : -1;
        int low = i + 2 < len ? hex_digit(text[i + 2]) : -1;

        if (text[i] == '%' && high >= 0 && low >= 0) {
            out[n++] = (char)(high * 16 + low);
            i += 2;
        } else {
            out[n++] = text[i] == '+' ? ' ' : text[i];
        }
    }
    out[n] = '\0';
    return n;
}
