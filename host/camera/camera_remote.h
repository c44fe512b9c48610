/** A camera whose backend runs in a helper process: the program's end of it (camera_child.h). */
#ifndef WEFT_HOST_CAMERA_REMOTE_H
#define WEFT_HOST_CAMERA_REMOTE_H

#include "host/camera/camera_child.h"

/** A helper that ended so often in a row, without a whole frame in between, is not started again. */
#define WEFT_CAMERA_MAX_DEATHS 5

typedef struct weft_camera_remote {
    weft_camera_child child;
    char backend[16], address[112];
    weft_camera_state info;      /* as at the last answer */
    weft_camera_settings wanted; /* what it was last told, to tell it again */
    int n_deaths;                /* in a row */
} weft_camera_remote;

/** The functions of a weft_camera_backend, which run as calls to the helper.
 *  `wait` gives idle and fire; its deadline is set here. */
weft_err weft_camera_remote_open(weft_camera_remote *remote, const char *backend, const char *address,
                                 weft_camera_state *info, weft_error *err);
weft_err weft_camera_remote_configure(weft_camera_remote *remote, const weft_camera_wait *wait,
                                      const weft_camera_settings *wanted, weft_camera_state *info,
                                      weft_error *err);
weft_err weft_camera_remote_expose(weft_camera_remote *remote, const weft_camera_wait *wait,
                                   double deadline_s, weft_captured_frame *frame, weft_error *err);
void weft_camera_remote_close(weft_camera_remote *remote);

/** Brings back a helper that has ended; does nothing when it lives. */
weft_err weft_camera_remote_prepare(weft_camera_remote *remote, const weft_camera_wait *wait,
                                    weft_error *err);

#endif
