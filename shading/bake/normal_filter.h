/** Normals that are combined or averaged: reoriented detail normals, Toksvig's factor (S-COD-07, S-FC3-14).
 */
#ifndef WEFT_SHADING_BAKE_NORMAL_FILTER_H
#define WEFT_SHADING_BAKE_NORMAL_FILTER_H

#include "shading/brdf/blinn_phong.h"

/**
 * Detail normal d on base normal b (unit, z up): d turned by the shortest arc from z to b.
 *
 *     t = b + (0, 0, 1),   u = d * (-1, -1, 1),   result = t (t.u)/t_z - u
 *
 * A unit vector.  b = (0, 0, -1) has no shortest arc: gives d mirrored, -u.
 * Source: Barre-Brisebois and Hill 2012; S-COD-07.
 */
static inline void weft_normal_reorient(const double b[3], const double d[3], double result[3])
{
    const double t[3] = {b[0], b[1], b[2] + 1}, u[3] = {-d[0], -d[1], d[2]};
    const double along = t[2] > 0 ? (t[0] * u[0] + t[1] * u[1] + t[2] * u[2]) / t[2] : 0;
    for (int c = 0; c < 3; c++)
        result[c] = t[c] * along - u[c];
}

/**
 * Toksvig's factor on a Blinn-Phong power: |n|/(|n| + m (1 - |n|)), n the averaged normal as it is, not
 * normalised and not of 8 bits.  1 for a flat footprint, 0 at length 0; the new power is m times it, which
 * weft_blinn_phong_gloss() cuts.  Source: Toksvig 2005; S-FC3-14.
 */
static inline double weft_toksvig_factor(double length, double power)
{
    const double below = length + power * (1 - length);
    return below > 0 ? length / below : 0;
}

#endif
