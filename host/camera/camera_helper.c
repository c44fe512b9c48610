/*
 * A camera helper: the program weft-camera-NAME, one per backend.
 *
 *     weft-camera-aravis --serve LEVEL PARENT
 *
 * The program that starts it gives it a socket as descriptor 3, its log level, and its process id when the
 * helper may ask the kernel to end it together with that process (0: not; see camera_child.c).
 */
#include "core/log.h"
#include "host/camera/camera_serve.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

extern const weft_camera_backend WEFT_CAMERA_BACKEND; /* named by CMakeLists.txt */

static bool has_socket(void)
{
    int type = 0;
    socklen_t size = sizeof type;
    return getsockopt(WEFT_CAMERA_HELPER_FD, SOL_SOCKET, SO_TYPE, &type, &size) == 0 &&
           type == SOCK_SEQPACKET;
}

int main(int argc, char **argv)
{
    if (argc != 4 || strcmp(argv[1], "--serve") != 0 || !has_socket()) {
        fprintf(stderr,
                "weft-camera-%s: %s\nIt is started by weft and weftd, which use cameras through it; \"weft "
                "devices\" lists them.\n",
                WEFT_CAMERA_BACKEND.name, WEFT_CAMERA_BACKEND.summary);
        return 2;
    }
    const long level = strtol(argv[2], NULL, 10), parent = strtol(argv[3], NULL, 10);
    if (parent > 0 && (prctl(PR_SET_PDEATHSIG, SIGKILL) != 0 || getppid() != parent))
        return 4;
    weft_log_set_level(level <= 0 ? WEFT_LOG_QUIET : level == 1 ? WEFT_LOG_NORMAL : WEFT_LOG_VERBOSE);
    return weft_camera_serve(&WEFT_CAMERA_BACKEND, WEFT_CAMERA_HELPER_FD);
}
