/** Where the daemon is found. */
#ifndef WEFT_HOST_CLIENT_DAEMON_SOCKET_H
#define WEFT_HOST_CLIENT_DAEMON_SOCKET_H

/** Where the socket is when nothing is said: $XDG_RUNTIME_DIR/weft/weftd.sock, or for root and services
 *  /run/weft/weftd.sock. */
void weft_daemon_default_socket(char path[108]);

#endif
