#include "core/image/image.h"

#include <stdlib.h>

void
image_clear(struct image *image)
{
    free(image->data);
    *image = (struct image){0};
}
