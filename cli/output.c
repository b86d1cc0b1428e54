#include "cli/output.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "core/base/json_write.h"

enum {
    EXCERPT_MAX = 100 /* characters of a source line that are shown */
};

struct channel
channel_open(FILE *file, bool no_color)
{
    const char *term = getenv("TERM");
    const char *wish = getenv("NO_COLOR");
    struct channel to = {.file = file, .columns = 80};
    to.terminal = isatty(fileno(file)) && term != NULL &&
                  strcmp(term, "") != 0 && strcmp(term, "dumb") != 0;
    to.color = to.terminal && !no_color && (wish == NULL || *wish == '\0');
    struct winsize size;
    if (to.terminal && ioctl(fileno(file), TIOCGWINSZ, &size) == 0 &&
        size.ws_col > 0)
        to.columns = size.ws_col;
    return to;
}

/* ---- safe text ---- */

/* Bytes of the UTF-8 character at text, or 0 if it is none. */
static size_t
character_len(const unsigned char *text, size_t len)
{
    if (text[0] < 0x80)
        return 1;
    size_t need = text[0] >= 0xf0 ? 4 : text[0] >= 0xe0 ? 3 : 2;
    if (text[0] < 0xc2 || text[0] > 0xf4 || need > len)
        return 0;
    for (size_t i = 1; i < need; i++) {
        if ((text[i] & 0xc0) != 0x80)
            return 0;
    }
    return need;
}

/* C0, DEL and C1 can move a cursor; bidirectional controls can reorder what is
 * read. Neither has business in a message. */
static bool
is_control(const unsigned char *text, size_t len)
{
    if (len == 1)
        return (text[0] < 0x20 && text[0] != '\t' && text[0] != '\n') ||
               text[0] == 0x7f;
    if (len == 2)
        return text[0] == 0xc2 && text[1] < 0xa0;
    if (len == 3 && text[0] == 0xe2 && text[1] == 0x80)
        return text[2] >= 0xaa && text[2] <= 0xae;
    if (len == 3 && text[0] == 0xe2 && text[1] == 0x81)
        return text[2] >= 0xa6 && text[2] <= 0xa9;
    return false;
}

void
text_put_safe(struct bytes *out, const char *text, size_t len)
{
    const unsigned char *at = (const unsigned char *)text;
    while (len > 0) {
        size_t n = character_len(at, len);
        if (n == 0 || is_control(at, n))
            bytes_append(out, "?", 1);
        else
            bytes_append(out, at, n);
        at += n == 0 ? 1 : n;
        len -= n == 0 ? 1 : n;
    }
}

static void
put_bytes(const struct channel *to, struct bytes *text)
{
    if (text->len > 0)
        fwrite(text->data, 1, text->len, to->file);
    fflush(to->file);
    bytes_clear(text);
}

void
say_error(const struct channel *to, const char *who, const char *format, ...)
{
    struct bytes raw = {0}, safe = {0};
    va_list args;
    va_start(args, format);
    char *text = NULL;
    if (vasprintf(&text, format, args) < 0)
        text = NULL;
    va_end(args);
    bytes_printf(&raw, "%s", text ? text : "out of memory");
    free(text);
    bytes_printf(&safe, "%s%s:%s ", to->color ? "\033[1m" : "", who,
                 to->color ? "\033[0m" : "");
    text_put_safe(&safe, raw.data ? raw.data : "", raw.len);
    bytes_text(&safe, "\n");
    put_bytes(to, &safe);
    bytes_clear(&raw);
}

/* ---- amounts ---- */

void
amount_bytes(uint64_t bytes, char text[AMOUNT_SIZE])
{
    static const char *const units[] = {"bytes", "KB", "MB", "GB", "TB"};
    double value = (double)bytes;
    size_t unit = 0;
    /* 999.5 would be written 1000: it belongs to the next unit. */
    while (value >= 999.5 && unit < 4) {
        value /= 1000;
        unit++;
    }
    if (unit == 0)
        snprintf(text, AMOUNT_SIZE, "%d %s", (int)bytes,
                 bytes == 1 ? "byte" : "bytes");
    else
        snprintf(text, AMOUNT_SIZE, value < 9.95 ? "%.1f %s" : "%.0f %s", value,
                 units[unit]);
}

void
amount_seconds(double seconds, char text[AMOUNT_SIZE])
{
    if (seconds < 0.1)
        snprintf(text, AMOUNT_SIZE, "%.2f s", seconds);
    else if (seconds < 59.95)
        snprintf(text, AMOUNT_SIZE, "%.1f s", seconds);
    else if (seconds < 3599.5)
        snprintf(text, AMOUNT_SIZE, "%d:%02d", (int)(seconds + 0.5) / 60,
                 (int)(seconds + 0.5) % 60);
    else
        snprintf(text, AMOUNT_SIZE, "%ld:%02d:%02d",
                 (long)(seconds + 0.5) / 3600,
                 (int)((long)(seconds + 0.5) / 60 % 60),
                 (int)((long)(seconds + 0.5) % 60));
}

/* ---- findings ---- */

struct finding
finding_of_error(const struct error_item *item)
{
    return (struct finding){.code = error_code_name(item->code),
                            .detail = item->detail,
                            .pointer = item->pointer,
                            .hint = item->hint,
                            .fix = item->fix,
                            .line = item->line,
                            .column = item->column};
}

struct finding
finding_of_lint(const struct lint_item *item)
{
    return (struct finding){.warning = true,
                            .code = item->code,
                            .detail = item->detail,
                            .pointer = item->pointer,
                            .line = item->line,
                            .column = item->column};
}

/* Line `number` of a text, 1-based, without its end; LF, CR LF or CR. */
static bool
find_line(const char *text, size_t len, uint32_t number, const char **line,
          size_t *line_len)
{
    if (len >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0) {
        text += 3;
        len -= 3;
    }
    const char *end = text + len;
    for (uint32_t n = 1;; n++) {
        const char *stop = text;
        while (stop < end && *stop != '\n' && *stop != '\r')
            stop++;
        if (n == number) {
            *line = text;
            *line_len = (size_t)(stop - text);
            return true;
        }
        if (stop == end)
            return false;
        text = stop +
               (stop[0] == '\r' && stop + 1 < end && stop[1] == '\n' ? 2 : 1);
    }
}

/* Bytes of the JSON token that starts at `at`: a string with its quotes, a
 * number or word, else one character. */
static size_t
token_len(const char *at, size_t len)
{
    size_t n = 0;
    if (len > 0 && at[0] == '"') {
        for (n = 1; n < len && at[n] != '"'; n++) {
            if (at[n] == '\\')
                n++;
        }
        return n < len ? n + 1 : len;
    }
    while (n < len &&
           (strchr("+-.", at[n]) != NULL || (at[n] >= '0' && at[n] <= '9') ||
            ((at[n] | 32) >= 'a' && (at[n] | 32) <= 'z')))
        n++;
    return n > 0 ? n : 1;
}

static size_t
characters(const char *text, size_t len)
{
    size_t count = 0;
    for (size_t i = 0; i < len; i++)
        count += ((unsigned char)text[i] & 0xc0) != 0x80;
    return count;
}

/* Byte offset of character `index`, at most len. */
static size_t
character_offset(const char *text, size_t len, size_t index)
{
    size_t at = 0;
    while (at < len) {
        if (((unsigned char)text[at] & 0xc0) != 0x80 && index-- == 0)
            break;
        at++;
    }
    return at;
}

static void
put_excerpt(struct bytes *out, const struct channel *to, const char *text,
            size_t len, const struct finding *finding)
{
    const char *line;
    size_t line_len;
    if (finding->column == 0 ||
        !find_line(text, len, finding->line, &line, &line_len))
        return;

    /* Cut the line to a window that holds the caret. */
    size_t total = characters(line, line_len);
    size_t caret = finding->column - 1; /* may stand just behind the end */
    if (caret > total)
        return;
    size_t first = 0;
    if (total > EXCERPT_MAX && caret > EXCERPT_MAX - 30)
        first = caret - (EXCERPT_MAX - 30);
    size_t last = total - first > EXCERPT_MAX ? first + EXCERPT_MAX : total;
    size_t from = character_offset(line, line_len, first);
    size_t stop = character_offset(line, line_len, last);
    size_t mark = character_offset(line, line_len, caret);

    bytes_printf(out, "%5u | %s", finding->line, first > 0 ? "..." : "");
    text_put_safe(out, line + from, stop - from);
    bytes_printf(out, "%s\n      | %s", last < total ? "..." : "",
                 first > 0 ? "   " : "");
    for (size_t i = from; i < mark; i++) {
        if (((unsigned char)line[i] & 0xc0) != 0x80)
            bytes_text(out, line[i] == '\t' ? "\t" : " ");
    }
    size_t token = token_len(line + mark, line_len - mark);
    if (token > stop - mark)
        token = stop - mark;
    size_t width = characters(line + mark, token);
    bytes_text(out, to->color ? "\033[31;1m" : "");
    for (size_t i = 0; i < (width > 0 ? width : 1); i++)
        bytes_text(out, "^");
    bytes_printf(out, "%s\n", to->color ? "\033[0m" : "");
}

/* "did you mean" belongs into the sentence; every other hint below it. */
static bool
is_near_miss(const char *hint)
{
    return hint != NULL && strncasecmp(hint, "did you mean", 12) == 0;
}

static void
put_headline(struct bytes *out, const struct finding *finding)
{
    /* "must be ..." says of whom only together with its pointer. */
    if (strncmp(finding->detail, "must ", 5) == 0 && finding->pointer) {
        const char *whole = "the document";
        const char *who = *finding->pointer ? finding->pointer : whole;
        text_put_safe(out, who, strlen(who));
        bytes_text(out, " ");
    }
    text_put_safe(out, finding->detail, strlen(finding->detail));
    if (is_near_miss(finding->hint) &&
        strstr(finding->detail, "did you mean") == NULL) {
        bytes_text(out, ", d");
        text_put_safe(out, finding->hint + 1, strlen(finding->hint + 1));
    }
}

void
finding_print(const struct channel *to, const char *name, const char *text,
              size_t len, const struct finding *finding)
{
    struct bytes out = {0};
    const char *bold = to->color ? "\033[1m" : "";
    const char *tint = !to->color         ? ""
                       : finding->warning ? "\033[33;1m"
                                          : "\033[31;1m";
    const char *plain = to->color ? "\033[0m" : "";

    bytes_text(&out, bold);
    text_put_safe(&out, name, strlen(name));
    if (finding->line > 0)
        bytes_printf(&out, ":%u:%u", finding->line, finding->column);
    bytes_printf(&out, ":%s %s%s:%s ", plain, tint,
                 finding->warning ? "warning" : "error", plain);
    put_headline(&out, finding);
    bytes_text(&out, "  [");
    text_put_safe(&out, finding->code, strlen(finding->code));
    bytes_text(&out, "]\n");
    if (text != NULL && finding->line > 0)
        put_excerpt(&out, to, text, len, finding);
    if (finding->hint != NULL && !is_near_miss(finding->hint)) {
        bytes_printf(&out, "   %shelp:%s ", bold, plain);
        text_put_safe(&out, finding->hint, strlen(finding->hint));
        bytes_text(&out, "\n");
    }
    put_bytes(to, &out);
}

void
finding_write(struct json_writer *w, const struct finding *finding)
{
    json_begin_object(w, NULL);
    json_put_string_or_null(w, "pointer", finding->pointer);
    if (finding->line > 0) {
        json_put_integer(w, "line", finding->line);
        json_put_integer(w, "column", finding->column);
    }
    json_put_string(w, "code", finding->code);
    json_put_string(w, "detail", finding->detail);
    if (finding->hint != NULL)
        json_put_string(w, "hint", finding->hint);
    if (!finding->warning) {
        struct bytes help = {0};
        bytes_printf(&help, "/problems/%s#%s",
                     strncmp(finding->code, "json.", 5) == 0 ? "json-syntax"
                                                             : "scene-invalid",
                     finding->code);
        json_put_string(w, "help", help.data ? help.data : "");
        bytes_clear(&help);
    }
    if (finding->fix != NULL)
        json_put_raw(w, "fix", finding->fix, strlen(finding->fix));
    json_end_object(w);
}
