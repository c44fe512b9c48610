/** Seams between a dark and a light yarn: what their pixels' normals may be off by, which no residual tells.
 */
#ifndef WEFT_HOST_SOLVE_SEAMS_H
#define WEFT_HOST_SOLVE_SEAMS_H

#include "host/set/maps.h"

/**
 * Adds to maps->uncertainty what a pixel's normal may be off by where albedo and normal change together.
 *
 * Two surfaces in one pixel put the mean of their normals, weighted by their albedos, on the sensor under
 * every light: it fits one normal exactly, and is not the mean over the area.  How far the two means of the
 * 3 x 3 pixels around are apart, d = |sum a n / sum a - sum n / 9|, tells what that may be in the middle one:
 * over all places and directions of a straight seam the rms of d is that of the middle pixel's error within
 * 10 %, whatever the contrast (tests/host/check_seams.c).  d^2 is added to the square of the error.
 *
 * @param maps  at the sensor's pixels, all maps made; a pixel without an answer stays at 0 and has no say.
 *              `a` is the luminance of the albedo, in whatever colours it is.
 */
void weft_seams_doubt(weft_maps *maps);

#endif
