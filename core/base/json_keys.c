#include "core/base/json_keys.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/utf8.h"

bool
json_keys_add(struct json_keys *keys, const struct json_key *key)
{
    if (keys->count == keys->capacity) {
        size_t capacity = keys->capacity == 0 ? 64 : keys->capacity * 2;
        struct json_key *items = realloc(keys->items, capacity * sizeof *items);
        if (items == NULL) {
            free(key->decoded);
            return false;
        }
        keys->items = items;
        keys->capacity = capacity;
    }
    keys->items[keys->count++] = *key;
    return true;
}

void
json_keys_drop(struct json_keys *keys, size_t first)
{
    while (keys->count > first)
        free(keys->items[--keys->count].decoded);
}

static int
key_compare(const void *left, const void *right)
{
    const struct json_key *a = *(const struct json_key *const *)left;
    const struct json_key *b = *(const struct json_key *const *)right;
    size_t len = a->len < b->len ? a->len : b->len;
    int order = memcmp(a->text, b->text, len);
    if (order != 0)
        return order;
    if (a->len != b->len)
        return a->len < b->len ? -1 : 1;
    return a->offset < b->offset ? -1 : 1; /* equal names: document order */
}

static bool
same_name(const struct json_key *a, const struct json_key *b)
{
    return a->len == b->len && memcmp(a->text, b->text, a->len) == 0;
}

/* By name. Few: insertion; many: merge sort in glibc, so no input is slow. */
static void
sort(const struct json_key **sorted, size_t count)
{
    if (count > 8) {
        qsort(sorted, count, sizeof(const struct json_key *), key_compare);
        return;
    }
    for (size_t i = 1; i < count; i++) {
        for (size_t j = i; j > 0 && key_compare(&sorted[j - 1], &sorted[j]) > 0;
             j--) {
            const struct json_key *swap = sorted[j];
            sorted[j] = sorted[j - 1];
            sorted[j - 1] = swap;
        }
    }
}

bool
json_keys_duplicate(const struct json_keys *keys, size_t first, size_t end,
                    const struct json_key **key,
                    const struct json_key **original)
{
    const struct json_key *few[16], **sorted = few;
    size_t count = end - first;
    *key = NULL;
    if (count < 2)
        return true;
    if (count > 16)
        sorted = malloc(count * sizeof(const struct json_key *));
    if (sorted == NULL)
        return false;
    for (size_t i = 0; i < count; i++)
        sorted[i] = &keys->items[first + i];
    sort(sorted, count);
    for (size_t i = 0, run = 0; i < count; i++) {
        if (!same_name(sorted[run], sorted[i]))
            run = i;
        if (i > run && (*key == NULL || sorted[i]->offset < (*key)->offset)) {
            *key = sorted[i];
            *original = sorted[run];
        }
    }
    if (sorted != few)
        free(sorted);
    return true;
}

static int
hex_value(char c)
{
    if (c >= '0' && c <= '9')
        return c - '0';
    if (c >= 'a' && c <= 'f')
        return c - 'a' + 10;
    if (c >= 'A' && c <= 'F')
        return c - 'A' + 10;
    return -1;
}

int32_t
json_hex4(const char *text, size_t len, size_t at)
{
    int32_t value = 0;
    if (len < at + 4)
        return -1;
    for (size_t i = at; i < at + 4; i++) {
        int digit = hex_value(text[i]);
        if (digit < 0)
            return -1;
        value = value * 16 + digit;
    }
    return value;
}

char *
json_key_decode(const char *text, size_t begin, size_t end, uint32_t *len)
{
    static const char from[] = "bfnrt", to[] = "\b\f\n\r\t";
    char *out = malloc(end - begin + 1);
    size_t n = 0;
    if (out == NULL)
        return NULL;
    for (size_t i = begin; i < end;) {
        if (text[i] != '\\') {
            out[n++] = text[i++];
        } else if (text[i + 1] != 'u') {
            const char *e = strchr(from, text[i + 1]);
            out[n++] = e != NULL ? to[e - from] : text[i + 1];
            i += 2;
        } else {
            uint32_t c = (uint32_t)json_hex4(text, end, i + 2);
            i += 6;
            if (c >= 0xd800 && c <= 0xdfff) {
                c = 0x10000 + ((c - 0xd800) << 10) +
                    ((uint32_t)json_hex4(text, end, i + 2) - 0xdc00);
                i += 6;
            }
            n += utf8_put(c, out + n);
        }
    }
    *len = (uint32_t)n;
    return out;
}

void
json_key_token(const struct json_key *key, struct bytes *out)
{
    for (uint32_t i = 0; i < key->len; i++) {
        if (key->text[i] == '~')
            bytes_text(out, "~0");
        else if (key->text[i] == '/')
            bytes_text(out, "~1");
        else
            bytes_append(out, &key->text[i], 1);
    }
}
