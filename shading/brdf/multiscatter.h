/** Diffuse light that scattered on several facets: Call of Duty: WWII's fit (S-COD-22 to S-COD-24). */
#ifndef WEFT_SHADING_BRDF_MULTISCATTER_H
#define WEFT_SHADING_BRDF_MULTISCATTER_H

#include "shading/brdf/exp_negative.h"
#include "shading/brdf/fresnel.h"
#include "shading/brdf/half_vector.h"

/** The parts of the fit, each without unit. */
typedef struct weft_multiscatter {
    weft_real rough;  /* f0 = lh + (1 - lh)^5, the smooth part of a rough surface */
    weft_real smooth; /* f1 = (1 - 3/4 (1-nl)^5)(1 - 3/4 (1-nv)^5) */
    weft_real share;  /* t = clamp(2.2 g - 0.5), between the two */
    weft_real base;   /* fd = f0 + (f1 - f0) t */
    weft_real bump;   /* fb, the ridge of retro-reflection; below 0 for 0.710 < g < 1 */
} weft_multiscatter;

/**
 * f = rho/pi (fd + fb), at least 0, with
 *
 *     fb = (34.5 g^2 - 59 g + 24.5) lh 2^(-max(73.2 g - 21.2, 8.9) sqrt(nh))
 *
 * The root over n.h is lost in the printed text; against the slice of S-COD-22 it leaves 8 % (median), the
 * plain cosine 34 %.  A fit to random walks on GGX whose facets are Lambertian below a coat of F0 = 0.04:
 * not to be multiplied by 1 - F again, and not for metals.
 *
 * @param gloss  0..1 of S-COD-01; all cosines 0..1
 * Source: Chan 2018 (Material Advances in Call of Duty: WWII) pages 90-94; S-COD-23.
 */
WEFT_INLINE weft_multiscatter weft_multiscatter_of(weft_real nl, weft_real nv, weft_real nh, weft_real lh,
                                                   weft_real gloss)
{
    const weft_real t = WEFT_R(2.2) * gloss - WEFT_R(0.5),
                    slope = weft_max(WEFT_R(73.2) * gloss - WEFT_R(21.2), WEFT_R(8.9));
    weft_multiscatter m;
    m.rough = lh + weft_schlick_weight(lh);
    m.smooth = (1 - WEFT_R(0.75) * weft_schlick_weight(nl)) * (1 - WEFT_R(0.75) * weft_schlick_weight(nv));
    m.share = t > 0 ? (t < 1 ? t : 1) : 0;
    m.base = weft_mix(m.rough, m.smooth, m.share);
    /* the parabola by its roots, 1 and 49/69 */
    m.bump = (1 - gloss) * (WEFT_R(24.5) - WEFT_R(34.5) * gloss) * lh *
             weft_exp_negative(-WEFT_LN2 * slope * weft_sqrt(nh));
    return m;
}

/** f of reflectance 1, in 1/sr, at least 0: the sum is below 0 (to -0.074) near both horizons around
 *  g = 0.84. */
WEFT_INLINE weft_real weft_multiscatter_f(const weft_multiscatter *m)
{
    return weft_max(m->base + m->bump, 0) * (1 / WEFT_PI);
}

/**
 * The measured slice at gloss 0 that the fit approximates, in 1/sr for reflectance 1, by a rational function
 * of x = n.h and y = l.h.  Grows like a pole towards x = 0, y = 1.
 * Source: the same, page 89, with the order of its factors restored; S-COD-22.
 */
WEFT_INLINE weft_real weft_multiscatter_slice(weft_real x, weft_real y)
{
    const weft_real above = WEFT_R(0.568) - WEFT_R(0.692) * x - WEFT_R(0.938) * y + WEFT_R(1.326) * x * x +
                            WEFT_R(0.301) * y * y + WEFT_R(1.96) * x * y - WEFT_R(0.98) * x * x * x +
                            WEFT_R(1.533) * y * y * y;
    const weft_real below = 1 + WEFT_R(1.731) * x - WEFT_R(0.997) * y - WEFT_R(0.998) * x * x -
                            WEFT_R(0.843) * y * y + WEFT_R(9.905) * x * y - WEFT_R(0.971) * x * x * x +
                            WEFT_R(0.948) * y * y * y;
    return above / below;
}

#endif
