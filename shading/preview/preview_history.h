/**
 * Shadows that remember the frame before (S-BLG-07).
 *
 * Each place of a frame is looked for where the sample had it in the frame before; what was seen there counts
 * when its depth is within 2 % of the distance, and its share of light within 0.5:
 *
 *     s_out = ok ? lerp(s, s_before, b) : s,   b = 0.9, or k/(k + 1) while there are only k frames
 *
 * so that ten frames are their mean and later ones fade.  A lamp that moves by more than one degree over the
 * sample forgets everything.  The blog leaves functions and constants open; these are S-BLG-07's.
 */
#ifndef WEFT_SHADING_PREVIEW_HISTORY_H
#define WEFT_SHADING_PREVIEW_HISTORY_H

#include "shading/preview/preview.h"

#define WEFT_HISTORY_SHARE 0.9  /* of the past, once there is enough of it */
#define WEFT_HISTORY_DEPTH 0.02 /* of the distance, beyond which a place is another one */
#define WEFT_HISTORY_LIGHT 0.5  /* beyond which a share of light is another shadow */
#define WEFT_HISTORY_TURN  1.0  /* degrees that a lamp may move */

struct weft_preview_visibility;
struct weft_preview_setup;

/** {0} is a history of nothing.  Give it to every frame of a sequence (weft_preview_shadows.history). */
typedef struct weft_preview_history {
    int n_frames;
    int frame;                              /* of the sequence, for the dither */
    weft_image lit, depth;                  /* of the frame before */
    double aim[WEFT_PREVIEW_MAX_LIGHTS][3]; /* unit directions to its lamps from the middle of the sample */
    double turn_cos, turn_sin;
} weft_preview_history;

void weft_preview_history_fini(weft_preview_history *history);

/** Blends the buffer with the past and remembers the result. */
weft_err weft_preview_history_add(weft_preview_history *history, const struct weft_preview_setup *setup,
                                  struct weft_preview_visibility *visibility, weft_error *err);

#endif
