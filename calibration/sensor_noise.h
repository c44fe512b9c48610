/**
 * A sensor in numbers, from its own raw frames: photon transfer (Janesick 2001).
 *
 * In small even patches the variance of a photosite over its mean level S (DN over black) is
 *
 *     var = read^2 + S / gain + (prnu S)^2
 *
 * with the gain in electrons per DN.  The variance is taken from second differences between sites of one
 * colour, so that gradients drop out; blocks with texture or edges stand out from the others of their level
 * and do not count.
 */
#ifndef WEFT_CALIBRATION_SENSOR_NOISE_H
#define WEFT_CALIBRATION_SENSOR_NOISE_H

#include "core/error.h"
#include "core/image.h"

#define WEFT_SENSOR_CLASSES 4  /* sites of the 2x2 cell, in the order of the black levels */
#define WEFT_SENSOR_LEVELS  40 /* even in the root of the level */

/** One class of photosites. */
typedef struct weft_sensor_class {
    double gain_e_per_dn, gain_sigma; /* at the analogue gain of the frames */
    double read_noise_e;
    double prnu;          /* relative rms of the sites' sensitivities */
    double saturation_dn; /* 0: no frame reached it */
    int n_levels;
    double level_dn[WEFT_SENSOR_LEVELS], variance_dn2[WEFT_SENSOR_LEVELS]; /* what the line was fitted to */
} weft_sensor_class;

/** What frames have told so far. */
typedef struct weft_sensor_frames weft_sensor_frames;

/** For frames whose black and white levels are those of `first`. */
weft_err weft_sensor_frames_create(const weft_mosaic *first, weft_sensor_frames **frames, weft_error *err);
void weft_sensor_frames_destroy(weft_sensor_frames *frames);

/** Adds a frame.  @param black_dn  [4] levels to subtract.  @return WEFT_ERR_NOMEM */
weft_err weft_sensor_frames_add(weft_sensor_frames *frames, const weft_mosaic *mosaic,
                                const double black_dn[WEFT_SENSOR_CLASSES], weft_error *err);

/** Fits a class.  @return WEFT_ERR_NODATA when fewer than 6 levels, or less than a factor of 8 between them,
 * were seen
 */
weft_err weft_sensor_fit(const weft_sensor_frames *frames, int site, weft_sensor_class *result,
                         weft_error *err);

#endif
