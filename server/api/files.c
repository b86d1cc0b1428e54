#include "server/api/files.h"

#include <string.h>

size_t
file_first(const char *prefix)
{
    size_t low = 0, high = file_count;

    while (low < high) {
        size_t middle = low + (high - low) / 2;

        if (strcmp(files[middle].name, prefix) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

const struct file *
file_find(const char *name)
{
    size_t at = file_first(name);

    if (at < file_count && strcmp(files[at].name, name) == 0)
        return &files[at];
    return NULL;
}
