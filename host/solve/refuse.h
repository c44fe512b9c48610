/** Input that would give maps that look like maps and mean nothing. */
#ifndef WEFT_HOST_SOLVE_REFUSE_H
#define WEFT_HOST_SOLVE_REFUSE_H

#include "host/solve/light_plates.h"

/** Noise gain of the lights over a level patch, radians per relative error of a sample, above which they lie
 *  too close together: 1 % of noise would be 3 degrees. */
#define WEFT_REFUSE_GAIN 5.0

/** Noise gain of the lights in the middle of the plate for a level patch: sqrt(tr C - z^T C z),
 *  C = (L^T L)^-1; infinite when they lie in a plane.  Ten lights over a dome have 0.9. */
double weft_lights_gain(const weft_calibration *cal, double height_mm);

/** @return WEFT_ERR_RANGE when all lights lie in a narrow cone or in a plane, saying how narrow */
weft_err weft_refuse_cone(const weft_calibration *cal, const char *cal_folder, double height_mm,
                          weft_error *err);

/**
 * Pictures that are gamma-coded and said to be linear: decoded as sRGB they fit a matte surface much better.
 *
 * Looks at blocks all over the sample (`inside`, data NULL: all); only pictures (no mosaics) are suspected.
 * @return WEFT_ERR_FORMAT with the remedy, WEFT_ERR_NOMEM
 */
weft_err weft_refuse_coded(const weft_set *set, const weft_solve_plan *plan, const weft_light_plates *plates,
                           const weft_mask *inside, weft_error *err);

/** @param lights  lights used per pixel
 *  @param inside  pixels that count; data NULL: all
 *  @return WEFT_ERR_NODATA when most of the sample has fewer than four usable lights */
weft_err weft_refuse_few_lights(const weft_set *set, const weft_mask *lights, const weft_mask *inside,
                                weft_error *err);

#endif
