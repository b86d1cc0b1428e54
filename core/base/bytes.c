#include "core/base/bytes.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

void
bytes_clear(struct bytes *bytes)
{
    free(bytes->data);
    *bytes = (struct bytes){0};
}

bool
bytes_reserve(struct bytes *bytes, size_t more)
{
    if (bytes->failed)
        return false;
    if (more < bytes->capacity && bytes->len < bytes->capacity - more)
        return true;
    size_t need = bytes->len + more + 1;
    if (need <= bytes->len) {
        bytes->failed = true;
        return false;
    }
    size_t capacity = bytes->capacity < 64 ? 64 : bytes->capacity;
    while (capacity < need)
        capacity = capacity > SIZE_MAX / 2 ? need : capacity * 2;
    char *data = realloc(bytes->data, capacity);
    if (data == NULL) {
        bytes->failed = true;
        return false;
    }
    data[bytes->len] = '\0';
    bytes->data = data;
    bytes->capacity = capacity;
    return true;
}

void
bytes_append(struct bytes *bytes, const void *data, size_t len)
{
    if (!bytes_reserve(bytes, len))
        return;
    if (len > 0)
        memcpy(bytes->data + bytes->len, data, len);
    bytes->len += len;
    bytes->data[bytes->len] = '\0';
}

void
bytes_text(struct bytes *bytes, const char *text)
{
    bytes_append(bytes, text, strlen(text));
}

void
bytes_printf(struct bytes *bytes, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    int len = vsnprintf(NULL, 0, format, args);
    va_end(args);
    if (len < 0 || !bytes_reserve(bytes, (size_t)len))
        return;
    va_start(args, format);
    vsnprintf(bytes->data + bytes->len, (size_t)len + 1, format, args);
    va_end(args);
    bytes->len += (size_t)len;
}

static bool
read_all(struct bytes *bytes, int fd, const char *path, size_t limit,
         struct error *err)
{
    for (;;) {
        if (!bytes_reserve(bytes, 64 * 1024))
            return error_set(err, ERROR_MEMORY, "no memory to read %s", path);
        ssize_t n = read(fd, bytes->data + bytes->len, 64 * 1024);
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            return error_errno(err, ERROR_IO, errno, "cannot read %s", path);
        if (n == 0)
            break;
        bytes->len += (size_t)n;
        bytes->data[bytes->len] = '\0';
        if (bytes->len > limit)
            return error_set(err, ERROR_TOO_LARGE, "%s has more than %zu bytes",
                             path, limit);
    }
    return true;
}

bool
bytes_read_file(struct bytes *bytes, const char *path, size_t limit,
                struct error *err)
{
    if (strcmp(path, "-") == 0)
        return read_all(bytes, STDIN_FILENO, "standard input", limit, err);
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return error_errno(err, ERROR_IO, errno, "cannot open %s", path);
    bool ok = read_all(bytes, fd, path, limit, err);
    close(fd);
    return ok;
}

static bool
write_all(int fd, const char *data, size_t len)
{
    while (len > 0) {
        ssize_t n = write(fd, data, len);
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            return false;
        data += n;
        len -= (size_t)n;
    }
    return true;
}

bool
bytes_write_file(const struct bytes *bytes, const char *path, struct error *err)
{
    if (strcmp(path, "-") == 0) {
        if (!write_all(STDOUT_FILENO, bytes->data, bytes->len))
            return error_errno(err, ERROR_IO, errno,
                               "cannot write to standard output");
        return true;
    }
    /* A device or a pipe is written in place; only files can be renamed. */
    struct stat st;
    bool special = stat(path, &st) == 0 && !S_ISREG(st.st_mode);
    char temporary[4096];
    int len = snprintf(temporary, sizeof temporary, "%s%s", path,
                       special ? "" : ".XXXXXX");
    if (len < 0 || (size_t)len >= sizeof temporary)
        return error_set(err, ERROR_IO, "the path %.64s... is too long", path);
    int fd = special ? open(path, O_WRONLY | O_CLOEXEC)
                     : mkostemp(temporary, O_CLOEXEC);
    if (fd < 0)
        return error_errno(err, ERROR_IO, errno, "cannot write %s", path);
    bool ok = write_all(fd, bytes->data, bytes->len);
    int cause = errno;
    if (!special && ok) {
        /* mkostemp makes 0600; a picture is for whoever the umask allows. */
        mode_t mask = umask(0);
        umask(mask);
        ok = fchmod(fd, 0666 & ~mask) == 0;
        cause = errno;
    }
    if (close(fd) != 0 && ok) {
        ok = false;
        cause = errno;
    }
    if (!special && ok && rename(temporary, path) != 0) {
        ok = false;
        cause = errno;
    }
    if (!ok) {
        if (!special)
            unlink(temporary);
        return error_errno(err, ERROR_IO, cause, "cannot write %s", path);
    }
    return true;
}
