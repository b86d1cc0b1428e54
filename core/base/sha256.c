#include "core/base/sha256.h"

#include <sodium.h>

_Static_assert(sizeof(struct sha256) >= sizeof(crypto_hash_sha256_state),
               "struct sha256 holds the library's state");

void
sha256_init(struct sha256 *hash)
{
    crypto_hash_sha256_init((crypto_hash_sha256_state *)(void *)hash);
}

void
sha256_add(struct sha256 *hash, const void *data, size_t len)
{
    crypto_hash_sha256_update((crypto_hash_sha256_state *)(void *)hash, data,
                              len);
}

void
sha256_hex(struct sha256 *hash, char hex[SHA256_HEX_SIZE])
{
    unsigned char digest[crypto_hash_sha256_BYTES];
    crypto_hash_sha256_final((crypto_hash_sha256_state *)(void *)hash, digest);
    sodium_bin2hex(hex, SHA256_HEX_SIZE, digest, sizeof digest);
}

void
sha256_of(const void *data, size_t len, char hex[SHA256_HEX_SIZE])
{
    struct sha256 hash;
    sha256_init(&hash);
    sha256_add(&hash, data, len);
    sha256_hex(&hash, hex);
}
