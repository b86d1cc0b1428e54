#include "core/base/json_write.h"

#include <stddef.h>
#include <string.h>

#include "core/base/must.h"
#include "core/base/number.h"
#include "core/base/utf8.h"

static void
put_text(struct bytes *out, const char *text, size_t len)
{
    static const char hex[] = "0123456789abcdef";
    bytes_append(out, "\"", 1);
    size_t plain = 0; /* start of the run not yet copied */
    size_t i = 0;
    while (i < len) {
        unsigned char c = (unsigned char)text[i];
        size_t n = c < 0x80 ? 1 : utf8_length(text + i, len - i);
        if (n > 0 && c >= 0x20 && c != '"' && c != '\\') {
            i += n;
            continue;
        }
        bytes_append(out, text + plain, i - plain);
        if (n == 0) {
            bytes_text(out, "\xef\xbf\xbd"); /* U+FFFD */
        } else if (c == '"' || c == '\\') {
            char pair[2] = {'\\', (char)c};
            bytes_append(out, pair, 2);
        } else if (c == '\n') {
            bytes_append(out, "\\n", 2);
        } else {
            char escape[6] = {'\\', 'u', '0', '0', hex[c >> 4], hex[c & 15]};
            bytes_append(out, escape, 6);
        }
        i++;
        plain = i;
    }
    bytes_append(out, text + plain, len - plain);
    bytes_append(out, "\"", 1);
}

/* The comma before a member, and its name. */
static void
begin_value(struct json_writer *w, const char *key)
{
    uint64_t level = UINT64_C(1) << w->depth;
    if (w->started & level)
        bytes_append(w->out, ",", 1);
    w->started |= level;
    if (key != NULL) {
        put_text(w->out, key, strlen(key));
        bytes_append(w->out, ":", 1);
    }
}

static void
begin_level(struct json_writer *w, const char *key, const char *bracket)
{
    begin_value(w, key);
    MUST(w->depth < 62);
    w->depth++;
    w->started &= ~(UINT64_C(1) << w->depth);
    bytes_append(w->out, bracket, 1);
}

static void
end_level(struct json_writer *w, const char *bracket)
{
    MUST(w->depth > 0);
    w->depth--;
    bytes_append(w->out, bracket, 1);
}

void
json_begin_object(struct json_writer *w, const char *key)
{
    begin_level(w, key, "{");
}

void
json_end_object(struct json_writer *w)
{
    end_level(w, "}");
}

void
json_begin_array(struct json_writer *w, const char *key)
{
    begin_level(w, key, "[");
}

void
json_end_array(struct json_writer *w)
{
    end_level(w, "]");
}

void
json_put_string(struct json_writer *w, const char *key, const char *text)
{
    json_put_stringn(w, key, text, strlen(text));
}

void
json_put_stringn(struct json_writer *w, const char *key, const char *text,
                 size_t len)
{
    begin_value(w, key);
    put_text(w->out, text, len);
}

void
json_put_number(struct json_writer *w, const char *key, double number)
{
    char text[NUMBER_SIZE];
    size_t len = number_text(number, text);
    json_put_raw(w, key, text, len);
}

void
json_put_integer(struct json_writer *w, const char *key, int64_t number)
{
    begin_value(w, key);
    bytes_printf(w->out, "%lld", (long long)number);
}

void
json_put_bool(struct json_writer *w, const char *key, bool value)
{
    json_put_raw(w, key, value ? "true" : "false", value ? 4 : 5);
}

void
json_put_null(struct json_writer *w, const char *key)
{
    json_put_raw(w, key, "null", 4);
}

void
json_put_raw(struct json_writer *w, const char *key, const char *json,
             size_t len)
{
    begin_value(w, key);
    bytes_append(w->out, json, len);
}

void
json_put_string_or_null(struct json_writer *w, const char *key,
                        const char *text)
{
    if (text == NULL)
        json_put_null(w, key);
    else
        json_put_string(w, key, text);
}
