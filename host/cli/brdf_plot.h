/** Plots and proofs of one model for "weft brdf". */
#ifndef WEFT_HOST_CLI_BRDF_PLOT_H
#define WEFT_HOST_CLI_BRDF_PLOT_H

#include "shading/brdf/brdf.h"

#include <stdbool.h>

/**
 * Draws a model to a file.
 *
 * NAME.svg: lobes f (n.l) in the plane of incidence for views at 0, 30, 60 and 80 degrees from the normal,
 * the radius the cube root of the value over the largest (highlights are tens of times brighter than what is
 * around them).  NAME.png: the slice of half-angle coordinates, theta_h 0..90 degrees to the right, theta_d
 * 0..90 upwards, phi_d 90, as a linear picture of pi f (Lambert's albedo is itself), black where a direction
 * is below the surface.
 * @return WEFT_ERR_USAGE for another ending
 */
weft_err weft_brdf_plot(const weft_brdf *brdf, const double values[WEFT_BRDF_MAX_PLANES], const char *path,
                        weft_error *err);

/** Cosines of the views in a row of the furnace. */
#define WEFT_FURNACE_VIEWS 8
extern const double weft_furnace_nv[WEFT_FURNACE_VIEWS];

/** Directional albedo at those views, [view][channel]. */
void weft_brdf_furnace(const weft_brdf *brdf, const double values[WEFT_BRDF_MAX_PLANES],
                       double albedo[WEFT_FURNACE_VIEWS][3]);

/** Largest |f(l, v) - f(v, l)| over the larger of both, over `n` pairs of directions (a fixed sequence over
 *  the upper hemisphere, cosines from 1e-3 on). */
double weft_brdf_reciprocity(const weft_brdf *brdf, const double values[WEFT_BRDF_MAX_PLANES], int n);

#endif
