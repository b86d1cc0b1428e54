/* isa.h - the build and the ISA class, on which pixels may depend.
 *
 * A result is bit-identical for any thread and worker count on one build and
 * one class (decision 0004). Any thread. */
#ifndef CORE_BASE_ISA_H
#define CORE_BASE_ISA_H

enum {
    ISA_SIZE = 32 /* "intel-x86-64-v4" and a NUL fit */
};

enum isa_level { ISA_V1 = 1, ISA_V2, ISA_V3, ISA_V4, ISA_OTHER = 0 };

/* The vector level of this CPU and its class name, CPU vendor and level, for
 * example "amd-x86-64-v4". */
enum isa_level
isa_level(void);
void
isa_class(char name[ISA_SIZE]);

/* "0.1.0"; and the SHA-256 of the core's sources, compiler and flags: two
 * programs with one build id trace the same pixels. */
extern const char glint_version[];
extern const char glint_build[];

#endif
