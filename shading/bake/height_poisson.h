/**
 * Height in millimetres from a map of normals, by least squares over the whole picture at once.
 *
 * The slopes stand at the middles of texels.  The rise from one texel to the next is the integral of the
 * polynomial through the twelve slopes around the step (fewer at borders), exact to the twelfth order; the
 * height is the surface whose steps are nearest to those rises:
 *
 *     min  sum_e w_e (H(e+) - H(e-) - rise_e)^2,     w_e = the smaller weight of the two texels
 *
 * Equal weights are solved at once by cosine (or, where the picture repeats, Hartley) transforms; others by
 * conjugate gradients with that solution as the preconditioner.
 * Source: Frankot and Chellappa 1988 for the projection onto surfaces; Simchony, Chellappa, Shao 1990 for the
 * cosines; S-COD-10 for the relaxation that height.h has.
 */
#ifndef WEFT_SHADING_BAKE_HEIGHT_POISSON_H
#define WEFT_SHADING_BAKE_HEIGHT_POISSON_H

#include "core/image.h"

/** What was done, for reports. */
typedef struct weft_height_info {
    int rounds;       /* of conjugate gradients; 1: solved at once */
    double misfit;    /* rms of H(e+) - H(e-) - rise, relative to the rms of the rises: what no surface has */
    double relief_mm; /* rms of the height */
} weft_height_info;

/**
 * @param normal     3 planes X (right), Y (up), Z (out), any length above 0; (0, 0, 0) or not finite:
 * unknown, bridged smoothly
 * @param weight     [h][w] >= 0, or NULL for equal ones; texels of weight 0 are bridged
 * @param mm_per_px  > 0
 * @param periodic   whether the picture repeats in both directions
 * @param height     1 plane, mm, mean 0; initialised here
 * @param info       may be NULL
 * @return WEFT_ERR_NODATA when no texel is known, WEFT_ERR_NOMEM
 */
weft_err weft_height_integrate(const weft_image *normal, const float *weight, double mm_per_px, bool periodic,
                               weft_image *height, weft_height_info *info, weft_error *err);

#endif
