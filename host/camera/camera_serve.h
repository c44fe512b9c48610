/**
 * The helper's end: a backend behind a socket (camera_message.h).  One call at a time, in order.
 *
 * WEFT_CAMERA_FAULT makes it misbehave, for tests: "DEED@CALL:N" at the N-th such call of this process
 * (without :N at every one), several with commas between.  Deeds: crash, exit, hang, garbage, stray (an
 * answer nobody asked for), and for EXPOSE loose (a frame that is not sealed) and short (one too small).
 */
#ifndef WEFT_HOST_CAMERA_SERVE_H
#define WEFT_HOST_CAMERA_SERVE_H

#include "host/camera/camera_message.h"

/** Serves until CLOSE.  The process ends at once when the other end hangs up.
 *  @return the exit status of the helper */
int weft_camera_serve(const weft_camera_backend *backend, int socket);

/** What the helper is to do wrong. */
typedef enum weft_camera_deed {
    WEFT_DEED_NONE,
    WEFT_DEED_CRASH,
    WEFT_DEED_EXIT,
    WEFT_DEED_HANG,
    WEFT_DEED_GARBAGE,
    WEFT_DEED_STRAY,
    WEFT_DEED_LOOSE,
    WEFT_DEED_SHORT,
} weft_camera_deed;

/** The deed that WEFT_CAMERA_FAULT has for the `count`-th (from 1) call of this kind. */
weft_camera_deed weft_camera_deed_for(const char *faults, weft_camera_call call, int count);

#endif
