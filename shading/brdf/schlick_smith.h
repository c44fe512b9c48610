/** Schlick's rational approximation of Smith masking: one function, five choices of k. */
#ifndef WEFT_SHADING_BRDF_SCHLICK_SMITH_H
#define WEFT_SHADING_BRDF_SCHLICK_SMITH_H

#include "shading/brdf/real.h"

/**
 * Masking that holds its share of 1/(nl nv): V1(x) = 1/(x (1 - k) + k), x = n.l or n.v.
 *
 * V1(1) = 1, V1(0) = 1/k.  The whole V = V1(nl) V1(nv) is G/(nl nv): divide by 4 (S-CNV-03).
 * Source: Schlick 1994; S-UE4-04, S-FC3-12.
 */
WEFT_INLINE weft_real weft_schlick_v1(weft_real x, weft_real k)
{
    return 1 / (x * (1 - k) + k);
}

/** G1(x) = x V1(x), 0..1. */
WEFT_INLINE weft_real weft_schlick_g1(weft_real x, weft_real k)
{
    return x * weft_schlick_v1(x, k);
}

/** k of Unreal's analytic lights: (roughness + 1)^2/8, not for image light, which it darkens at grazing
 *  angles.  Source: Karis 2013 eq. 4; S-UE4-04. */
WEFT_INLINE weft_real weft_schlick_k_unreal(weft_real roughness)
{
    return (roughness + 1) * (roughness + 1) / 8;
}

/** k that comes near to GGX: alpha/2; exact at alpha = 1, off by 0.14 at alpha 0.1.  Source: S-UE4-04. */
WEFT_INLINE weft_real weft_schlick_k_ggx(weft_real alpha)
{
    return alpha / 2;
}

/** k that comes near to Beckmann: alpha sqrt(2/pi).  Source: Schlick 1994; S-BLG-04. */
WEFT_INLINE weft_real weft_schlick_k_beckmann(weft_real alpha)
{
    return alpha * WEFT_R(0.79788456080286535588);
}

/** The same from a Blinn-Phong power m through alpha^2 = 2/(m + 2): 1/sqrt(pi m/4 + pi/2).
 *  Source: S-FC3-12 (its letter is a). */
WEFT_INLINE weft_real weft_schlick_k_power(weft_real power)
{
    return 1 / weft_sqrt(WEFT_R(0.78539816339744830962) * power + WEFT_R(1.57079632679489661923));
}

#endif
