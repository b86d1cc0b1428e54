#include "server/worker/wire.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

enum { WIRE_MAGIC = 0x474c4e54 }; /* "GLNT" */

/* What one record is, byte for byte. Both sides run on one machine and are
 * built together (READY says so), hence no conversion of any kind. */
struct record {
    uint32_t magic, version;
    uint32_t kind, ask;
    union {
        struct message_ready ready;
        struct message_progress progress;
        struct message_done done;
        struct message_failed failed;
        struct message_threads threads;
        unsigned char all[sizeof(((struct message *)0)->body)];
    } body;
};

static bool
text_ends(const char *text, size_t size)
{
    return memchr(text, '\0', size) != NULL;
}

static bool
check_ready(const struct message *message)
{
    const struct message_ready *ready = &message->body.ready;
    return text_ends(ready->version, sizeof ready->version) &&
           text_ends(ready->build, sizeof ready->build) &&
           text_ends(ready->isa, sizeof ready->isa);
}

static bool
check_progress(const struct message *message)
{
    const struct message_progress *progress = &message->body.progress;
    return progress->stage <= STAGE_ENCODING &&
           progress->done <= progress->total;
}

/* False for NaN too. */
static bool
is_duration(double ms)
{
    return ms >= 0 && ms <= 1e15;
}

static bool
check_done(const struct message *message)
{
    const struct message_done *done = &message->body.done;
    return done->width > 0 && done->height > 0 && is_duration(done->load_ms) &&
           is_duration(done->build_ms) && is_duration(done->trace_ms) &&
           is_duration(done->encode_ms);
}

static bool
check_failed(const struct message *message)
{
    const struct message_failed *failed = &message->body.failed;
    return failed->code > ERROR_NONE && failed->code < ERROR_CODE_COUNT &&
           text_ends(failed->text, sizeof failed->text);
}

static bool
check_threads(const struct message *message)
{
    return message->body.threads.threads >= 1;
}

static bool
check_nothing(const struct message *message)
{
    (void)message;
    return true;
}

/* One row per kind: its name in sentences, what it carries, what its body must
 * be. */
static const struct {
    const char *name;
    size_t body_size;
    uint32_t fd_count;
    bool (*check)(const struct message *message);
} kinds[MESSAGE_KIND_COUNT] = {
    [MESSAGE_READY] = {"READY", sizeof(struct message_ready), 0, check_ready},
    [MESSAGE_PROGRESS] = {"PROGRESS", sizeof(struct message_progress), 0,
                          check_progress},
    [MESSAGE_DONE] = {"DONE", sizeof(struct message_done), 1, check_done},
    [MESSAGE_FAILED] = {"FAILED", sizeof(struct message_failed), 0,
                        check_failed},
    [MESSAGE_RENDER] = {"RENDER", sizeof(struct message_threads), 2,
                        check_threads},
    [MESSAGE_CANCEL] = {"CANCEL", 0, 0, check_nothing},
    [MESSAGE_THREADS] = {"THREADS", sizeof(struct message_threads), 0,
                         check_threads},
};

void
message_clear(struct message *message)
{
    uint32_t count =
        message->fd_count < WIRE_FD_MAX ? message->fd_count : WIRE_FD_MAX;
    for (uint32_t i = 0; i < count; i++) {
        if (message->fds[i] >= 0)
            close(message->fds[i]);
    }
    *message = (struct message){0};
}

/* Everything a record promises beyond its size; used by both directions, so
 * what one side sends the other accepts. */
static bool
message_check(const struct message *message, struct error *err)
{
    if (message->kind == 0 || message->kind >= MESSAGE_KIND_COUNT)
        return error_set(err, ERROR_PROTOCOL,
                         "a message kind must be 1 to %d, got %u",
                         MESSAGE_KIND_COUNT - 1, message->kind);
    const char *name = kinds[message->kind].name;
    if ((message->ask == 0) != (message->kind == MESSAGE_READY))
        return error_set(err, ERROR_PROTOCOL,
                         "a %s message must %s an ask, got number %u", name,
                         message->ask == 0 ? "name" : "not name", message->ask);
    if (message->fd_count != kinds[message->kind].fd_count)
        return error_set(err, ERROR_PROTOCOL,
                         "a %s message must carry %u descriptors, got %u", name,
                         kinds[message->kind].fd_count, message->fd_count);
    if (!kinds[message->kind].check(message))
        return error_set(err, ERROR_PROTOCOL,
                         "a %s message has a value out of range", name);
    return true;
}

/* Room for the descriptors of one message, aligned as a control header. */
union control {
    struct cmsghdr align;
    char bytes[CMSG_SPACE(WIRE_FD_MAX * sizeof(int))];
};

static void
attach_fds(struct msghdr *header, union control *control, const int *fds,
           uint32_t count)
{
    header->msg_control = control->bytes;
    header->msg_controllen = CMSG_SPACE(count * sizeof(int));
    struct cmsghdr *item = CMSG_FIRSTHDR(header);
    item->cmsg_level = SOL_SOCKET;
    item->cmsg_type = SCM_RIGHTS;
    item->cmsg_len = CMSG_LEN(count * sizeof(int));
    memcpy(CMSG_DATA(item), fds, count * sizeof(int));
}

bool
wire_send(int socket, const struct message *message, struct error *err)
{
    if (!message_check(message, err))
        return false;
    struct record record;
    memset(&record, 0, sizeof record); /* padding too: send no old stack */
    record.magic = WIRE_MAGIC;
    record.version = WIRE_VERSION;
    record.kind = message->kind;
    record.ask = message->ask;
    memcpy(&record.body, &message->body, kinds[message->kind].body_size);

    struct iovec part = {.iov_base = &record, .iov_len = sizeof record};
    struct msghdr header = {.msg_iov = &part, .msg_iovlen = 1};
    union control control;
    memset(&control, 0, sizeof control);
    if (message->fd_count > 0)
        attach_fds(&header, &control, message->fds, message->fd_count);

    ssize_t sent;
    do {
        sent = sendmsg(socket, &header, MSG_NOSIGNAL);
    } while (sent < 0 && errno == EINTR);
    if (sent < 0)
        return error_errno(err, ERROR_IO, errno, "cannot send %s to the peer",
                           kinds[message->kind].name);
    return true;
}

/* Take every descriptor that came, whether wanted or not: those beyond
 * WIRE_FD_MAX were closed by the kernel, which then says MSG_CTRUNC. */
static void
take_fds(struct msghdr *header, struct message *message)
{
    for (struct cmsghdr *item = CMSG_FIRSTHDR(header); item != NULL;
         item = CMSG_NXTHDR(header, item)) {
        if (item->cmsg_level != SOL_SOCKET || item->cmsg_type != SCM_RIGHTS)
            continue;
        size_t count = (item->cmsg_len - CMSG_LEN(0)) / sizeof(int);
        for (size_t i = 0; i < count; i++) {
            int fd;
            memcpy(&fd, CMSG_DATA(item) + i * sizeof fd, sizeof fd);
            if (message->fd_count < WIRE_FD_MAX)
                message->fds[message->fd_count++] = fd;
            else
                close(fd);
        }
    }
}

/* One recvmsg that never blocks by itself, so that `wait` means the same on a
 * blocking and on a non-blocking socket. */
static ssize_t
receive_record(int socket, bool wait, struct msghdr *header)
{
    struct iovec *part = header->msg_iov;
    struct iovec whole = *part;
    size_t control_len = header->msg_controllen;
    for (;;) {
        *part = whole;
        header->msg_controllen = control_len;
        ssize_t got = recvmsg(socket, header, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
        /* ECONNRESET says once that the peer left without reading all of ours;
         * what it sent before is still there to be read. */
        if (got < 0 && (errno == EINTR || errno == ECONNRESET))
            continue;
        if (got < 0 && errno == EAGAIN && wait) {
            struct pollfd one = {.fd = socket, .events = POLLIN};
            if (poll(&one, 1, -1) >= 0 || errno == EINTR)
                continue;
        }
        return got;
    }
}

static bool
record_check(const struct record *record, ssize_t got, int flags,
             struct error *err)
{
    if ((flags & MSG_TRUNC) != 0)
        return error_set(err, ERROR_PROTOCOL,
                         "a record must have %zu bytes, got more",
                         sizeof *record);
    if ((size_t)got != sizeof *record)
        return error_set(err, ERROR_PROTOCOL,
                         "a record must have %zu bytes, got %zd",
                         sizeof *record, got);
    if ((flags & MSG_CTRUNC) != 0)
        return error_set(err, ERROR_PROTOCOL,
                         "a record must carry at most %d descriptors, got more",
                         WIRE_FD_MAX);
    if (record->magic != WIRE_MAGIC)
        return error_set(err, ERROR_PROTOCOL,
                         "a record must begin with %08x, got %08x",
                         (unsigned)WIRE_MAGIC, record->magic);
    if (record->version != WIRE_VERSION)
        return error_set(err, ERROR_PROTOCOL,
                         "the protocol version must be %d, got %u",
                         WIRE_VERSION, record->version);
    return true;
}

enum wire_status
wire_receive(int socket, bool wait, struct message *message, struct error *err)
{
    *message = (struct message){0};
    struct record record;
    memset(&record, 0, sizeof record);
    union control control;
    memset(&control, 0, sizeof control);
    struct iovec part = {.iov_base = &record, .iov_len = sizeof record};
    struct msghdr header = {.msg_iov = &part,
                            .msg_iovlen = 1,
                            .msg_control = control.bytes,
                            .msg_controllen = sizeof control.bytes};

    ssize_t got = receive_record(socket, wait, &header);
    if (got < 0 && errno == EAGAIN)
        return WIRE_NOTHING;
    if (got < 0) {
        error_errno(err, ERROR_IO, errno, "cannot receive from the peer");
        return WIRE_BROKEN;
    }
    take_fds(&header, message);
    /* An empty record cannot be told from the end, and ends the talk too. */
    if (got == 0 && message->fd_count == 0)
        return WIRE_CLOSED;
    if (!record_check(&record, got, header.msg_flags, err))
        goto broken;
    message->kind = record.kind;
    message->ask = record.ask;
    memcpy(&message->body, &record.body, sizeof message->body);
    if (!message_check(message, err))
        goto broken;
    return WIRE_MESSAGE;
broken:
    message_clear(message);
    return WIRE_BROKEN;
}

/* Seals without which a peer could change or cut what we are reading. */
static const int wire_seals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE;

int
wire_memfd(const char *name, const void *data, size_t len, struct error *err)
{
    int fd = memfd_create(name, MFD_CLOEXEC | MFD_ALLOW_SEALING);
    if (fd < 0) {
        error_errno(err, ERROR_IO, errno, "cannot make the memory file %s",
                    name);
        return -1;
    }
    const char *rest = data;
    for (size_t left = len; left > 0;) {
        ssize_t n = write(fd, rest, left);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0) {
            error_errno(err, n < 0 && errno == ENOSPC ? ERROR_MEMORY : ERROR_IO,
                        n < 0 ? errno : EIO,
                        "cannot write %zu bytes to the memory file %s", len,
                        name);
            goto fail;
        }
        rest += n;
        left -= (size_t)n;
    }
    if (fcntl(fd, F_ADD_SEALS, wire_seals | F_SEAL_SEAL) != 0) {
        error_errno(err, ERROR_IO, errno, "cannot seal the memory file %s",
                    name);
        goto fail;
    }
    return fd;
fail:
    close(fd);
    return -1;
}

bool
wire_map(int fd, size_t limit, const void **data, size_t *len,
         struct error *err)
{
    *data = "";
    *len = 0;
    int seals = fcntl(fd, F_GET_SEALS);
    if (seals < 0)
        return error_set(err, ERROR_PROTOCOL,
                         "a passed descriptor is not a memory file");
    if ((seals & wire_seals) != wire_seals)
        return error_set(err, ERROR_PROTOCOL,
                         "a memory file must be sealed against shrinking, "
                         "growing and writing, got seals %#x",
                         (unsigned)seals);
    struct stat st;
    if (fstat(fd, &st) != 0)
        return error_errno(err, ERROR_IO, errno,
                           "cannot ask a memory file's size");
    if (st.st_size < 0 || (uint64_t)st.st_size > limit)
        return error_set(err, ERROR_TOO_LARGE,
                         "a memory file must have at most %zu bytes, got %lld",
                         limit, (long long)st.st_size);
    if (st.st_size == 0)
        return true;
    void *map = mmap(NULL, (size_t)st.st_size, PROT_READ, MAP_SHARED, fd, 0);
    if (map == MAP_FAILED)
        return error_errno(err, errno == ENOMEM ? ERROR_MEMORY : ERROR_IO,
                           errno, "cannot map a memory file of %lld bytes",
                           (long long)st.st_size);
    *data = map;
    *len = (size_t)st.st_size;
    return true;
}

void
wire_unmap(const void *data, size_t len)
{
    /* munmap takes what mmap gave, const or not. */
    if (len > 0) /* NOLINTNEXTLINE(performance-no-int-to-ptr) */
        munmap((void *)(uintptr_t)data, len);
}
