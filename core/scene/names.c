#include "core/scene/names.h"

#include <stdlib.h>
#include <string.h>

void
names_add(struct names *names, const struct json *node, uint32_t index,
          struct arena *arena)
{
    if (names->count == names->capacity) {
        uint32_t capacity = names->capacity == 0 ? 16 : names->capacity * 2;
        struct name_entry *items =
            arena_array(arena, capacity, sizeof(struct name_entry));
        if (items == NULL)
            return; /* the arena remembers */
        if (names->count > 0)
            memcpy(items, names->items, names->count * sizeof *items);
        names->items = items;
        names->capacity = capacity;
    }
    names->items[names->count++] =
        (struct name_entry){.name = node->string, .node = node, .index = index};
}

static int
compare(const void *left, const void *right)
{
    const struct name_entry *a = left, *b = right;
    int order = strcmp(a->name, b->name);
    if (order != 0)
        return order;
    return a->node->begin < b->node->begin ? -1 : 1;
}

void
names_sort(struct names *names)
{
    if (names->count > 1)
        qsort(names->items, names->count, sizeof(struct name_entry), compare);
}

const struct name_entry *
names_find(const struct names *names, const char *name)
{
    uint32_t low = 0, high = names->count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (strcmp(names->items[middle].name, name) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    if (low < names->count && strcmp(names->items[low].name, name) == 0)
        return &names->items[low];
    return NULL;
}

const char *
names_nearest(const struct names *names, const char *word, struct arena *arena)
{
    const char **list = arena_array(arena, names->count, sizeof(const char *));
    if (list == NULL)
        return NULL;
    for (uint32_t i = 0; i < names->count; i++)
        list[i] = names->items[i].name;
    return json_did_you_mean(word, list, names->count);
}
