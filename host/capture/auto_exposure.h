/** The exposure that fills the range without clipping, found out by looking. */
#ifndef WEFT_HOST_CAPTURE_AUTO_EXPOSURE_H
#define WEFT_HOST_CAPTURE_AUTO_EXPOSURE_H

#include "host/capture/shoot.h"

/** Where the brightest thousandth of the brightest light's brightest colour is put: room for the
 *  difference between one frame and the next, and for the sensor's bend near white. */
#define WEFT_AUTO_EXPOSURE_TARGET 0.70
#define WEFT_AUTO_EXPOSURE_MAX_S  1.0

/**
 * Finds one exposure for all of the patterns, so that their frames can be compared.
 *
 * @param patterns    `n` masks of lights, each of which is a frame
 * @param exposure_s  two significant digits
 * @return WEFT_ERR_NODATA when even the shortest exposure clips; a sample too dark for the longest gets
 *         that one, with a warning
 */
weft_err weft_auto_exposure(weft_shooter *shooter, const uint32_t *patterns, int n, double gain,
                            double *exposure_s, weft_error *err);

#endif
