/** Connecting to a socket of this machine. */
#ifndef WEFT_CORE_UNIX_SOCKET_H
#define WEFT_CORE_UNIX_SOCKET_H

/**
 * Connects to the stream socket at `path` (AF_UNIX); closed on exec.
 * @return the descriptor; -1 with errno set, ENAMETOOLONG for a path that no socket can have
 */
int weft_unix_socket_connect(const char *path);

#endif
