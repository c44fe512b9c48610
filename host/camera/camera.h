/**
 * Cameras: one interface, one backend per file, registered in one array.
 *
 * Call order: list | open -> configure -> (expose | configure)* -> close.  One thread per camera at a time.
 * A frame that arrives damaged has a status; it is not an error.  Every wait has a deadline.
 *
 * Each backend runs in a process of its own, the helper weft-camera-NAME (camera_child.h): a program that
 * uses cameras links none of their libraries, and can end any call by ending the helper.  Frames come back in
 * sealed shared memory.  A helper that crashes costs the frame: weft_camera_expose() gives it the status
 * WEFT_FRAME_ABORTED, and the next call starts a new helper, opens the same camera and sets it as it was.
 *
 * A new backend is one file with a weft_camera_backend, one line in CMakeLists.txt and one in cameras.c.
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

/** What starts an exposure. */
typedef enum weft_camera_trigger {
    WEFT_TRIGGER_SOFTWARE, /* weft_camera_expose() itself */
    WEFT_TRIGGER_WIRE,     /* a pulse on the camera's input line, which comes when the camera is armed */
} weft_camera_trigger;

/** A part of the sensor, in photosites; width 0: the whole. */
typedef struct weft_camera_region {
    int x, y, width, height;
} weft_camera_region;

/** What is asked of a camera; zero leaves the camera's default. */
typedef struct weft_camera_settings {
    double exposure_s;
    double gain; /* analogue, linear; 1 = base */
    weft_camera_trigger trigger;
    weft_camera_region region; /* even numbers: the filter pattern stays; zeroed: as it is */
} weft_camera_settings;

/** What the device really set, and what its frames are like. */
typedef struct weft_camera_state {
    char id[128], vendor[64], model[64], serial[64];
    int width, height, bits; /* 0 until it is configured, when only a frame tells (DSLRs) */
    weft_cfa cfa;
    double black[4], white; /* DN */
    double exposure_s, gain;
    char suffix[8]; /* ".nef" when frames come as the camera's own files; "" when they come as samples */
} weft_camera_state;

typedef enum weft_frame_status {
    WEFT_FRAME_COMPLETE,
    WEFT_FRAME_INCOMPLETE, /* packets were lost */
    WEFT_FRAME_TIMEOUT,    /* nothing came before the deadline */
    WEFT_FRAME_ABORTED,    /* the backend's process ended; not for backends */
} weft_frame_status;

/** A raw file as the camera wrote it. */
typedef struct weft_camera_file {
    uint8_t *bytes;
    size_t size;    /* 0: none */
    char suffix[8]; /* ".nef" */
} weft_camera_file;

typedef struct weft_captured_frame {
    weft_frame_status status;
    char reason[192];      /* in words, when not complete */
    weft_mosaic mosaic;    /* owned by the caller; valid only when complete.  Zeroed before the first use;
                              the memory is used again by the next frame of the same size */
    weft_camera_file file; /* what `mosaic` was decoded from, to be kept instead of a DNG; the caller's too */
    uint64_t sequence;     /* the camera's own count of frames */
    double exposure_s, gain; /* achieved */
} weft_captured_frame;

/** Frees what a frame holds; `{0}` is fine. */
void weft_captured_frame_fini(weft_captured_frame *frame);

/** Called at least ten times a second while a backend waits for a frame, from the waiting thread: renews a
 *  lease, looks for a cancellation.  Anything but WEFT_OK ends the wait with that status. */
typedef weft_err weft_camera_idle_fn(void *context, weft_error *err);

/** Called once per frame when a camera with WEFT_TRIGGER_WIRE is armed: sends the pulse. */
typedef weft_err weft_camera_fire_fn(void *context, weft_error *err);

typedef struct weft_camera_device weft_camera_device;

/** A camera library behind the interface.  It runs in the helper (camera_serve.c), in tests also in the
 *  program itself (weft_camera_open_on()). */
typedef struct weft_camera_backend {
    const char *name;    /* "aravis" */
    const char *summary; /* "GigE Vision and USB3 Vision cameras (Aravis)" */
    size_t state_size;   /* bytes of the backend's own state, zeroed before open */
    weft_err (*list)(weft_camera_found *found, int max, int *n, weft_error *err);
    weft_err (*open)(void *state, const char *address, weft_camera_state *info, weft_error *err);
    weft_err (*configure)(void *state, const weft_camera_settings *wanted, weft_camera_state *info,
                          weft_error *err);
    /* Trigger, wait at most exposure + deadline_s; `idle` may be NULL.  With WEFT_TRIGGER_WIRE: arm, then
     * wait; the first call of `idle` says that the pulse may come. */
    weft_err (*expose)(void *state, double deadline_s, weft_camera_idle_fn *idle, void *idle_context,
                       weft_captured_frame *frame, weft_error *err);
    void (*close)(void *state); /* also after a failed open */
} weft_camera_backend;

/** A backend as the program knows it: by name. */
typedef struct weft_camera_kind {
    const char *name;    /* its helper is weft-camera-NAME */
    const char *summary; /* "GigE Vision and USB3 Vision cameras (Aravis)" */
} weft_camera_kind;

/** All backends there are, also those whose helper is not installed; ends with {0}. */
extern const weft_camera_kind weft_camera_kinds[];
/** Whether this installation has the backend's helper. */
bool weft_camera_is_installed(const char *backend);

/** Asks every backend that is installed, all at once.  `found` has room for `max`.  A backend whose helper
 *  fails is warned of; the cameras of the others are listed all the same. */
weft_err weft_camera_list(weft_camera_found *found, int max, int *n, weft_error *err);

/** Opens "backend:address"; "auto" takes the only camera there is.
 *  @return WEFT_ERR_USAGE for an unknown backend, WEFT_ERR_MISSING when none is found or "auto" cannot
 *          choose, WEFT_ERR_DEVICE when it is there but cannot be used; each says why and what to do */
weft_err weft_camera_open(const char *id, weft_camera_device **camera, weft_error *err);
/** Opens `address` on a backend inside this process. */
weft_err weft_camera_open_on(const weft_camera_backend *backend, const char *address,
                             weft_camera_device **camera, weft_error *err);
/** Sets and reads back.  @return WEFT_ERR_RANGE when the camera cannot do it, with what it can. */
weft_err weft_camera_configure(weft_camera_device *camera, const weft_camera_settings *wanted,
                               weft_error *err);
const weft_camera_state *weft_camera_get_state(const weft_camera_device *camera);
const char *weft_camera_backend_name(const weft_camera_device *camera);

/** What to call while a call waits; NULL: nothing. */
void weft_camera_set_idle(weft_camera_device *camera, weft_camera_idle_fn *idle, void *context);

/** What to call when the camera is armed for a pulse (WEFT_TRIGGER_WIRE); NULL: nothing, somebody else
 *  sends it. */
void weft_camera_set_fire(weft_camera_device *camera, weft_camera_fire_fn *fire, void *context);

/** Starts a helper that has ended anew: with the camera open and set as it was.  Takes up to 5 s (a GigE
 *  Vision camera stays its dead owner's for 3), so call it while no light is on; every other call does it
 *  too.  Does nothing when all is well.
 *  @return WEFT_ERR_DEVICE when the helper ended too often in a row, WEFT_ERR_MISMATCH when another camera
 *          is there now; as weft_camera_open() */
weft_err weft_camera_prepare(weft_camera_device *camera, weft_error *err);

/** The helper's process; 0 when there is none now, or for weft_camera_open_on(). */
long weft_camera_process(const weft_camera_device *camera);

/** Takes one frame now: triggers and waits until it is here, at most exposure + deadline_s.
 *  @return WEFT_OK also for a frame that is not complete: see frame->status.  WEFT_ERR_DEVICE when the
 *          camera is gone; what `idle` returned. */
weft_err weft_camera_expose(weft_camera_device *camera, double deadline_s, weft_captured_frame *frame,
                            weft_error *err);
/** NULL is fine. */
void weft_camera_close(weft_camera_device *camera);

#endif
