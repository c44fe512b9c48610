/**
 * Captured sets straight from the scene: what `weft capture` would bring home from the virtual scanner,
 * without firmware, network and camera between.  For long series and full-size frames.
 *
 * The frames are those of the sensor (noise, fixed pattern, converter), deterministic in seed, sample and
 * frame: the noise of a sample does not depend on which others are rendered with it.
 */
#ifndef WEFT_HOST_RIG_RENDER_SET_H
#define WEFT_HOST_RIG_RENDER_SET_H

#include "host/rig/scene.h"

typedef struct weft_rig_render_plan {
    const char *folder;  /* gets SAMPLE.set of each and truth.cal; made when absent */
    const char *samples; /* names with commas between */
    weft_numbers
        exposures; /* s, each frame once with each; none: 75 % of the range at the brightest photosite */
    bool force;    /* replaces sets that are there */
} weft_rig_render_plan;

/**
 * Renders the sets.  Boards (`board-...`) get one frame with all lamps on, all else a frame per lamp and one
 * without; with "strip_mm" in the scene their set.json says where the white strip is seen.
 *
 * @return WEFT_ERR_EXISTS, WEFT_ERR_USAGE for unknown samples, WEFT_ERR_IO, WEFT_ERR_CANCELLED
 */
weft_err weft_rig_render_sets(const weft_rig_setup *setup, const weft_rig_render_plan *plan, weft_error *err);

#endif
