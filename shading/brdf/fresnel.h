/** Fresnel terms.  `u` is the cosine l.h = v.h, 0..1; `f0` the reflectance at normal incidence, 0..1. */
#ifndef WEFT_SHADING_BRDF_FRESNEL_H
#define WEFT_SHADING_BRDF_FRESNEL_H

#include "shading/brdf/exp_negative.h"
#include "shading/brdf/real.h"

/** m^5 with m = 1 - u: the weight of the grazing end in Schlick's form.  Half vectors have m with all its
 *  digits (half_vector.h). */
WEFT_INLINE weft_real weft_schlick_power(weft_real m)
{
    const weft_real m2 = m * m;
    return m2 * m2 * m;
}

/** The same of the cosine. */
WEFT_INLINE weft_real weft_schlick_weight(weft_real u)
{
    return weft_schlick_power(1 - u);
}

/** 1 - (1 - u)^5 by its polynomial, which keeps its digits for small u. */
WEFT_INLINE weft_real weft_schlick_rest(weft_real u)
{
    return u * (5 + u * (-10 + u * (10 + u * (-5 + u))));
}

/** F = F0 + (1 - F0)(1 - u)^5.  Source: Schlick 1994; S-ORD-01. */
WEFT_INLINE weft_real weft_fresnel_schlick(weft_real f0, weft_real u)
{
    return f0 + (1 - f0) * weft_schlick_weight(u);
}

/** Weight of the grazing end in Karis's form: 2^((-5.55473 u - 6.98316) u). */
WEFT_INLINE weft_real weft_gauss_weight_ue4(weft_real u)
{
    return weft_exp_negative(WEFT_LN2 * (-WEFT_R(5.55473) * u - WEFT_R(6.98316)) * u);
}

/** F = F0 + (1 - F0) 2^((-5.55473 u - 6.98316) u).  Source: Karis 2013 eq. 5; S-UE4-05. */
WEFT_INLINE weft_real weft_fresnel_gauss_ue4(weft_real f0, weft_real u)
{
    return f0 + (1 - f0) * weft_gauss_weight_ue4(u);
}

/** F = F0 + (1 - F0) e^(-6 u).  Source: Far Cry 3; S-FC3-11. */
WEFT_INLINE weft_real weft_fresnel_gauss_fc3(weft_real f0, weft_real u)
{
    return f0 + (1 - f0) * weft_exp_negative(-6 * u);
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
WEFT_INLINE weft_real weft_fresnel_exact(weft_real f0, weft_real u)
{
    const weft_real inner = f0 > 0 ? (f0 < 1 ? f0 : WEFT_R(0.5)) : WEFT_R(0.5), root = weft_sqrt(inner);
    const weft_real gap = (1 - inner) / (1 + root);         /* 1 - root */
    const weft_real m = 4 * root / (gap * gap), n2 = 1 + m; /* n^2 - 1 and n^2 */
    const weft_real t = weft_sqrt(m + u * u), ut = u + t;
    const weft_real s = m / (ut * ut);                          /* (t - u)/(t + u) */
    const weft_real p = m * (1 - u * ut) / (ut * (t + n2 * u)); /* (t - n^2 u)/(t + n^2 u) */
    const weft_real f = WEFT_R(0.5) * (s * s + p * p);
    return f0 > 0 ? (f0 < 1 ? f : 1) : 0;
}

#endif
