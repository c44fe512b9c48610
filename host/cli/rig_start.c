#include "host/cli/rig_start.h"

#include "core/file.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/unix_socket.h"

#include <poll.h>
#include <stdio.h>
#include <unistd.h>

/* From fork() to the socket. */
#define GRACE_S 0.5
/* A sample at full size on a slow computer; longer, and somebody has taken rig.json away. */
#define RENDERED_S 300.0
#define SLICE_MS   50

/* A connection that stays open as long as the scanner lives; -1: nobody holds the socket. */
static int dial(const char *folder)
{
    char path[108]; /* as long as that of a socket can be */
    if (snprintf(path, sizeof path, "%s/control.sock", folder) >= (int)sizeof path)
        return -1;
    return weft_unix_socket_connect(path);
}

/* Lets a slice pass; false when the scanner has ended meanwhile. */
static bool still_there(int scanner)
{
    struct pollfd end = {.fd = scanner}; /* a negative one is passed over */
    return poll(&end, 1, SLICE_MS) == 0;
}

weft_err weft_rig_start_wait(const char *folder, weft_error *err)
{
    const double begin_s = weft_clock_s();
    double patience_s = GRACE_S;
    int scanner = -1;
    weft_err status = WEFT_OK;
    char *const ready = weft_path_join(folder, "rig.json", err);
    if (!ready)
        return WEFT_ERR_NOMEM;
    while (status == WEFT_OK && !weft_file_exists(ready) && weft_clock_s() - begin_s < patience_s) {
        if (scanner < 0 && (scanner = dial(folder)) >= 0) {
            patience_s = RENDERED_S;
            weft_note("%s: waiting for the virtual scanner to be ready", folder);
        }
        if (!still_there(scanner))
            break;
        if (weft_cancelled())
            status = weft_fail(err, WEFT_ERR_CANCELLED, "cancelled while waiting for the virtual scanner");
    }
    if (scanner >= 0)
        close(scanner);
    weft_free(ready);
    return status;
}
