/* kernel_table.c - the table of the level this file is compiled for. */
#include "core/trace/kernel.h"

#if defined(__AVX512F__)
enum { LEVEL = ISA_V4 };
#elif defined(__AVX2__)
enum { LEVEL = ISA_V3 };
#else
enum { LEVEL = ISA_V1 };
#endif

extern const struct kernel kernel_table;

const struct kernel kernel_table = {
    .level = (enum isa_level)LEVEL,
    .plan_build = plan_build,
    .plan_free = plan_free,
    .tile_run = tile_run,
    .intersect = accel_intersect,
    .occluded = accel_occluded,
};
