#include "core/base/isa.h"

#include <stdio.h>
#include <string.h>

#if defined(__x86_64__)
#include <cpuid.h>

enum isa_level
isa_level(void)
{
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx512f") &&
        __builtin_cpu_supports("avx512bw") &&
        __builtin_cpu_supports("avx512cd") &&
        __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl"))
        return ISA_V4;
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
        __builtin_cpu_supports("bmi2"))
        return ISA_V3;
    if (__builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt"))
        return ISA_V2;
    return ISA_V1;
}

static const char *
vendor(void)
{
    unsigned a, b, c, d;
    char name[13] = "";
    if (__get_cpuid(0, &a, &b, &c, &d)) {
        memcpy(name, &b, 4);
        memcpy(name + 4, &d, 4);
        memcpy(name + 8, &c, 4);
    }
    if (strcmp(name, "GenuineIntel") == 0)
        return "intel";
    if (strcmp(name, "AuthenticAMD") == 0)
        return "amd";
    return "other";
}

void
isa_class(char name[ISA_SIZE])
{
    snprintf(name, ISA_SIZE, "%s-x86-64-v%d", vendor(), (int)isa_level());
}
#else
enum isa_level
isa_level(void)
{
    return ISA_OTHER;
}

void
isa_class(char name[ISA_SIZE])
{
    snprintf(name, ISA_SIZE, "generic");
}
#endif
