/* config.h - what the operator decided: flags > environment > file > default,
 * read once into one const struct (API section 9). */
#ifndef SERVER_CONFIG_H
#define SERVER_CONFIG_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/error.h"
#include "core/base/log.h"
#include "core/scene/scene_json.h"

struct config {
    char host[64];
    uint16_t port;
    char data[1024];           /* folder: glint.db, blobs/ */
    unsigned workers, threads; /* resolved, >= 1 */
    bool insecure_open;
    enum log_level log_level;
    enum log_format log_format;
    uint64_t max_scene_bytes;
    struct scene_limits scene_limits;
    double max_render_seconds;
    double stall_seconds; /* a worker silent for so long is killed */
    uint64_t max_render_bytes;
    double default_wait, max_wait; /* seconds */
    unsigned max_connections;
    uint32_t max_queued;
};

enum config_wish { CONFIG_RUN, CONFIG_EXIT_OK, CONFIG_EXIT_BAD };

/* Reads all sources; prints for --help, --version, --print-config and
 * --check-config. CONFIG_EXIT_BAD (exit status 3; 2 for usage in *status) after
 * naming every mistake on standard error. */
enum config_wish
config_read(int argc, char **argv, struct config *config, int *status);

#endif
