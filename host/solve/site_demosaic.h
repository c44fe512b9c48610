/** Demosaicing along edges, for the albedo. */
#ifndef WEFT_HOST_SOLVE_SITE_DEMOSAIC_H
#define WEFT_HOST_SOLVE_SITE_DEMOSAIC_H

#include "core/image.h"

/**
 * Three planes of a white-balanced mosaic by colour differences that are averaged along, not across, edges.
 *
 * Where dyed and undyed yarns meet, the filters of Malvar, He and Cutler mix the two materials and give
 * colours that neither has.  Green comes from four directions, each counting by the inverse square of how
 * much the difference of green and the site's colour changes along it (Pekkucuksen and Altunbasak, "Gradient
 * based threshold free color filter array interpolation", ICIP 2010, without its second pass).  Red and blue
 * come from the differences of the sites within two pixels, those whose green is alike counting most: a
 * neighbour of another material has another green.
 *
 * @param mosaic  one plane, at least 10 x 10 pixels, finite
 * @param rgb     gets three planes of the same size; each site keeps its own value
 * @return WEFT_ERR_RANGE for a smaller mosaic, WEFT_ERR_NOMEM
 */
weft_err weft_site_demosaic(const weft_image *mosaic, weft_cfa cfa, weft_image *rgb, weft_error *err);

/** Told of every part of a row of `rgb` as it is made: `n` pixels from column `first` on, still in the cache.
 *  From any thread. */
typedef void weft_site_done_fn(void *context, int row, int first, int n);

/** As above into planes that there are; `mosaic` is of a size that weft_site_require_size() allows.
 *  @param done  NULL: nobody wants to know */
void weft_site_demosaic_into(const weft_image *mosaic, weft_cfa cfa, weft_image *rgb, weft_site_done_fn *done,
                             void *context);

/** @return WEFT_ERR_RANGE for a mosaic that is too small */
weft_err weft_site_require_size(int width, int height, weft_error *err);

#endif
