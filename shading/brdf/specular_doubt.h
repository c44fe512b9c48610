/** What is doubtful about an F0 beside a diffuse reflectance: the checks of the specular workflow, which
 *  takes both as they are and can say what no surface does (S-BLG-02). */
#ifndef WEFT_SHADING_BRDF_SPECULAR_DOUBT_H
#define WEFT_SHADING_BRDF_SPECULAR_DOUBT_H

#include "shading/brdf/brdf.h"

#include <stdbool.h>

#define WEFT_F0_DIELECTRIC_LEAST 0.017
#define WEFT_F0_DIELECTRIC_MOST  0.067
#define WEFT_F0_METAL            0.2 /* luminance of F0 above which a surface counts as a metal */

/** Each a bit. */
typedef enum weft_specular_doubt {
    WEFT_DOUBT_COLOURED = 1, /* a dielectric whose channels are more than a tenth of the largest apart */
    WEFT_DOUBT_LOW = 2,      /* a dielectric below 0.017; not of 0, which says that there is no lobe */
    WEFT_DOUBT_HIGH = 4,     /* above 0.067 and no metal */
    WEFT_DOUBT_DIFFUSE = 8,  /* a metal with a diffuse luminance above 0.2 */
} weft_specular_doubt;

/** The doubts about linear colours; 0: none.  A pair that is not a number raises none. */
unsigned weft_specular_doubts(const double diffuse[3], const double f0[3]);

/**
 * Says on stderr what is doubtful about the constants of a model, one line a doubt with the parameter and the
 * remedy.
 *
 * @param known  [weft_brdf_n_planes()] whether values[plane] holds everywhere (no map stands for it); NULL:
 * all
 */
void weft_specular_warn(const weft_brdf *brdf, const double values[WEFT_BRDF_MAX_PLANES], const bool *known);

#endif
