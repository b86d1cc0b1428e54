#include "core/scene/scene_hash.h"

#include <string.h>

#include "core/base/isa.h"
#include "core/base/must.h"

void
scene_hash(const char *canonical, size_t len, const struct output *output,
           char hash[SCENE_HASH_SIZE])
{
    struct sha256 sha;
    struct bytes settings = {0};
    output_write(output, &settings);
    MUST(!settings.failed); /* a hundred bytes; a wrong name would be worse */
    /* A NUL ends each part: it occurs in none of them. */
    sha256_init(&sha);
    sha256_add(&sha, canonical, len);
    sha256_add(&sha, "", 1);
    sha256_add(&sha, glint_version, strlen(glint_version));
    sha256_add(&sha, "", 1);
    sha256_add(&sha, settings.data, settings.len);
    memcpy(hash, "sha256:", 8);
    sha256_hex(&sha, hash + 7);
    bytes_clear(&settings);
}

void
scene_render_key(const char *hash, const char *build, const char *isa,
                 char key[SHA256_HEX_SIZE])
{
    struct sha256 sha;
    sha256_init(&sha);
    sha256_add(&sha, hash, strlen(hash) + 1);
    sha256_add(&sha, build, strlen(build) + 1);
    sha256_add(&sha, isa, strlen(isa));
    sha256_hex(&sha, key);
}
