#include "core/trace/kernel.h"

extern const struct kernel kernel_portable;
#if defined(__x86_64__)
extern const struct kernel kernel_v3, kernel_v4;
#endif

const struct kernel *
kernel_choose(enum isa_level level)
{
#if defined(__x86_64__)
    if (level >= ISA_V4)
        return &kernel_v4;
    if (level >= ISA_V3)
        return &kernel_v3;
#endif
    (void)level;
    return &kernel_portable;
}
