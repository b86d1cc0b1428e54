#include "cli/examples.h"

#include <string.h>

#include "core/base/json.h"

const struct example *
example_find(const char *name)
{
    for (size_t i = 0; i < example_count; i++) {
        if (strcmp(examples[i].name, name) == 0)
            return &examples[i];
    }
    return NULL;
}

const char *
example_near(const char *name)
{
    const char *names[256];
    size_t count = 0;
    while (count < example_count && count < 256) {
        names[count] = examples[count].name;
        count++;
    }
    return json_did_you_mean(name, names, count);
}
