/* scene_hash.h - names for work: what was asked, and what was rendered. */
#ifndef CORE_SCENE_SCENE_HASH_H
#define CORE_SCENE_SCENE_HASH_H

#include <stddef.h>

#include "core/base/sha256.h"
#include "core/scene/output.h"

enum {
    SCENE_HASH_SIZE = 7 + SHA256_HEX_SIZE /* "sha256:" and 64 digits */
};

/* "sha256:..." over canonical scene text, core version and output settings. */
void
scene_hash(const char *canonical, size_t len, const struct output *output,
           char hash[SCENE_HASH_SIZE]);

/* Render key: 64 hex digits over scene hash, build id and ISA class. Two jobs
 * with one key have the same bytes. */
void
scene_render_key(const char *hash, const char *build, const char *isa,
                 char key[SHA256_HEX_SIZE]);

#endif
