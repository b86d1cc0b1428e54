/* sandbox.h - what the worker gives up before it reads its first byte.
 *
 * Two steps, because the image library loads while the first scene is already
 * traced (core/image/image.h). What the system cannot give is logged and done
 * without: the process wall stays either way. */
#ifndef SERVER_WORKER_SANDBOX_H
#define SERVER_WORKER_SANDBOX_H

/* Before the first thread. From here on: no descriptor but 0 to 2 and `socket`,
 * no new privileges, no core file, no network, no new process, no signal or
 * trace to another process, no opening for writing; and SIGKILL when the
 * parent dies. */
void
sandbox_enter(int socket);

/* Once the image library has loaded (before that: does nothing): no file is
 * opened or looked at any more, no memory becomes executable. All threads. */
void
sandbox_tighten(void);

#endif
