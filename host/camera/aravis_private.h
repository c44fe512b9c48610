/** Inside the Aravis backend: the state that cam_aravis.c (settings) and aravis_stream.c (frames) share. */
#ifndef WEFT_HOST_CAMERA_ARAVIS_PRIVATE_H
#define WEFT_HOST_CAMERA_ARAVIS_PRIVATE_H

#include "host/camera/aravis_formats.h"
#include "host/camera/camera.h"
#include "host/camera/frame_clock.h"

#include <arv.h>
#include <stdatomic.h>

/** What the address may say behind a comma: "192.168.1.20,packet=1400,resend=off,line=Line0". */
typedef struct aravis_wishes {
    int packet_bytes; /* 0: the largest that passes */
    int resend;       /* 1 always, 0 never, -1: never on loopback, else always */
    char line[32];    /* input of the trigger; empty: the first there is */
} aravis_wishes;

typedef struct aravis_camera {
    ArvCamera *camera;
    ArvDevice *device; /* borrowed from `camera` */
    ArvStream *stream; /* NULL: no stream runs */
    char address[120]; /* as given; names the camera in messages */
    bool loopback;     /* GigE Vision on 127.x.x.x */
    bool stale;        /* a frame may still come for a trigger that was given up: start a new stream */
    bool has_gain;
    aravis_wishes wishes;
    bool has_last_id;
    uint64_t last_id; /* of the stream's last frame */
    double triggered_s;
    weft_frame_clock clock;      /* of the stream's frames */
    char wire_source[32];        /* the input line of WEFT_TRIGGER_WIRE */
    weft_camera_trigger trigger; /* as the device is set */
    weft_camera_region region;   /* likewise */
    weft_gain_scale gain_scale;
    double gain_unit;
    weft_raw_format format;
    ArvPixelFormat code;
    weft_camera_state *info; /* the caller's, filled by open and configure */
    double exposure_min_s, exposure_max_s;
    weft_camera_settings set; /* what the frames have, as read back */
    atomic_bool lost;         /* from Aravis' heartbeat thread */
} aravis_camera;

/** Fills `err` from a GError (which it frees): "camera ADDRESS: DOING: ..." with what to do. */
weft_err aravis_fail(const aravis_camera *a, GError *error, const char *doing, weft_error *err);

/** Calls an Aravis function (its last argument must be &error) and returns from the caller on failure. */
#define ARAVIS_TRY(a, doing, call)                                                                           \
    do {                                                                                                     \
        GError *error = NULL;                                                                                \
        call;                                                                                                \
        if (error)                                                                                           \
            return aravis_fail(a, error, doing, err);                                                        \
    } while (0)

/** Writes the exposure to the device and reads back what it made of it. */
weft_err aravis_set_exposure(const aravis_camera *a, double exposure_s, double *achieved_s, weft_error *err);

/** Sets the source of the trigger and reads it back. */
weft_err aravis_set_trigger_source(aravis_camera *a, const char *source, weft_error *err);

/** How long a silent camera is asked whether it lives, ending with the deadline. */
#define ARAVIS_PING_S 1.2
/** Whether a GigE Vision camera answers a READREG (GigE Vision 2.0, section 17) on a socket of our own:
 *  Aravis' own reads stand in line behind its heartbeat, which waits for seconds when the camera is gone. */
bool aravis_answers(const char *address);

/** What is wrong with a frame of this status, and the remedy; "" for a whole one. */
const char *aravis_status_words(ArvBufferStatus status);

/** Reads what the address says behind its first comma.  @return WEFT_ERR_USAGE naming the word */
weft_err aravis_read_wishes(const char *words, aravis_wishes *wishes, weft_error *err);

/** The `expose` of the backend. */
weft_err aravis_expose(void *state, double deadline_s, weft_camera_idle_fn *idle, void *idle_context,
                       weft_captured_frame *frame, weft_error *err);

/** Stops the stream, if one runs; a camera that is gone is not asked. */
void aravis_stop(aravis_camera *a);

#endif
