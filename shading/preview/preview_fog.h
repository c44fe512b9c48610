/**
 * Light in the air before the sample (S-BLG-08): marched at half size from a dithered start, blurred by
 * depth, and brought to full size with the weights of depth (S-BLG-09).
 *
 * The air fills a box: from one half width before the middle of the shape to one behind it, over a plane half
 * its shorter side high.  It scatters light once and takes none away for good:
 *
 *     L = sum over lamps of integral of sigma p(c) E(x) lit(x) e^(-sigma s) ds,   picture' = e^(-sigma s)
 * picture + L
 *
 * p by Henyey and Greenstein.  The shapes throw their shadows into it (the drape through its voxels), the
 * relief does not, nor do the surroundings shine into it.
 */
#ifndef WEFT_SHADING_PREVIEW_FOG_H
#define WEFT_SHADING_PREVIEW_FOG_H

#include "shading/preview/preview_samples.h"

/** Puts the view's fog before a finished picture. */
weft_err weft_preview_add_fog(const weft_preview_setup *setup, weft_image *picture, weft_error *err);

#endif
