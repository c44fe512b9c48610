/**
 * The white strip beside the sample: how far each lamp's light has drifted since the calibration.
 *
 * A set whose set.json has
 *
 *     "strip": { "rect_px": [left, top, right, bottom], "reflectance": 0.99 }
 *
 * shows, in every frame, a matte white strip in that rectangle, flat on the sample plane.  What the
 * calibration says it should show, against what it does, is the drift of the lamp, colour by colour.
 */
#ifndef WEFT_HOST_SOLVE_STRIP_H
#define WEFT_HOST_SOLVE_STRIP_H

#include "calibration/calibration.h"
#include "host/solve/incidence.h"
#include "host/solve/light_plates.h"

#define WEFT_STRIP_DRIFT_MOST 0.25 /* more is no drift any more */

typedef struct weft_strip {
    double rect_px[4];  /* left, top, right, bottom: photosites whose middle is inside count */
    double reflectance; /* 0.05..1 */
} weft_strip;

typedef struct weft_strip_drift {
    double gain[WEFT_LIGHTS_MAX][3]; /* measured / expected */
    double sigma;                    /* standard deviation of a gain, the largest */
} weft_strip_drift;

/** The set's strip; `*present` false when it has none.  @return WEFT_ERR_FORMAT, _RANGE naming set.json */
weft_err weft_strip_of_set(const weft_set *set, weft_strip *strip, bool *present, weft_error *err);

/**
 * Measures every lamp and colour on the strip.
 *
 * @param pixel  how the plates' pixels lie on the sensor
 * @return WEFT_ERR_RANGE for a strip that is clipped or too small, WEFT_ERR_MISMATCH when a light does not
 * look like itself there (uneven, swapped with another, or drifted by more than WEFT_STRIP_DRIFT_MOST),
 * naming the light
 */
weft_err weft_strip_measure(const weft_light_plates *plates, weft_pixel_scale pixel,
                            const weft_calibration *cal, const weft_strip *strip, weft_strip_drift *drift,
                            weft_error *err);

/**
 * Takes the lamps' drift since the calibration into the lights of `cal`, where the set has a strip.
 *
 * @param present  false: it has none, and `cal` and `drift` stay as they are
 */
weft_err weft_strip_follow(const weft_set *set, const weft_light_plates *plates, weft_pixel_scale pixel,
                           weft_calibration *cal, weft_strip_drift *drift, bool *present, weft_error *err);

#endif
