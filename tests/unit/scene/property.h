/* property.h - what must hold for any bytes whatever; broken promises abort.
 *
 * Used by the mutation test and by the fuzz targets. */
#ifndef TESTS_UNIT_SCENE_PROPERTY_H
#define TESTS_UNIT_SCENE_PROPERTY_H

#include <stdbool.h>
#include <stddef.h>

/* Read the bytes as a scene. Either there are errors, each with a code, a
 * sentence and a place, or there is a scene whose every number is finite and
 * whose every index is valid, and its canonical text reads back to itself.
 * True if the document was good. */
bool
scene_property(const char *text, size_t len);

/* Read the bytes as JSON: one error, or a tree whose places lie in the text. */
bool
json_property(const char *text, size_t len);

#endif
