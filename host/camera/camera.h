/**
 * Cameras: one interface, one backend per file, registered in one array.
 *
 * Call order: list | open -> configure -> (expose | configure)* -> close.  One thread per camera.
 * A frame that arrives damaged has a status; it is not an error.  Every wait has a deadline.
 *
 * A new backend is one file with a weft_camera_backend, and one line in cameras.c.
 */
#ifndef WEFT_HOST_CAMERA_CAMERA_H
#define WEFT_HOST_CAMERA_CAMERA_H

#include "core/error.h"
#include "core/image.h"

#include <stdbool.h>
#include <stdint.h>

/** A camera that was found. */
typedef struct weft_camera_found {
    char id[128]; /* "aravis:127.0.0.1": give it to weft_camera_open() */
    char vendor[64], model[64], serial[64];
    char problem[256]; /* why it cannot be opened, and the remedy; empty when it can */
} weft_camera_found;

/** What is asked of a camera; zero leaves the camera's default. */
typedef struct weft_camera_settings {
    double exposure_s;
    double gain; /* analogue, linear; 1 = base */
} weft_camera_settings;

/** What the device really set, and what its frames are like. */
typedef struct weft_camera_state {
    char id[128], vendor[64], model[64], serial[64];
    int width, height, bits;
    weft_cfa cfa;
    double black[4], white; /* DN */
    double exposure_s, gain;
} weft_camera_state;

typedef enum weft_frame_status {
    WEFT_FRAME_COMPLETE,
    WEFT_FRAME_INCOMPLETE, /* packets were lost */
    WEFT_FRAME_TIMEOUT,    /* nothing came before the deadline */
} weft_frame_status;

typedef struct weft_captured_frame {
    weft_frame_status status;
    char reason[128];        /* in words, when not complete */
    weft_mosaic mosaic;      /* owned by the caller; valid only when complete.  Zeroed before the first use;
                                the memory is used again by the next frame of the same size */
    uint64_t sequence;       /* the camera's own count of frames */
    double exposure_s, gain; /* achieved */
} weft_captured_frame;

/** Called at least ten times a second while a backend waits for a frame, from the waiting thread: renews a
 *  lease, looks for a cancellation.  Anything but WEFT_OK ends the wait with that status. */
typedef weft_err weft_camera_idle_fn(void *context, weft_error *err);

typedef struct weft_camera_device weft_camera_device;

typedef struct weft_camera_backend {
    const char *name;    /* "aravis" */
    const char *summary; /* "GigE Vision and USB3 Vision cameras (Aravis)" */
    size_t state_size;   /* bytes of the backend's own state, zeroed before open */
    weft_err (*list)(weft_camera_found *found, int max, int *n, weft_error *err);
    weft_err (*open)(void *state, const char *address, weft_camera_state *info, weft_error *err);
    weft_err (*configure)(void *state, const weft_camera_settings *wanted, weft_camera_state *info,
                          weft_error *err);
    /* Trigger, wait at most exposure + deadline_s; `idle` may be NULL. */
    weft_err (*expose)(void *state, double deadline_s, weft_camera_idle_fn *idle, void *idle_context,
                       weft_captured_frame *frame, weft_error *err);
    void (*close)(void *state); /* also after a failed open */
} weft_camera_backend;

extern const weft_camera_backend weft_camera_aravis; /* cam_aravis.c */

/** All backends of this build; ends with NULL. */
extern const weft_camera_backend *const weft_camera_backends[];

/** Asks every backend.  `found` has room for `max`. */
weft_err weft_camera_list(weft_camera_found *found, int max, int *n, weft_error *err);

/** Opens "backend:address"; "auto" takes the only camera there is.
 *  @return WEFT_ERR_USAGE for an unknown backend, WEFT_ERR_MISSING when none is found or "auto" cannot
 *          choose, WEFT_ERR_DEVICE when it is there but cannot be used; each says why and what to do */
weft_err weft_camera_open(const char *id, weft_camera_device **camera, weft_error *err);
/** Opens `address` on a backend that need not be in the array. */
weft_err weft_camera_open_on(const weft_camera_backend *backend, const char *address,
                             weft_camera_device **camera, weft_error *err);
/** Sets and reads back.  @return WEFT_ERR_RANGE when the camera cannot do it, with what it can. */
weft_err weft_camera_configure(weft_camera_device *camera, const weft_camera_settings *wanted,
                               weft_error *err);
const weft_camera_state *weft_camera_get_state(const weft_camera_device *camera);
const char *weft_camera_backend_name(const weft_camera_device *camera);

/** What to call while weft_camera_expose() waits; NULL: nothing. */
void weft_camera_set_idle(weft_camera_device *camera, weft_camera_idle_fn *idle, void *context);

/** Takes one frame now: triggers and waits until it is here, at most exposure + deadline_s.
 *  @return WEFT_OK also for a frame that is not complete: see frame->status.  WEFT_ERR_DEVICE when the
 *          camera is gone; what `idle` returned. */
weft_err weft_camera_expose(weft_camera_device *camera, double deadline_s, weft_captured_frame *frame,
                            weft_error *err);
/** NULL is fine. */
void weft_camera_close(weft_camera_device *camera);

#endif
