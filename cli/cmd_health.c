/* glint health */
#include <stdio.h>

#include "cli/command.h"
#include "cli/exit.h"
#include "cli/interrupt.h"
#include "cli/output.h"
#include "cli/problem.h"
#include "cli/remote.h"

enum {
    HEALTH_S = 6 /* /readyz itself gives its workers 5 s */
};

static int
ask_ready(struct remote *remote, const char *server, bool quiet,
          const struct channel *to)
{
    struct remote_ask ask = {
        .method = "GET", .path = "/readyz", .timeout_s = HEALTH_S};
    struct remote_reply reply;
    struct error err = {0};
    int status = STATUS_OK;

    if (!remote_send(remote, &ask, &reply, &err)) {
        say_error(to, "glint health", "%s", err.text);
        return err.code == ERROR_CANCELED ? STATUS_INTERRUPTED : STATUS_SERVER;
    }
    if (reply.status != 200) {
        problem_print(&reply, to, "glint health", NULL, 0);
        status = STATUS_SERVER;
    } else if (!quiet) {
        printf("%s is ready\n", server);
    }
    remote_reply_clear(&reply);
    return status;
}

int
cmd_health(const struct invocation *in)
{
    const char *server = remote_server(invocation_value(in, "server"));
    struct channel to = channel_open(stderr, invocation_has(in, "no-color"));
    struct error err = {0};

    if (server == NULL)
        server = "http://127.0.0.1:8080";
    struct remote *remote = remote_open(server, &err);
    if (remote == NULL) {
        say_error(&to, "glint health", "%s", err.text);
        return STATUS_USAGE;
    }
    interrupt_start();
    int status = ask_ready(remote, server, invocation_has(in, "quiet"), &to);
    remote_close(remote);
    return status;
}
