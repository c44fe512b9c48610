/** Terms of Disney's principled model of 2012 (S-BLG-05) that no other model has. */
#ifndef WEFT_SHADING_BRDF_DISNEY_H
#define WEFT_SHADING_BRDF_DISNEY_H

#include "shading/brdf/fresnel.h"
#include "shading/brdf/ggx.h"
#include "shading/brdf/log_positive.h"

/** One factor of the two lobes of retro-reflection: 1 + (f90 - 1)(1 - x)^5 of a cosine x. */
WEFT_INLINE weft_real weft_disney_edge(weft_real f90, weft_real x)
{
    return weft_schlick_rest(x) + f90 * weft_schlick_weight(x);
}

/** Diffuse without 1/pi: Fd90 = 1/2 + 2 lh^2 rough. */
WEFT_INLINE weft_real weft_disney_diffuse(weft_real nl, weft_real nv, weft_real lh, weft_real roughness)
{
    const weft_real f90 = WEFT_R(0.5) + 2 * lh * lh * roughness;
    return weft_disney_edge(f90, nl) * weft_disney_edge(f90, nv);
}

/** The flatter lobe that stands for subsurface light: 5/4 (Fss (1/(nl + nv) - 1/2) + 1/2), nl + nv > 0. */
WEFT_INLINE weft_real weft_disney_subsurface(weft_real nl, weft_real nv, weft_real lh, weft_real roughness)
{
    const weft_real f90 = lh * lh * roughness;
    const weft_real edges = weft_disney_edge(f90, nl) * weft_disney_edge(f90, nv);
    return WEFT_R(1.25) * (edges * (1 / (nl + nv) - WEFT_R(0.5)) + WEFT_R(0.5));
}

/** Clearcoat's distribution, GTR of exponent 1: (a^2 - 1)/(pi ln(a^2) (a^2 nh^2 + s2)), 0 < a < 1. */
WEFT_INLINE weft_real weft_disney_gtr1(weft_real nh, weft_real s2, weft_real a)
{
    const weft_real a2 = a * a;
    return (a2 - 1) / (WEFT_PI * weft_log_positive(a2) * (a2 * nh * nh + s2));
}

/** Widths along tangent and bitangent: aspect = sqrt(1 - 0.9 anisotropic), not below 0.001. */
WEFT_INLINE void weft_disney_widths(weft_real roughness, weft_real anisotropic, weft_real *at, weft_real *ab)
{
    const weft_real alpha = roughness * roughness, aspect = weft_sqrt(1 - WEFT_R(0.9) * anisotropic);
    *at = weft_max(alpha / aspect, WEFT_R(1e-3));
    *ab = weft_max(alpha * aspect, WEFT_R(1e-3));
}

#endif
