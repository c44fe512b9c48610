/**
 * Microfacet terms to swap one at a time, f = D F G/(4 nl nv), all of one width alpha so that shapes compare.
 *
 * Source: the list of Karis 2013 (Specular BRDF Reference), to which the blog refers; S-BLG-04.
 */
#ifndef WEFT_SHADING_BRDF_COOK_TORRANCE_H
#define WEFT_SHADING_BRDF_COOK_TORRANCE_H

#include "shading/brdf/half_vector.h"

typedef enum weft_ct_distribution {
    WEFT_CT_D_BLINN_PHONG,
    WEFT_CT_D_BECKMANN,
    WEFT_CT_D_GGX,
    WEFT_CT_D_COUNT
} weft_ct_distribution;

typedef enum weft_ct_masking {
    WEFT_CT_G_IMPLICIT,      /* nl nv: f is D F/4 */
    WEFT_CT_G_NEUMANN,       /* nl nv/max(nl, nv) */
    WEFT_CT_G_COOK_TORRANCE, /* min(1, 2 nh nv/lh, 2 nh nl/lh): V-shaped grooves */
    WEFT_CT_G_KELEMEN,       /* nl nv/lh^2 */
    WEFT_CT_G_SMITH_BECKMANN,
    WEFT_CT_G_SMITH_GGX,
    WEFT_CT_G_SCHLICK_BECKMANN, /* k = alpha sqrt(2/pi) */
    WEFT_CT_G_SCHLICK_GGX,      /* k = alpha/2 */
    WEFT_CT_G_COUNT
} weft_ct_masking;

typedef enum weft_ct_fresnel {
    WEFT_CT_F_NONE, /* F0 */
    WEFT_CT_F_SCHLICK,
    WEFT_CT_F_EXACT, /* unpolarised dielectric whose index follows from F0 */
    WEFT_CT_F_COUNT
} weft_ct_fresnel;

/** D in 1/sr at a half vector. */
double weft_ct_d(weft_ct_distribution which, const weft_half *h, double alpha);

/** G, the full factor to be divided by 4 nl nv; nl > 0, h from weft_half_of(). */
double weft_ct_g(weft_ct_masking which, const weft_half *h, double alpha);

/** F, 0..1. */
double weft_ct_f(weft_ct_fresnel which, double f0, double lh);

#endif
