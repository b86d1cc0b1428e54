#include "core/base/log.h"

#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>

static enum log_level log_least = LOG_INFO;
static enum log_format log_format = LOG_AUTO;

/* Guards standard error, so that lines of two threads never mix. */
static pthread_mutex_t log_lock = PTHREAD_MUTEX_INITIALIZER;

void
log_setup(enum log_level least, enum log_format format)
{
    log_least = least;
    log_format = format;
}

/* JSON string body: quotes, backslashes and control bytes are escaped. */
static void
put_escaped(FILE *out, const char *text)
{
    for (; *text != '\0'; text++) {
        unsigned char c = (unsigned char)*text;
        if (c == '"' || c == '\\')
            fprintf(out, "\\%c", c);
        else if (c < 0x20)
            fprintf(out, "\\u%04x", c);
        else
            fputc(c, out);
    }
}

void
log_write(enum log_level level, const char *room, const char *format, ...)
{
    static const char *const names[] = {"debug", "info", "warn", "error"};
    if (level < log_least)
        return;
    char text[1024];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);

    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    struct tm tm;
    gmtime_r(&now.tv_sec, &tm);
    char stamp[32];
    strftime(stamp, sizeof stamp, "%Y-%m-%dT%H:%M:%S", &tm);

    pthread_mutex_lock(&log_lock);
    if (log_format == LOG_TEXT ||
        (log_format == LOG_AUTO && isatty(STDERR_FILENO))) {
        fprintf(stderr, "%s %-5s %s: %s\n", stamp + 11, names[level], room,
                text);
    } else {
        fprintf(stderr,
                "{\"time\":\"%s.%03ldZ\",\"level\":\"%s\",\"room\":\"%s\","
                "\"message\":\"",
                stamp, now.tv_nsec / 1000000, names[level], room);
        put_escaped(stderr, text);
        fputs("\"}\n", stderr);
    }
    fflush(stderr);
    pthread_mutex_unlock(&log_lock);
}
