/**
 * The process in which a camera library runs: the helper `weft-camera-BACKEND`.
 *
 * libgphoto2 may wait for 1000 s and has crashed on what a camera sent; Aravis' objects go stale when a
 * camera is plugged in again; libcamera is C++.  In a process of its own each can be ended at any moment,
 * which is the one cancellation that always works, and a crash costs a frame instead of the program.
 *
 * The helper ends with the program that started it, whatever ends that: its end of the socket hangs up.
 * Nothing of it outlives weft_camera_child_end(): no process, no descriptor.
 */
#ifndef WEFT_HOST_CAMERA_CHILD_H
#define WEFT_HOST_CAMERA_CHILD_H

#include "host/camera/camera_message.h"

#include <sys/types.h>

typedef struct weft_camera_child {
    pid_t pid; /* 0: there is none */
    int fd;    /* our end of the socket pair */
    char backend[16];
    uint32_t number;  /* of the last request */
    bool answer_owed; /* a cancelled request is not answered yet */
    bool stopped;     /* ended by us because `idle` said so, not by a fault of its own */
    char end[96];     /* how the last process ended: "was killed by signal 9 (Killed)" */
} weft_camera_child;

/** What to do while waiting for an answer; `idle` may be NULL. */
typedef struct weft_camera_wait {
    double deadline_s;
    weft_camera_idle_fn *idle;
    void *context;
    bool polite; /* when idle says stop: send CANCEL and leave the answer for later, else kill */
    weft_camera_fire_fn *fire; /* what ARMED calls; NULL: nothing */
    void *fire_context;
} weft_camera_wait;

/** Whether this installation has a helper for the backend. */
bool weft_camera_child_exists(const char *backend);

/** Starts the helper and hears its HELLO.
 *  @return WEFT_ERR_UNSUPPORTED when there is no such helper, WEFT_ERR_DEVICE when it does not start,
 *          WEFT_ERR_VERSION when it is of another build */
weft_err weft_camera_child_start(weft_camera_child *child, const char *backend, weft_error *err);

/** Sends a request without waiting.  @return WEFT_ERR_DEVICE when the helper is gone (and then ended) */
weft_err weft_camera_child_ask(weft_camera_child *child, weft_camera_message *message, size_t body_size,
                               weft_error *err);

/**
 * Waits for the answer to the last request.
 *
 * @param message  the request, which becomes the answer; a failure of the backend is returned as its weft_err
 * and text
 * @param fd       gets the descriptor of the answer or -1; NULL: it is closed
 * @return when the helper has ended, was ended because the deadline passed, or said what it must not:
 *         WEFT_ERR_DEVICE, and child->pid is 0.  What `idle` or `fire` returned, when not WEFT_OK.
 */
weft_err weft_camera_child_answer(weft_camera_child *child, const weft_camera_wait *wait,
                                  weft_camera_message *message, int *fd, weft_error *err);

/** Ends the helper: asks it when `patience_s` is positive, then by SIGKILL.  Ended already is fine. */
void weft_camera_child_end(weft_camera_child *child, double patience_s);

#endif
