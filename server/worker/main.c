/* glint-worker: turns one scene after another into pictures, for a parent that
 * holds the other end of descriptor 3. Never started by hand. */
#include <malloc.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/base/isa.h"
#include "server/worker/sandbox.h"
#include "server/worker/serve.h"

enum {
    SOCKET_FD = 3,
    EXIT_USAGE = 2,
    /* Films and images up to this size live in the heap, whose pages are kept
     * from one ask to the next (serve.c gives them back at rest). */
    HEAP_BYTES = 32 << 20
};

static bool
is_our_socket(int fd)
{
    int type = 0;
    socklen_t len = sizeof type;
    return getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &len) == 0 &&
           type == SOCK_SEQPACKET;
}

int
main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "--version") == 0) {
        printf("glint-worker %s (build %.12s)\n", glint_version, glint_build);
        return 0;
    }
    if (argc > 1 || !is_our_socket(SOCKET_FD)) {
        fprintf(stderr,
                "glint-worker: this program is started by glint and glintd, "
                "which send it scenes over a socket;\n"
                "to render a picture, run: glint render scene.json -o "
                "picture.png\n");
        return EXIT_USAGE;
    }
    mallopt(M_MMAP_THRESHOLD, HEAP_BYTES);
    mallopt(M_TRIM_THRESHOLD, 4 * HEAP_BYTES);
    sandbox_enter(SOCKET_FD);
    int status = serve(SOCKET_FD);
    /* Not through exit: serve.c says why. */
    fflush(stderr);
    _exit(status);
}
