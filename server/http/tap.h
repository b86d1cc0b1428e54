/* tap.h - see what a library reads from its sockets, before it does.
 *
 * libmicrohttpd calls recv() and offers no place to look at the bytes. tap.c
 * defines recv() for the whole program, as any program may do with a symbol of
 * a shared library: on a thread that installed a reader, the reader answers; on
 * all others it is the system call and nothing else. No copy, no second socket,
 * no lock. Works with the static library too. */
#ifndef SERVER_HTTP_TAP_H
#define SERVER_HTTP_TAP_H

#include <stddef.h>
#include <sys/types.h>

/* As recv(). It reads with recvfrom(). */
typedef ssize_t (*tap_fn)(void *user, int fd, void *data, size_t len,
                          int flags);

/* For the calling thread, from now on. */
void
tap_install(tap_fn reader, void *user);

#endif
