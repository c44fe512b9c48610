/**
 * How much of each pixel the sample covers: the holes of lace and net over a dark ground.
 */
#ifndef WEFT_HOST_SOLVE_ALPHA_H
#define WEFT_HOST_SOLVE_ALPHA_H

#include "host/set/maps.h"

/**
 * Fills maps->alpha from the albedo: a pixel of luminance Y shows (Y - ground) / (yarn - ground) of the
 * sample, `yarn` being the mean luminance of the closed pixels within a millimetre.
 *
 * Only at holes and their edges: everywhere else alpha is 1, so that dark yarns are not taken for thin ones.
 * A hole is where less than half of a pixel is covered.  0 where the maps have no answer.
 *
 * @param ground  luminous reflectance of what lies under the sample; the sample must be brighter by a factor
 *                of three
 * @return WEFT_ERR_MISSING for maps that are not of the plane, WEFT_ERR_NODATA when nothing is brighter than
 *         the ground, WEFT_ERR_NOMEM
 */
weft_err weft_maps_find_alpha(weft_maps *maps, double ground, weft_error *err);

#endif
