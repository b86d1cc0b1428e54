/* log.h - what the operator reads, one line per fact, on standard error.
 *
 * Text on a terminal ("12:00:01 info  pool: worker 2 ready"), JSON lines
 * otherwise ({"time":...,"level":...,"room":...,"message":...}). Any thread;
 * a line is written whole. Never log a scene, a key or a student's id. */
#ifndef CORE_BASE_LOG_H
#define CORE_BASE_LOG_H

enum log_level { LOG_DEBUG, LOG_INFO, LOG_WARN, LOG_ERROR };
enum log_format { LOG_AUTO, LOG_TEXT, LOG_JSON };

/* Before the first thread starts. Default: LOG_INFO, LOG_AUTO. */
void
log_setup(enum log_level least, enum log_format format);

/* `room` is the short name of the speaking room: "pool", "store". */
void
log_write(enum log_level level, const char *room, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

#endif
