/**
 * The capture engine: lights and camera in, a set of frames on disk out.
 *
 * One frame after the other: ambient (all lights off), each light, all lights, dark.  Each frame is
 * exposed, looked at (whole, lit by the right light, not clipped), taken again when it is wrong, written as
 * a DNG and entered in set.json, which is saved after every frame.  Whatever ends the program, the files
 * with final names are whole, the lights are dark, and the set can be resumed.
 */
#ifndef WEFT_HOST_CAPTURE_CAPTURE_H
#define WEFT_HOST_CAPTURE_CAPTURE_H

#include "core/error.h"
#include "core/progress.h"
#include "host/camera/camera.h"
#include "host/light/controller.h"
#include "host/set/set.h"

#include <stdbool.h>
#include <stdint.h>

#define WEFT_CAPTURE_MAX_LIGHTS  32
#define WEFT_CAPTURE_MAX_BRACKET 9
/** The bracket that each light needs, found out by looking. */
#define WEFT_CAPTURE_BRACKET_AUTO (-1)

/** What is to be captured.  {.folder = ...} alone is a sensible set: every light and the ambient frame. */
typedef struct weft_capture_options {
    const char *folder; /* "twill.set" */
    const char *name;   /* NULL: the folder's name without ".set" */
    uint32_t lights;    /* bit i: light i is photographed alone; 0: all lights of the controller */
    bool no_lights;     /* no frame with a single light (a board needs only the frame with all) */
    double exposure_s;  /* 0: found out so that the brightest thousandth lies at 70 % of the range */
    bool each;          /* what is found out is so for each light by itself, not for the brightest of all */
    double exposures_s[WEFT_CAPTURE_MAX_LIGHTS]; /* of a light; 0: as exposure_s says */
    double gain;                                 /* 0: the camera's base gain */
    int bracket; /* exposures per light, 1..WEFT_CAPTURE_MAX_BRACKET or WEFT_CAPTURE_BRACKET_AUTO; 0: 1 */
    int brackets[WEFT_CAPTURE_MAX_LIGHTS]; /* of a light; 0: as bracket says */
    int average;           /* frames of which each file is the mean, 1..WEFT_AVERAGE_MAX; 0: 1 */
    int level;             /* brightness of the lights, 1..level_max; 0: full */
    bool no_ambient;       /* no frame with all lights off */
    bool all;              /* also one frame with all lights on */
    bool dark;             /* also one frame with the lens capped */
    const char *file_name; /* template of the files' names (frame_name.h); NULL: the default */
    bool sidecar;          /* also FILE.json beside each frame (sidecar.h) */
    double settle_s;       /* between light on and trigger; 0: 5 ms */
    weft_camera_trigger trigger;
    double deadline_s; /* how long after its exposure a frame may come; 0: 6 s */
    int tries;         /* per frame; 0: 3 */
    double patience_s; /* how long a light controller that was unplugged is waited for; 0: 10 s */
    bool resume;       /* go on with a set that was interrupted */
    bool force;        /* replace a set that is there */
    /** Called before the dark frame, to have the lens capped; NULL: not called. */
    weft_err (*cap_lens)(void *context, weft_error *err);
    void *context;
} weft_capture_options;

/** What was done. */
typedef struct weft_capture_report {
    int n_frames;            /* of the set */
    int n_taken, n_kept;     /* now; from before */
    int n_retries;           /* frames that were taken again */
    int n_warnings;          /* clipped frames, bright room */
    double exposure_s, gain; /* as the camera set them; of the middle of a bracket, of the longest light */
    double shortest_s;       /* likewise, of the shortest light */
    int n_exposures;         /* of lights: more than there are lights when some have brackets */
    double seconds;
} weft_capture_report;

/** Says before any device is opened that the folder holds what the options do not allow to be replaced or
 *  resumed.  @return WEFT_ERR_EXISTS, WEFT_ERR_IO, WEFT_ERR_FORMAT for a damaged set.json */
weft_err weft_capture_check_folder(const weft_capture_options *options, weft_error *err);

/**
 * Captures a set.
 *
 * The controller's lease is kept alive throughout, also during long exposures.  When it returns, for
 * whatever reason, the lights are off.
 *
 * @param progress  begun and ended here; one unit is a frame
 * @param set       gets the set as it is on disk; weft_set_fini() it
 * @param report    may be NULL
 * @return WEFT_ERR_EXISTS when the folder holds a set and neither `resume` nor `force` is given;
 *         WEFT_ERR_MISMATCH when `resume` asks for other settings than the set was begun with;
 *         WEFT_ERR_IO naming the file, or how much room is missing; WEFT_ERR_DEVICE naming the light or the
 *         camera; WEFT_ERR_CANCELLED after weft_cancel_request(): all frames that were taken are kept
 */
weft_err weft_capture_run(const weft_capture_options *options, weft_camera_device *camera,
                          weft_controller *controller, weft_progress *progress, weft_set *set,
                          weft_capture_report *report, weft_error *err);

#endif
