/* names.h - the names of one array (or of the tree of objects), to find a
 * reference and to notice that a name is given twice.
 *
 * Fill, sort once, then ask. Memory is the arena's. */
#ifndef CORE_SCENE_NAMES_H
#define CORE_SCENE_NAMES_H

#include "core/base/arena.h"
#include "core/base/json.h"

struct name_entry {
    const char *name;
    const struct json *node; /* the string */
    uint32_t index;          /* in its array */
};

struct names {
    struct name_entry *items;
    uint32_t count, capacity;
};

void
names_add(struct names *names, const struct json *node, uint32_t index,
          struct arena *arena);

/* By name, equal ones in document order. */
void
names_sort(struct names *names);

/* The first entry of that name, or NULL. */
const struct name_entry *
names_find(const struct names *names, const char *name);

/* As json_did_you_mean, among these names. */
const char *
names_nearest(const struct names *names, const char *word, struct arena *arena);

#endif
