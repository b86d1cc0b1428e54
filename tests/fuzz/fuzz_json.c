/* Any bytes as JSON. */
#include <stddef.h>
#include <stdint.h>

#include "tests/fuzz/fuzz.h"
#include "tests/unit/scene/property.h"

int
LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    json_property((const char *)data, size);
    return 0;
}
