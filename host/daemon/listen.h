/** The sockets that the daemon listens on: its own, or those that systemd hands over. */
#ifndef WEFT_HOST_DAEMON_LISTEN_H
#define WEFT_HOST_DAEMON_LISTEN_H

#include "core/error.h"

#include <stdbool.h>

/** A Unix socket with mode 0660, of `group` (NULL: as it comes).  A socket that nobody answers is replaced.
 *  @return WEFT_ERR_EXISTS when a daemon answers there; WEFT_ERR_USAGE for too long a path or no such group
 */
weft_err weft_listen_unix(const char *path, const char *group, int *fd, weft_error *err);

/** A TCP socket at "127.0.0.1:8080", "[::1]:8080" or ":8080" (loopback); port 0 takes a free one.
 *  @return WEFT_ERR_USAGE for what is no address (names are not looked up), WEFT_ERR_IO when it is taken */
weft_err weft_listen_tcp(const char *address, int *fd, weft_error *err);

/** Whether the address of a listening TCP socket is reached from this computer alone. */
bool weft_listen_is_loopback(int fd);
/** "127.0.0.1:8080" of a listening TCP socket. */
void weft_listen_name(int fd, char text[80]);

typedef struct weft_listen_given {
    int fd;
    bool tcp;
} weft_listen_given;

/** The listening sockets that systemd has opened for this process (socket activation), at most `max`. */
weft_err weft_listen_from_systemd(weft_listen_given *given, int max, int *n, weft_error *err);

#endif
