/** Terms of the "Charlie" sheen of Estevez and Kulla 2017 (Production Friendly Microfacet Sheen BRDF). */
#ifndef WEFT_SHADING_BRDF_CHARLIE_H
#define WEFT_SHADING_BRDF_CHARLIE_H

#include "shading/brdf/half_vector.h"
#include "shading/brdf/log_positive.h"

/**
 * Distribution, in 1/sr; the integral of D (n.h) over the hemisphere is 1.
 *
 *     D = (2 + 1/alpha) sin(theta_h)^(1/alpha) / (2 pi)
 *
 * @param s2     sin^2(theta_h) = 1 - nh^2; 0 gives 0 (below 1e-150)
 * @param alpha  0 < alpha <= 1; 1 is the widest rim
 * Source: Estevez and Kulla 2017 eq. 2.
 */
WEFT_INLINE weft_real weft_charlie_d(weft_real s2, weft_real alpha)
{
    const weft_real sine = weft_exp_negative(WEFT_R(0.5) / alpha * weft_log_positive(s2));
    return (2 + 1 / alpha) * sine / (2 * WEFT_PI);
}

/** The fit a/(1 + b x^c) + d x + e to ln Lambda, its five numbers between those of alpha 0 and 1. */
WEFT_INLINE weft_real weft_charlie_fit(weft_real x, weft_real alpha)
{
    const weft_real t = (1 - alpha) * (1 - alpha);
    const weft_real a = weft_mix(WEFT_R(21.5473), WEFT_R(25.3245), t);
    const weft_real b = weft_mix(WEFT_R(3.82987), WEFT_R(3.32435), t);
    const weft_real c = weft_mix(WEFT_R(0.19823), WEFT_R(0.16801), t);
    const weft_real d = weft_mix(WEFT_R(-1.97760), WEFT_R(-1.27393), t);
    const weft_real e = weft_mix(WEFT_R(-4.32054), WEFT_R(-4.85967), t);
    return a / (1 + b * weft_exp_negative(c * weft_log_positive(x))) + d * x + e;
}

/** Smith's Lambda of a cosine 0..1, by the paper's fit; mirrored about 1/2 so that it falls to the normal.
 *  Source: Estevez and Kulla 2017 eqs. 3, 4. */
WEFT_INLINE weft_real weft_charlie_lambda(weft_real cosine, weft_real alpha)
{
    /* without branches: the middle, and above or below it what the mirrored cosine has below or above */
    const weft_real middle = weft_charlie_fit(WEFT_R(0.5), alpha);
    const weft_real below = cosine < WEFT_R(0.5) ? cosine : 1 - cosine;
    const weft_real fit = weft_charlie_fit(below, alpha);
    return weft_exp_negative(cosine < WEFT_R(0.5) ? fit : 2 * middle - fit);
}

/** G/(4 nl nv), G = 1/(1 + Lambda(nl) + Lambda(nv)): height-correlated, without the paper's softening of the
 *  terminator (which is not reciprocal). */
WEFT_INLINE weft_real weft_charlie_v(weft_real nl, weft_real nv, weft_real alpha)
{
    return 1 / ((1 + weft_charlie_lambda(nl, alpha) + weft_charlie_lambda(nv, alpha)) * 4 * nl * nv);
}

#endif
