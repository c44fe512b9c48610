/**
 * What is wrong with the cloth itself: creases, lint and tears (weft_flaw; docs/solving.md).
 */
#ifndef WEFT_HOST_SOLVE_FLAWS_H
#define WEFT_HOST_SOLVE_FLAWS_H

#include "host/set/maps.h"

/** Coarser pixels than this show no lint. */
#define WEFT_FLAWS_MAX_MM_PER_PX 0.25

typedef struct weft_flaws_found {
    int n;            /* places */
    double area_mm2;  /* of the pixels flagged */
    double length_mm; /* sum of the diagonals */
} weft_flaws_found;

/**
 * Fills maps->flaws and notes what was found under "result" of maps->info.
 *
 * - Crease: where the slopes, averaged over the weave, change by much across a long line.
 * - Lint: thin long things that are darker or brighter than what is on both sides of them.
 * - Tear: needs maps->alpha.  Holes that are long, and larger than the holes of the cloth's pattern.
 *
 * @param found  [WEFT_N_FLAWS], in the order of the bits; may be NULL
 * @return WEFT_ERR_MISSING for maps that are not of the plane, WEFT_ERR_RANGE for pixels that are too coarse,
 *         WEFT_ERR_NOMEM
 */
weft_err weft_maps_find_flaws(weft_maps *maps, weft_flaws_found *found, weft_error *err);

#endif
