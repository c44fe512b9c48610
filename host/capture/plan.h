/** Which frames a set needs, in the order of their capture. */
#ifndef WEFT_HOST_CAPTURE_PLAN_H
#define WEFT_HOST_CAPTURE_PLAN_H

#include "host/capture/capture.h"

/** Ambient, dark, all, and every light in a full bracket. */
#define WEFT_CAPTURE_MAX_FRAMES (3 + WEFT_CAPTURE_MAX_LIGHTS * WEFT_CAPTURE_MAX_BRACKET)

typedef struct weft_planned_frame {
    weft_frame_role role;
    int light;         /* -1 unless role is light */
    uint32_t lights;   /* which are on */
    double exposure_s; /* as asked of the camera */
    bool middle;       /* of its bracket: bright enough to see whether the light is on */
    bool shortest;     /* of its bracket: if this one clips, the set has no better */
    char file[48];     /* "light-03.dng", "light-03-b1.dng" in a bracket; ".nef" and the like from DSLRs */
    bool have;         /* there already */
} weft_planned_frame;

typedef struct weft_capture_plan {
    int n;
    weft_planned_frame frames[WEFT_CAPTURE_MAX_FRAMES];
} weft_capture_plan;

/** Makes the plan.  `options` must be complete: lights, exposure, bracket set.  `suffix` ends the names of
 * the files: ".dng", ".nef". */
void weft_capture_plan_make(const weft_capture_options *options, int n_lights, const char *suffix,
                            weft_capture_plan *plan);

#endif
