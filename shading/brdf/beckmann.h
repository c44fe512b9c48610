/** Terms of the Beckmann microfacet model (S-ORD-24).  `alpha` is the width, 0 < alpha <= 1. */
#ifndef WEFT_SHADING_BRDF_BECKMANN_H
#define WEFT_SHADING_BRDF_BECKMANN_H

#include "shading/brdf/exp_negative.h"
#include "shading/brdf/real.h"

/**
 * Beckmann normal distribution, in 1/sr; the integral of D (n.h) over the hemisphere is 1.
 *
 *     D = exp(-s2/(alpha^2 nh^2)) / (pi alpha^2 nh^4),   s2 = 1 - nh^2 without cancellation (half.h)
 *
 * nh below 0.01 gives 0, for the exponential has won (it is below e^-9999 for every alpha).  Source: The
 * Order, appendix A; S-ORD-24, S-CNV-02.
 */
WEFT_INLINE weft_real weft_beckmann_d(weft_real nh, weft_real s2, weft_real alpha)
{
    const weft_real n2 = nh > WEFT_R(0.01) ? nh * nh : 1, a2 = alpha * alpha;
    const weft_real d = weft_exp_negative(-s2 / (a2 * n2)) / (WEFT_PI * a2 * n2 * n2);
    return nh > WEFT_R(0.01) ? d : 0;
}

/**
 * Smith masking of Beckmann by a rational fit, divided by its cosine: V1 = G1/x, G1 0..1.0001.
 *
 *     a = x/(alpha sqrt(1 - x^2)),   G1 = (3.535 a + 2.181 a^2)/(1 + 2.276 a + 2.577 a^2), a < 1.6; else 1
 *
 * Within 0.0031 of the exact form; just below a = 1.6 the fit is up to 1.000057, kept as printed, for the
 * reference tables keep it too.  G1(1) = 1.  @param x  above 0
 * Source: Walter et al. 2007; S-ORD-24.
 */
WEFT_INLINE weft_real weft_beckmann_v1(weft_real x, weft_real alpha)
{
    const weft_real s2 = weft_max((1 - x) * (1 + x), WEFT_R(1e-12)); /* below it a is far above 1.6 */
    const weft_real k = 1 / (alpha * weft_sqrt(s2)), a = k * x, whole = 1 / x;
    const weft_real fit =
        k * (WEFT_R(3.535) + WEFT_R(2.181) * a) / (1 + (WEFT_R(2.276) + WEFT_R(2.577) * a) * a);
    return a < WEFT_R(1.6) ? fit : whole;
}

/** The masking itself, G1 = x V1(x), x > 0. */
WEFT_INLINE weft_real weft_beckmann_g1(weft_real x, weft_real alpha)
{
    return x * weft_beckmann_v1(x, alpha);
}

#endif
