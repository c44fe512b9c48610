/** Terms of the "Charlie" sheen of Estevez and Kulla 2017 (Production Friendly Microfacet Sheen BRDF). */
#ifndef WEFT_SHADING_BRDF_CHARLIE_H
#define WEFT_SHADING_BRDF_CHARLIE_H

#include "core/clones.h"
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
WEFT_INLINE double weft_charlie_d(double s2, double alpha)
{
    const double sine = weft_exp_negative(0.5 / alpha * weft_log_positive(s2));
    return (2 + 1 / alpha) * sine / (2 * WEFT_PI);
}

/** The fit a/(1 + b x^c) + d x + e to ln Lambda, its five numbers between those of alpha 0 and 1. */
WEFT_INLINE double weft_charlie_fit(double x, double alpha)
{
    const double t = (1 - alpha) * (1 - alpha);
    const double a = 21.5473 + (25.3245 - 21.5473) * t, b = 3.82987 + (3.32435 - 3.82987) * t;
    const double c = 0.19823 + (0.16801 - 0.19823) * t, d = -1.97760 + (-1.27393 + 1.97760) * t;
    const double e = -4.32054 + (-4.85967 + 4.32054) * t;
    return a / (1 + b * weft_exp_negative(c * weft_log_positive(x))) + d * x + e;
}

/** Smith's Lambda of a cosine 0..1, by the paper's fit; mirrored about 1/2 so that it falls to the normal.
 *  Source: Estevez and Kulla 2017 eqs. 3, 4. */
WEFT_INLINE double weft_charlie_lambda(double cosine, double alpha)
{
    /* without branches: the middle, and above or below it what the mirrored cosine has below or above */
    const double middle = weft_charlie_fit(0.5, alpha);
    const double fit = weft_charlie_fit(0.5 - fabs(cosine - 0.5), alpha);
    return weft_exp_negative(middle + copysign(1, 0.5 - cosine) * (fit - middle));
}

/** G/(4 nl nv), G = 1/(1 + Lambda(nl) + Lambda(nv)): height-correlated, without the paper's softening of the
 *  terminator (which is not reciprocal). */
WEFT_INLINE double weft_charlie_v(double nl, double nv, double alpha)
{
    return 1 / ((1 + weft_charlie_lambda(nl, alpha) + weft_charlie_lambda(nv, alpha)) * 4 * nl * nv);
}

#endif
