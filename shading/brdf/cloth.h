/** Terms of the Order's cloth model (S-ORD-14, S-ORD-15). */
#ifndef WEFT_SHADING_BRDF_CLOTH_H
#define WEFT_SHADING_BRDF_CLOTH_H

#include "shading/brdf/exp_negative.h"
#include "shading/brdf/half_vector.h"

/**
 * The rim lobe, an inverted Gaussian: exp(-cot^2(theta_h)/alpha^2)/sin^4(theta_h).
 *
 * @param nh  n.h, 0..1
 * @param s2  1 - nh^2; below 1e-7 the exponential has won and the lobe is 0 (S-CNV-02)
 */
WEFT_INLINE weft_real weft_cloth_rim(weft_real nh, weft_real s2, weft_real alpha)
{
    const weft_real safe = s2 < WEFT_R(1e-7) ? 1 : s2;
    const weft_real rim = weft_exp_negative(-nh * nh / (alpha * alpha * safe)) / (safe * safe);
    return s2 < WEFT_R(1e-7) ? 0 : rim;
}

/**
 * Cloth distribution with a tint for each of its two parts, in 1/sr:
 *
 *     D_2 = (front + tint A rim) / (pi (1 + A alpha^2))
 *
 * @param rim  weft_cloth_rim().  Source: S-ORD-16 (the seed shows two tones and gives no formula).
 */
WEFT_INLINE weft_real weft_cloth_d_tinted(weft_real rim, weft_real front, weft_real tint, weft_real alpha,
                                          weft_real amplitude)
{
    return (front + tint * amplitude * rim) / (WEFT_PI * (1 + amplitude * alpha * alpha));
}

/**
 * Cloth distribution, in 1/sr; the integral of D (n.h) over the hemisphere is 1.
 *
 *     D = (1 + A rim) / (pi (1 + A alpha^2))
 *
 * @param amplitude  A >= 0, the weight of the rim lobe against the constant offset; the Order uses 4
 * D(0) = 1/(pi(1 + A alpha^2)), D(90 deg) = (1 + A)/(pi(1 + A alpha^2)).  Source: S-ORD-14.
 */
WEFT_INLINE weft_real weft_cloth_d(weft_real nh, weft_real s2, weft_real alpha, weft_real amplitude)
{
    return weft_cloth_d_tinted(weft_cloth_rim(nh, s2, alpha), 1, 1, alpha, amplitude);
}

/** 1/(4 (nl + nv - nl nv)) in place of G/(4 nl nv): no shadowing term.  nl, nv > 0.  Source: S-ORD-15. */
WEFT_INLINE weft_real weft_cloth_v(weft_real nl, weft_real nv)
{
    return WEFT_R(0.25) / (nl + nv - nl * nv);
}

#endif
