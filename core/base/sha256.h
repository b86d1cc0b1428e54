/* sha256.h - SHA-256 (FIPS 180-4), by libsodium. Pure; any thread. */
#ifndef CORE_BASE_SHA256_H
#define CORE_BASE_SHA256_H

#include <stddef.h>

enum {
    SHA256_HEX_SIZE = 65 /* 64 lower-case digits and a NUL */
};

struct sha256 {
    _Alignas(16) unsigned char state[128];
};

void
sha256_init(struct sha256 *hash);
void
sha256_add(struct sha256 *hash, const void *data, size_t len);
void
sha256_hex(struct sha256 *hash, char hex[SHA256_HEX_SIZE]);

/* All three for one run of bytes. */
void
sha256_of(const void *data, size_t len, char hex[SHA256_HEX_SIZE]);

#endif
