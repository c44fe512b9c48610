/** The set's mask at the pixels that are solved. */
#ifndef WEFT_HOST_SOLVE_SOLVE_MASK_H
#define WEFT_HOST_SOLVE_SOLVE_MASK_H

#include "core/image.h"
#include "host/set/set.h"

/**
 * Reads the mask of a set; its data stays NULL where the set has none: everything is inside.
 *
 * @param half  a pixel for each 2x2 cell, inside when its four sites are
 * @param mask  {0}; free with weft_mask_fini(), after a failure too
 * @return WEFT_ERR_MISMATCH for a mask of another size than the frames
 */
weft_err weft_solve_load_mask(const weft_set *set, bool half, weft_mask *mask, weft_error *err);

#endif
