/** Which frames a set needs, in the order of their capture. */
#ifndef WEFT_HOST_CAPTURE_PLAN_H
#define WEFT_HOST_CAPTURE_PLAN_H

#include "host/capture/capture.h"
#include "host/capture/frame_name.h"

/** Ambient, dark, all, and every light in a full bracket. */
#define WEFT_CAPTURE_MAX_FRAMES (3 + WEFT_CAPTURE_MAX_LIGHTS * WEFT_CAPTURE_MAX_BRACKET)

typedef struct weft_planned_frame {
    weft_frame_role role;
    int light;                       /* -1 unless role is light */
    uint32_t lights;                 /* which are on */
    double exposure_s;               /* as asked of the camera */
    int bracket;                     /* place in its bracket, 0 the shortest; -1: the only exposure */
    bool middle;                     /* of its bracket: bright enough to see whether the light is on */
    bool shortest;                   /* of its bracket: if this one clips, the set has no better */
    char file[WEFT_FRAME_NAME_SIZE]; /* "light-03.dng"; ".nef" and the like from DSLRs */
    int row;                         /* the set's entry of this frame; -1: none yet */
    bool have;                       /* there already */
} weft_planned_frame;

typedef struct weft_capture_plan {
    int n;
    weft_planned_frame frames[WEFT_CAPTURE_MAX_FRAMES];
} weft_capture_plan;

/**
 * Makes the plan.  The lights of `options` must be set; exposures that are still open count as 1 s and open
 * brackets as the widest, so that a plan can be checked before anything is looked for.  Ambient and dark
 * frame have the longest of the lights' exposures, the frame with all lights the shortest.
 *
 * @param set     its name and date are what the names of the files may say
 * @param suffix  ends the names of the files: ".dng", ".nef"
 * @return WEFT_ERR_USAGE when two frames would have one name, with the field that the template lacks;
 *         or as weft_frame_name_make()
 */
weft_err weft_capture_plan_make(const weft_capture_options *options, int n_lights, const weft_set *set,
                                const char *suffix, weft_capture_plan *plan, weft_error *err);

/** What a message calls a frame: "light 3", "the ambient frame". */
void weft_planned_frame_words(const weft_planned_frame *frame, char text[32]);

#endif
