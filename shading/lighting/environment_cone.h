/**
 * The environment BRDF above a cone of occlusion (environment.h) as a table in three dimensions: image light
 * that comes only from n.l above the cone's cosine (Chan 2018 pages 68-71; S-COD-18, S-COD-20).
 *
 * The deck's 32 x 32 x 8 cells with even cosines lose the fall of a glossy lobe between two slices.  Here the
 * third axis follows the lobe (weft_environment_ring_place()), and the second counts n.v where it is near
 * alpha (grazing), where its sine is near alpha (straight on), and in between.
 */
#ifndef WEFT_SHADING_LIGHTING_ENVIRONMENT_CONE_H
#define WEFT_SHADING_LIGHTING_ENVIRONMENT_CONE_H

#include "shading/lighting/environment.h"

#define WEFT_ENVIRONMENT_CONE_ALPHAS 48 /* along the fourth root */
#define WEFT_ENVIRONMENT_CONE_VIEWS  64
#define WEFT_ENVIRONMENT_CONE_PLACES 64 /* of the cone: 0 the whole hemisphere, the last closed */

/** The least alpha looked up; smaller ones are raised to it. */
#define WEFT_ENVIRONMENT_CONE_MIN_ALPHA 1e-3

typedef struct weft_environment_cone_table {
    float share[WEFT_ENVIRONMENT_CONE_ALPHAS][WEFT_ENVIRONMENT_CONE_VIEWS][WEFT_ENVIRONMENT_CONE_PLACES]
               [2]; /* scale, bias */
} weft_environment_cone_table;

/** Fills the table by quadrature over the cores: a third of a second of core time. */
void weft_environment_cone_compute(weft_environment_cone_table *table, weft_environment_lobe lobe);

/** The same from the user's cache, as weft_environment_table_get(). */
void weft_environment_cone_get(weft_environment_cone_table *table, weft_environment_lobe lobe);

/**
 * Tricubic value, within 5e-4 of the integral for alpha from WEFT_ENVIRONMENT_CONE_MIN_ALPHA to 1, n.v from
 * WEFT_ENVIRONMENT_MIN_NV to 1 and every cone; 0 at cone cosine 1.
 */
weft_environment_share weft_environment_cone_at(const weft_environment_cone_table *table, double nv,
                                                double alpha, double cone_cosine);

#endif
