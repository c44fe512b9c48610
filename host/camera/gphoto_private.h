/** Inside the gphoto backend: the state that cam_gphoto.c (settings) and gphoto_frame.c (frames) share. */
#ifndef WEFT_HOST_CAMERA_GPHOTO_PRIVATE_H
#define WEFT_HOST_CAMERA_GPHOTO_PRIVATE_H

#include "host/camera/camera.h"
#include "host/camera/gphoto_bodies.h"
#include "host/camera/gphoto_session.h"

typedef struct gphoto_camera {
    gphoto_session session;
    char address[112];
    const gphoto_body *body;
    char shutter[32], iso[32]; /* names of the settings that this body has; iso "": none */
    weft_camera_state *info;   /* the caller's, filled by open and configure */
    weft_camera_settings set;  /* what the frames have, as read back */
    uint64_t sequence;         /* frames that came */
    char last_sha256[65];      /* of the last file: an announcement that comes again brings the same */
    bool owing;                /* a frame that was given up may still come */
    bool warned_battery;
} gphoto_camera;

/** Connects, looks who it is, and makes all settings of the body's row. */
weft_err gphoto_set_up(gphoto_camera *a, weft_error *err);

/** Makes the settings of the body's row.
 *  @param again  also those that seem to be so already: libgphoto2 remembers what it read for 2 s, and
 *                somebody may have pressed a button */
weft_err gphoto_make_settings(gphoto_camera *a, bool again, weft_error *err);

/** Sets shutter speed and ISO (0: as they are) to the nearest the body has; `got` gets what it then has.
 *  @param again  as above */
weft_err gphoto_set_exposure(gphoto_camera *a, double exposure_s, double gain, bool again,
                             weft_camera_settings *got, weft_error *err);

/** Refuses an empty battery, and warns once of a low one. */
weft_err gphoto_check_battery(gphoto_camera *a, weft_error *err);

/** The `expose` of the backend.  @param learn  fills the geometry of a->info from the frame */
weft_err gphoto_expose(gphoto_camera *a, double deadline_s, weft_camera_idle_fn *idle, void *idle_context,
                       bool learn, weft_captured_frame *frame, weft_error *err);

#endif
