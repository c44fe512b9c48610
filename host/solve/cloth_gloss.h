/** Finds the mirror light of the cloth in a set (cloth_lobe.h), from blocks all over the picture. */
#ifndef WEFT_HOST_SOLVE_CLOTH_GLOSS_H
#define WEFT_HOST_SOLVE_CLOTH_GLOSS_H

#include "host/solve/cloth_lobe.h"
#include "host/solve/light_plates.h"

/**
 * @param inside  solved pixels that are the sample; data NULL: all
 * @param gloss   written when report->found
 * @return WEFT_ERR_NOMEM
 */
weft_err weft_cloth_gloss(const weft_solve_plan *plan, const weft_light_plates *plates,
                          const weft_mask *inside, weft_gloss *gloss, weft_gloss_report *report,
                          weft_error *err);

#endif
