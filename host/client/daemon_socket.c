#include "host/client/daemon_socket.h"

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

void weft_daemon_default_socket(char path[108])
{
    const char *const runtime = geteuid() == 0 ? NULL : getenv("XDG_RUNTIME_DIR");
    const int n = runtime && runtime[0] == '/' ? snprintf(path, 108, "%s/weft/weftd.sock", runtime) : -1;
    if (n < 0 || n >= 108)
        snprintf(path, 108, "/run/weft/weftd.sock");
}
