/**
 * The table of the virtual scanner: which sample lies on it, and what the sensor sees of it.
 *
 * Changing the sample renders it under every lamp first and swaps then, so an exposure never waits for the
 * renderer.  Both samples are in memory during the change: 44 bytes per pixel each.
 */
#ifndef WEFT_HOST_RIG_STAGE_H
#define WEFT_HOST_RIG_STAGE_H

#include "host/rig/render.h"

typedef struct weft_rig_stage weft_rig_stage;

/** Sets up the scanner with nothing but the named sample.  Takes as long as weft_rig_stage_set_sample(). */
weft_err weft_rig_stage_create(const weft_rig_setup *setup, const char *sample, weft_rig_stage **stage,
                               weft_error *err);
void weft_rig_stage_destroy(weft_rig_stage *stage);

/** Puts another sample on the table; the old one stays when it fails.  One thread at a time. */
weft_err weft_rig_stage_set_sample(weft_rig_stage *stage, const char *name, weft_error *err);

const weft_rig_scene *weft_rig_stage_scene(const weft_rig_stage *stage);
const weft_rig_view *weft_rig_stage_view(const weft_rig_stage *stage);
/** The sample on the table; for the thread that changes it. */
const weft_rig_sample *weft_rig_stage_sample(const weft_rig_stage *stage);

/** One exposure of the whole sensor (sensor.h); from any thread.  dn: [height][width] */
void weft_rig_stage_expose(weft_rig_stage *stage, const double on[WEFT_RIG_N_LIGHTS], double exposure_s,
                           double gain, uint16_t *dn);

/** Exposures since the start. */
uint64_t weft_rig_stage_frames(weft_rig_stage *stage);

/** Writes the true calibration alone: camera with pose, lamps, the vignetting as light grid. */
weft_err weft_rig_truth_calibration(const weft_rig_scene *scene, const char *path, weft_error *err);

/**
 * Writes what a perfect scan of the sample would give: FOLDER/truth.cal (camera with pose, lamps with the
 * vignetting as light grid), FOLDER/sensor.maps and FOLDER/plane.maps (docs/virtual-scanner.md).
 *
 * @return WEFT_ERR_EXISTS when FOLDER holds a truth already
 */
weft_err weft_rig_truth_write(const weft_rig_stage *stage, const char *folder, double mm_per_px,
                              weft_error *err);

#endif
