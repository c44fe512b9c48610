/** Fresnel terms.  `u` is the cosine l.h = v.h, 0..1; `f0` the reflectance at normal incidence, 0..1. */
#ifndef WEFT_SHADING_BRDF_FRESNEL_H
#define WEFT_SHADING_BRDF_FRESNEL_H

#include <math.h>

/** (1 - u)^5, the weight of the grazing end in Schlick's form. */
static inline double weft_schlick_weight(double u)
{
    const double m = 1 - u, m2 = m * m;
    return m2 * m2 * m;
}

/** F = F0 + (1 - F0)(1 - u)^5.  Source: Schlick 1994; S-ORD-01. */
static inline double weft_fresnel_schlick(double f0, double u)
{
    return f0 + (1 - f0) * weft_schlick_weight(u);
}

/** F = F0 + (1 - F0) 2^((-5.55473 u - 6.98316) u).  Source: Karis 2013 eq. 5; S-UE4-05. */
static inline double weft_fresnel_gauss_ue4(double f0, double u)
{
    return f0 + (1 - f0) * exp2((-5.55473 * u - 6.98316) * u);
}

/** F = F0 + (1 - F0) e^(-6 u).  Source: Far Cry 3; S-FC3-11. */
static inline double weft_fresnel_gauss_fc3(double f0, double u)
{
    return f0 + (1 - f0) * exp(-6 * u);
}

/**
 * Unpolarised reflectance of a dielectric whose index follows from f0 (S-BLG-04).
 *
 *     n = (1 + sqrt F0)/(1 - sqrt F0),   F = ((u - t)/(u + t))^2/2 + ((t - n^2 u)/(t + n^2 u))^2/2,
 *     t = sqrt(n^2 - 1 + u^2)
 *
 * The two squares are those of the s and p polarisation.  f0 = 0 gives 0 at every angle (no interface),
 * f0 = 1 gives 1.
 */
static inline double weft_fresnel_exact(double f0, double u)
{
    const double root = sqrt(f0);
    if (f0 <= 0 || f0 >= 1)
        return f0 <= 0 ? 0 : 1;
    const double n = (1 + root) / (1 - root), n2 = n * n;
    const double n2_minus_1 = 4 * root / ((1 - root) * (1 - root)); /* without cancellation for small f0 */
    const double t = sqrt(n2_minus_1 + u * u);
    const double s = n2_minus_1 / ((u + t) * (u + t)); /* (t - u)/(t + u) */
    const double p = (t - n2 * u) / (t + n2 * u);
    return 0.5 * (s * s + p * p);
}

#endif
