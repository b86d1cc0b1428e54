#include "core/scene/layer.h"

#include <string.h>

#include "core/scene/output.h"

static const struct {
    const char *name, *kind;
    unsigned channels;
} layers[LAYER_COUNT] = {
#define X(id, name, channels, kind) [id] = {name, kind, channels},
    LAYER_TABLE(X)
#undef X
};

const char *
layer_name(enum layer layer)
{
    return layers[layer].name;
}

const char *
layer_kind(enum layer layer)
{
    return layers[layer].kind;
}

unsigned
layer_channels(enum layer layer)
{
    return layers[layer].channels;
}

enum layer
layer_find(const char *name)
{
    for (unsigned i = 0; i < LAYER_COUNT; i++) {
        if (strcmp(layers[i].name, name) == 0)
            return (enum layer)i;
    }
    return LAYER_COUNT;
}
