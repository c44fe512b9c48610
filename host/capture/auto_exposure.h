/** The exposure that fills the range without clipping, and the bracket that holds the rest, found out by
 *  looking. */
#ifndef WEFT_HOST_CAPTURE_AUTO_EXPOSURE_H
#define WEFT_HOST_CAPTURE_AUTO_EXPOSURE_H

#include "host/capture/shoot.h"

/** Where the brightest thousandth of the brightest light's brightest colour is put: room for the
 *  difference between one frame and the next, and for the sensor's bend near white. */
#define WEFT_AUTO_EXPOSURE_TARGET 0.70
#define WEFT_AUTO_EXPOSURE_MAX_S  1.0
/** Exposures of a bracket differ by this factor. */
#define WEFT_CAPTURE_BRACKET_FACTOR 4.0

/** The widest that weft_light_level_bracket() asks for. */
#define WEFT_LIGHT_LEVEL_MAX_BRACKET 5

/** How bright a light makes the sample: shares of the range per second, each of the brightest colour. */
typedef struct weft_light_level {
    double high;   /* 99.9 % of the photosites lie at or below */
    double top;    /* 99.99 %: highlights that the exposure for `high` lets clip */
    double middle; /* half of them */
} weft_light_level;

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

/**
 * Measures the level of one pattern.
 *
 * @param try_s  in: where to begin (0: 10 ms); out: the exposure at which it was measured
 * @return as weft_auto_exposure()
 */
weft_err weft_light_level_measure(weft_shooter *shooter, uint32_t pattern, double gain, double *try_s,
                                  weft_light_level *level, weft_error *err);

/** The level that one frame shows; of a frame that clips it is too low. */
weft_light_level weft_light_level_of(const weft_frame_stats *stats, double exposure_s);

/** The exposure that suits a level, two significant digits, at most WEFT_AUTO_EXPOSURE_MAX_S. */
double weft_light_level_exposure(const weft_light_level *level);

/**
 * How many exposures, WEFT_CAPTURE_BRACKET_FACTOR apart around `exposure_s`, hold both ends: shorter ones
 * until the highlights (`top`) are below 95 % of the range, longer ones until half of the sample is above
 * 10 %; two of either at the most.
 *
 * @return 1 (no bracket needed) to 5; an even number has one more above than below
 */
int weft_light_level_bracket(const weft_light_level *level, double exposure_s);

#endif
