/* Any record at all, with any number of descriptors beside it: wire_receive
 * answers with a checked message or WIRE_BROKEN, and loses no descriptor.
 *
 * Input: one byte of choices, then the record. Bits 0 and 1 count descriptors;
 * bit 2 gives the record an honest head and size, so that the fuzzer gets past
 * the first checks; bit 3 lets the peer hang up. */
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/base/must.h"
#include "server/worker/wire.h"

int
LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* An honest record, to learn size and head from. */
static char honest[4096];
static size_t honest_len;
static int null_fd;

static void
learn(void)
{
    int pair[2];
    struct message message = {.kind = MESSAGE_CANCEL, .ask = 1};
    MUST(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair) == 0);
    MUST(wire_send(pair[0], &message, NULL));
    ssize_t got = recv(pair[1], honest, sizeof honest, 0);
    MUST(got > 8);
    honest_len = (size_t)got;
    close(pair[0]);
    close(pair[1]);
    null_fd = open("/dev/null", O_RDONLY | O_CLOEXEC);
    MUST(null_fd >= 0);
}

static void
send_raw(int socket, char *record, size_t len, size_t fd_count)
{
    struct iovec part = {record, len};
    struct msghdr header = {.msg_iov = &part, .msg_iovlen = 1};
    char control[CMSG_SPACE(3 * sizeof(int))] = {0};
    if (fd_count > 0) {
        header.msg_control = control;
        header.msg_controllen = CMSG_SPACE(fd_count * sizeof(int));
        struct cmsghdr *item = CMSG_FIRSTHDR(&header);
        item->cmsg_level = SOL_SOCKET;
        item->cmsg_type = SCM_RIGHTS;
        item->cmsg_len = CMSG_LEN(fd_count * sizeof(int));
        for (size_t i = 0; i < fd_count; i++)
            memcpy(CMSG_DATA(item) + i * sizeof(int), &null_fd, sizeof(int));
    }
    sendmsg(socket, &header, MSG_NOSIGNAL);
}

int
LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (honest_len == 0)
        learn();
    if (size < 1 || size > sizeof honest)
        return 0;
    char record[sizeof honest] = {0};
    size_t len = size - 1;
    memcpy(record, data + 1, len);
    if ((data[0] & 4) != 0) {
        memmove(record + 8, record, sizeof record - 8);
        memcpy(record, honest, 8); /* magic and version */
        len = honest_len;
    }
    int before = dup(null_fd);
    close(before);
    int pair[2];
    MUST(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair) == 0);
    send_raw(pair[0], record, len, data[0] & 3);
    if ((data[0] & 8) != 0)
        close(pair[0]);

    struct message message;
    struct error err = {0};
    enum wire_status status = wire_receive(pair[1], false, &message, &err);
    MUST(status != WIRE_BROKEN || err.code != ERROR_NONE);
    if (status == WIRE_MESSAGE) {
        /* What was accepted may be sent on. */
        MUST(message.kind > 0 && message.kind < MESSAGE_KIND_COUNT);
        MUST((data[0] & 8) != 0 || wire_send(pair[1], &message, &err));
    } else {
        MUST(message.fd_count == 0);
    }
    message_clear(&message);
    close(pair[1]);
    if ((data[0] & 8) == 0)
        close(pair[0]);
    int after = dup(null_fd);
    close(after);
    MUST(before == after); /* the lowest free descriptor is the same: no leak */
    return 0;
}
