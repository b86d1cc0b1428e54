/* fuzz.h - one target: it must survive any bytes. Called by libFuzzer, and by
 * replay.c in every other build. Returns 0; a broken promise aborts. */
#ifndef TESTS_FUZZ_FUZZ_H
#define TESTS_FUZZ_FUZZ_H

#include <stddef.h>
#include <stdint.h>

int
LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#endif
