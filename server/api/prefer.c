#include "server/api/prefer.h"

#include <string.h>
#include <strings.h>

/* A run of bytes in a header. */
struct span {
    const char *at;
    size_t len;
};

static bool
is_space(char c)
{
    return c == ' ' || c == '\t';
}

static struct span
trim(struct span s)
{
    while (s.len > 0 && is_space(s.at[0])) {
        s.at++;
        s.len--;
    }
    while (s.len > 0 && is_space(s.at[s.len - 1]))
        s.len--;
    return s;
}

static bool
span_is(struct span s, const char *word)
{
    return s.len == strlen(word) && strncasecmp(s.at, word, s.len) == 0;
}

/* Cuts the next part ending at `separator` (outside quotes) off *rest. */
static bool
next_part(struct span *rest, char separator, struct span *part)
{
    bool quoted = false;
    size_t i;

    if (!rest->at)
        return false;
    for (i = 0; i < rest->len; i++) {
        if (quoted && rest->at[i] == '\\' && i + 1 < rest->len)
            i++;
        else if (rest->at[i] == '"')
            quoted = !quoted;
        else if (rest->at[i] == separator && !quoted)
            break;
    }
    *part = trim((struct span){rest->at, i});
    if (i < rest->len) {
        rest->at += i + 1;
        rest->len -= i + 1;
    } else {
        rest->at = NULL;
    }
    return true;
}

static struct span
whole(const char *text)
{
    return (struct span){text, text ? strlen(text) : 0};
}

/* "wait=10" -> name, value without quotes; value.at NULL if there is none. */
static void
split_value(struct span part, struct span *name, struct span *value)
{
    const char *equals = part.len ? memchr(part.at, '=', part.len) : NULL;

    *name = part;
    *value = (struct span){0};
    if (!equals)
        return;
    *name = trim((struct span){part.at, (size_t)(equals - part.at)});
    *value = trim(
        (struct span){equals + 1, part.len - (size_t)(equals - part.at) - 1});
    if (value->len >= 2 && value->at[0] == '"' &&
        value->at[value->len - 1] == '"') {
        value->at++;
        value->len -= 2;
    }
}

static bool
read_seconds(struct span s, double *seconds)
{
    double value = 0;
    size_t i;

    if (s.len == 0 || s.len > 9)
        return false;
    for (i = 0; i < s.len; i++) {
        if (s.at[i] < '0' || s.at[i] > '9')
            return false;
        value = value * 10 + (s.at[i] - '0');
    }
    *seconds = value;
    return true;
}

bool
seconds_read(const char *text, double *seconds)
{
    return read_seconds(whole(text), seconds);
}

struct prefer
prefer_read(const char *header)
{
    struct prefer prefer = {0};
    struct span rest = whole(header), item;

    while (next_part(&rest, ',', &item)) {
        struct span first, name, value;

        if (!next_part(&item, ';', &first)) /* parameters mean nothing here */
            continue;
        split_value(first, &name, &value);
        if (span_is(name, "respond-async"))
            prefer.respond_async = true;
        else if (span_is(name, "wait") && !prefer.has_wait)
            prefer.has_wait = read_seconds(value, &prefer.wait);
    }
    return prefer;
}

/* "0.5" -> 500; a weight that cannot be read counts as 0. */
static int
read_weight(struct span s)
{
    int weight, digit = 100;
    size_t i;

    if (s.len == 0 || s.len > 5 || (s.at[0] != '0' && s.at[0] != '1') ||
        (s.len > 1 && s.at[1] != '.'))
        return 0;
    weight = (s.at[0] - '0') * 1000;
    for (i = 2; i < s.len; i++, digit /= 10) {
        if (s.at[i] < '0' || s.at[i] > '9')
            return 0;
        weight += (s.at[i] - '0') * digit;
    }
    return weight > 1000 ? 0 : weight;
}

/* How exactly a range names a type: 3 whole, 2 its first half, 1 any, 0 not. */
static int
range_fits(struct span range, const char *type)
{
    size_t half = strcspn(type, "/") + 1;

    if (span_is(range, type))
        return 3;
    if (range.len == half + 1 && range.at[half] == '*' &&
        strncasecmp(range.at, type, half) == 0)
        return 2;
    return span_is(range, "*/*") || span_is(range, "*") ? 1 : 0;
}

/* The weight that a whole Accept gives to one type, 0...1000. */
static int
accept_weight(const char *header, const char *type)
{
    struct span rest = whole(header), item;
    int best_fit = 0, best = 0;

    while (next_part(&rest, ',', &item)) {
        struct span range, part, name, value;
        int weight = 1000, fit;

        if (!next_part(&item, ';', &range))
            continue;
        while (next_part(&item, ';', &part)) {
            split_value(part, &name, &value);
            if (span_is(name, "q"))
                weight = read_weight(value);
        }
        fit = range_fits(range, type);
        if (fit > best_fit || (fit == best_fit && fit > 0 && weight > best)) {
            best_fit = fit;
            best = weight;
        }
    }
    return best;
}

int
accept_choose(const char *header, const char *const *types, size_t count)
{
    int chosen = -1, best = 0;
    size_t i;

    if (!header || trim(whole(header)).len == 0)
        return 0;
    for (i = 0; i < count; i++) {
        int weight = accept_weight(header, types[i]);

        if (weight > best) {
            best = weight;
            chosen = (int)i;
        }
    }
    return chosen;
}

/* The part of "de-AT" before the hyphen. */
static bool
language_is(struct span range, const char *code)
{
    const char *hyphen = range.len ? memchr(range.at, '-', range.len) : NULL;

    if (hyphen)
        range.len = (size_t)(hyphen - range.at);
    return span_is(range, code);
}

size_t
language_choose(const char *header, const char *const *codes, size_t count)
{
    struct span rest = whole(header), item;
    size_t chosen = 0, i;
    int best = 0;

    while (next_part(&rest, ',', &item)) {
        struct span range, part, name, value;
        int weight = 1000;

        if (!next_part(&item, ';', &range))
            continue;
        while (next_part(&item, ';', &part)) {
            split_value(part, &name, &value);
            if (span_is(name, "q"))
                weight = read_weight(value);
        }
        for (i = 0; i < count; i++) {
            if (weight > best && language_is(range, codes[i])) {
                best = weight;
                chosen = i;
            }
        }
    }
    return chosen;
}

bool
etag_listed(const char *header, const char *etag)
{
    struct span rest = whole(header), item;
    const char *opaque = strncmp(etag, "W/", 2) == 0 ? etag + 2 : etag;

    while (next_part(&rest, ',', &item)) {
        if (item.len >= 2 && strncmp(item.at, "W/", 2) == 0) {
            item.at += 2;
            item.len -= 2;
        }
        if ((item.len == 1 && item.at[0] == '*') ||
            (item.len == strlen(opaque) &&
             strncmp(item.at, opaque, item.len) == 0))
            return true;
    }
    return false;
}

bool
header_has_word(const char *header, const char *word)
{
    struct span rest = whole(header), item;

    while (next_part(&rest, ',', &item))
        if (span_is(item, word))
            return true;
    return false;
}
