/* number.h - double -> the shortest decimal text that reads back the same.
 *
 * Always a valid JSON number ("0.1", "1e-7", "-3"); a whole number below 1e15
 * has neither point nor exponent; -0 is written "0". The argument is finite. */
#ifndef CORE_BASE_NUMBER_H
#define CORE_BASE_NUMBER_H

#include <stddef.h>

enum { NUMBER_SIZE = 32 };

/* Returns the length without the NUL. */
size_t
number_text(double number, char text[NUMBER_SIZE]);

#endif
