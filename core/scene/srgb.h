/* srgb.h - "#rrggbb" -> linear colour, by a table (HOUSE section 7: no libm).
 *
 * Entry i is what the sRGB curve (IEC 61966-2-1) makes of v = i / 255: v / 12.92
 * up to 0.04045, else ((v + 0.055) / 1.055)^2.4, as the nearest double. */
#ifndef CORE_SCENE_SRGB_H
#define CORE_SCENE_SRGB_H

#include <stdbool.h>

extern const double srgb_linear[256];

/* False unless `text` is # and six hexadecimal digits. */
bool
srgb_hex(const char *text, double rgb[3]);

#endif
