/** Terms of the Beckmann microfacet model (S-ORD-24).  `alpha` is the width, 0 < alpha <= 1. */
#ifndef WEFT_SHADING_BRDF_BECKMANN_H
#define WEFT_SHADING_BRDF_BECKMANN_H

#include "shading/brdf/exp_negative.h"

#include <math.h>

/**
 * Beckmann normal distribution, in 1/sr; the integral of D (n.h) over the hemisphere is 1.
 *
 *     D = exp(-s2/(alpha^2 nh^2)) / (pi alpha^2 nh^4),   s2 = 1 - nh^2 without cancellation (half.h)
 *
 * nh = 0 gives 0, for the exponential wins.  Source: The Order, appendix A; S-ORD-24, S-CNV-02.
 */
static inline double weft_beckmann_d(double nh, double s2, double alpha)
{
    const double n2 = nh > 1e-6 ? nh * nh : 1, a2 = alpha * alpha;
    const double d = weft_exp_negative(-s2 / (a2 * n2)) / (3.14159265358979323846 * a2 * n2 * n2);
    return nh > 1e-6 ? d : 0;
}

/**
 * Smith masking of Beckmann by a rational fit, 0..1.0001.
 *
 *     a = x/(alpha sqrt(1 - x^2)),   G1 = (3.535 a + 2.181 a^2)/(1 + 2.276 a + 2.577 a^2), a < 1.6; else 1
 *
 * Within 0.0031 of the exact form; just below a = 1.6 the fit is up to 1.000057, kept as printed, for the
 * reference tables keep it too.  x = 1 gives 1.  Source: Walter et al. 2007; S-ORD-24.
 */
static inline double weft_beckmann_g1(double x, double alpha)
{
    const double s2 = (1 - x) * (1 + x);
    const double a = x / (alpha * sqrt(s2 > 0 ? s2 : 1));
    const double fit = (3.535 * a + 2.181 * a * a) / (1 + 2.276 * a + 2.577 * a * a);
    return s2 > 0 && a < 1.6 ? fit : 1;
}

#endif
