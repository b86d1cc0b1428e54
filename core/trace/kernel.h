/* kernel.h - one ISA level's stages, behind one table.
 *
 * The tracer's stages are compiled once per level (kernel_names.h); code that
 * is compiled once chooses a level at start and calls through its table. The
 * level is part of the ISA class (core/base/isa.h): pixels may differ between
 * levels, as madd is fused in some, never within one. */
#ifndef CORE_TRACE_KERNEL_H
#define CORE_TRACE_KERNEL_H

#include "core/base/isa.h"
#include "core/trace/tile.h"

struct kernel {
    enum isa_level level; /* lowest that can run it */
    struct plan *(*plan_build)(const struct scene *,
                               const struct accel_options *, struct error *);
    void (*plan_free)(struct plan *);
    bool (*tile_run)(const struct plan *, uint32_t, struct tile *,
                     struct film *);
    void (*intersect)(const struct accel *, enum ray_kind, const struct rays *,
                      struct hits *);
    void (*occluded)(const struct accel *, struct rays *);
};

/* The best kernel for `level`; any level has one. */
const struct kernel *
kernel_choose(enum isa_level level);

#endif
