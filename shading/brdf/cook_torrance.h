/**
 * Microfacet terms to swap one at a time, f = D F G/(4 nl nv), all of one width alpha so that shapes compare.
 *
 * Source: the list of Karis 2013 (Specular BRDF Reference), to which the blog refers; S-BLG-04.
 */
#ifndef WEFT_SHADING_BRDF_COOK_TORRANCE_H
#define WEFT_SHADING_BRDF_COOK_TORRANCE_H

#include "shading/brdf/beckmann.h"
#include "shading/brdf/blinn_phong.h"
#include "shading/brdf/fresnel.h"
#include "shading/brdf/ggx.h"
#include "shading/brdf/schlick_smith.h"

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

/*
 * The choices are numbers, as any other parameter, of which the nearest counts.  All terms of a kind are
 * computed and one is taken, so that loops become vector code.
 */

/** D in 1/sr at a half vector. */
WEFT_INLINE weft_real weft_ct_d(weft_real which, const weft_half *h, weft_real alpha)
{
    const weft_real blinn = weft_blinn_phong_d(h->nh, h->s2, weft_blinn_phong_power_of_alpha(alpha));
    const weft_real beckmann = weft_beckmann_d(h->nh, h->s2, alpha), ggx = weft_ggx_d(h->nh, h->s2, alpha);
    const weft_real soft = which < WEFT_R(1.5) ? beckmann : ggx;
    return which < WEFT_R(0.5) ? blinn : soft;
}

/** V = G/(nl nv), to be divided by 4; h from weft_half_of(). */
WEFT_INLINE weft_real weft_ct_v(weft_real which, const weft_half *h, weft_real alpha)
{
    const weft_real nl = h->lit, nv = h->nv, larger = weft_max(nl, nv), lh = weft_max(h->lh, WEFT_R(1e-15));
    const weft_real kb = weft_schlick_k_beckmann(alpha), kg = weft_schlick_k_ggx(alpha);
    const weft_real open = 1 / (nl * nv), groove = 2 * h->nh / (lh * larger);
    weft_real v = weft_schlick_v1(nl, kg) * weft_schlick_v1(nv, kg);
    v = which < WEFT_R(6.5) ? weft_schlick_v1(nl, kb) * weft_schlick_v1(nv, kb) : v;
    v = which < WEFT_R(5.5) ? 4 * weft_ggx_v1(nl, alpha) * weft_ggx_v1(nv, alpha) : v;
    v = which < WEFT_R(4.5) ? weft_beckmann_v1(nl, alpha) * weft_beckmann_v1(nv, alpha) : v;
    v = which < WEFT_R(3.5) ? 1 / (lh * lh) : v;
    v = which < WEFT_R(2.5) ? (groove < open ? groove : open) : v;
    v = which < WEFT_R(1.5) ? 1 / larger : v;
    return which < WEFT_R(0.5) ? 1 : v;
}

/** F, 0..1, of a half vector's cosine. */
WEFT_INLINE weft_real weft_ct_f(weft_real which, weft_real f0, const weft_half *h)
{
    const weft_real schlick = f0 + (1 - f0) * weft_schlick_power(h->grazing);
    const weft_real coat = which < WEFT_R(1.5) ? schlick : weft_fresnel_exact(f0, h->lh);
    return which < WEFT_R(0.5) ? f0 : coat;
}

#endif
