#include "core/trace/film.h"

#include <stdlib.h>
#include <string.h>

#include "core/scene/layer.h"

static const uint8_t channels[LAYER_COUNT] = {
#define X(id, name, count, kind) [id] = count,
    LAYER_TABLE(X)
#undef X
};

bool
film_init(struct film *film, uint32_t width, uint32_t height, unsigned mask,
          struct error *err)
{
    memset(film, 0, sizeof *film);
    if (width == 0 || height == 0 ||
        height > SIZE_MAX / 2 / (3 * sizeof(float)) / width)
        return error_set(err, ERROR_MEMORY,
                         "a film of %u x %u pixels cannot be held",
                         (unsigned)width, (unsigned)height);
    size_t pixels = (size_t)width * height;
    film->width = width;
    film->height = height;
    for (int i = 0; i < LAYER_COUNT; i++) {
        if ((mask >> i & 1) == 0)
            continue;
        film->layers[i] = calloc(pixels * channels[i], sizeof(float));
        if (film->layers[i] == NULL) {
            film_clear(film);
            return error_set(err, ERROR_MEMORY,
                             "no memory for a film of %u x %u pixels",
                             (unsigned)width, (unsigned)height);
        }
    }
    return true;
}

void
film_clear(struct film *film)
{
    for (int i = 0; i < LAYER_COUNT; i++)
        free(film->layers[i]);
    memset(film, 0, sizeof *film);
}
