/** A look at each light before a set is taken: what clips, and which exposure suits. */
#ifndef WEFT_HOST_CAPTURE_LOOK_H
#define WEFT_HOST_CAPTURE_LOOK_H

#include "host/capture/auto_exposure.h"
#include "host/capture/capture.h"
#include "host/capture/frame_stats.h"

typedef struct weft_light_look {
    int light;              /* -1: all lights off */
    char reason[200];       /* why there is no good frame; else empty */
    weft_frame_stats stats; /* at the exposure of the look */
    weft_light_level level; /* zeroed when suggested_s is not to be told */
    double suggested_s; /* puts the brightest thousandth at WEFT_AUTO_EXPOSURE_TARGET; 0: not to be told */
    int bracket;        /* exposures around suggested_s that hold both ends; 0: not to be told */
} weft_light_look;

typedef struct weft_capture_look {
    double exposure_s, gain; /* of the frames that were looked at */
    double suggested_s;      /* the one exposure that suits all lights: the shortest of theirs */
    double longest_s;        /* the longest of theirs */
    int bracket;             /* the widest that a light needs around suggested_s */
    int n_clipped;           /* lights with more than 0.1 % of a colour clipped */
    int n;
    weft_light_look lights[1 + WEFT_CAPTURE_MAX_LIGHTS]; /* the first is "all off" */
} weft_capture_look;

/**
 * Takes a frame without light and one of each light that the options name, keeps none, and measures them.
 * With options->exposure_s 0 it finds the exposure first.  Lights off in any case.
 *
 * @return as weft_capture_run()
 */
weft_err weft_capture_look_at(const weft_capture_options *options, weft_camera_device *camera,
                              weft_controller *controller, weft_progress *progress, weft_capture_look *look,
                              weft_error *err);

#endif
