/** Diffuse light that scattered on several facets: Call of Duty: WWII's fit (S-COD-22 to S-COD-24). */
#ifndef WEFT_SHADING_BRDF_MULTISCATTER_H
#define WEFT_SHADING_BRDF_MULTISCATTER_H

#include "shading/brdf/exp_negative.h"
#include "shading/brdf/fresnel.h"
#include "shading/brdf/half_vector.h"

/** The parts of the fit, each without unit. */
typedef struct weft_multiscatter {
    double rough;  /* f0 = lh + (1 - lh)^5, the smooth part of a rough surface */
    double smooth; /* f1 = (1 - 3/4 (1-nl)^5)(1 - 3/4 (1-nv)^5) */
    double share;  /* t = clamp(2.2 g - 0.5), between the two */
    double base;   /* fd = f0 + (f1 - f0) t */
    double bump;   /* fb, the ridge of retro-reflection; below 0 for 0.710 < g < 1 */
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
static inline weft_multiscatter weft_multiscatter_of(double nl, double nv, double nh, double lh, double gloss)
{
    const double t = 2.2 * gloss - 0.5, slope = weft_max(73.2 * gloss - 21.2, 8.9);
    weft_multiscatter m;
    m.rough = lh + weft_schlick_weight(lh);
    m.smooth = (1 - 0.75 * weft_schlick_weight(nl)) * (1 - 0.75 * weft_schlick_weight(nv));
    m.share = t > 0 ? (t < 1 ? t : 1) : 0;
    m.base = m.rough + (m.smooth - m.rough) * m.share;
    m.bump = (34.5 * gloss * gloss - 59 * gloss + 24.5) * lh *
             weft_exp_negative(-0.69314718055994530942 * slope * sqrt(nh));
    return m;
}

/** f of reflectance 1, in 1/sr, at least 0: the sum is below 0 (to -0.074) near both horizons around
 *  g = 0.84. */
static inline double weft_multiscatter_f(const weft_multiscatter *m)
{
    return weft_max(m->base + m->bump, 0) * (1 / WEFT_PI);
}

/**
 * The measured slice at gloss 0 that the fit approximates, in 1/sr for reflectance 1, by a rational function
 * of x = n.h and y = l.h.  Grows like a pole towards x = 0, y = 1.
 * Source: the same, page 89, with the order of its factors restored; S-COD-22.
 */
static inline double weft_multiscatter_slice(double x, double y)
{
    const double above = 0.568 - 0.692 * x - 0.938 * y + 1.326 * x * x + 0.301 * y * y + 1.96 * x * y -
                         0.98 * x * x * x + 1.533 * y * y * y;
    const double below = 1 + 1.731 * x - 0.997 * y - 0.998 * x * x - 0.843 * y * y + 9.905 * x * y -
                         0.971 * x * x * x + 0.948 * y * y * y;
    return above / below;
}

#endif
