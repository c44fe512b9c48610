/** Terms of the GGX microfacet model (S-ORD-02 to S-ORD-07).  `alpha` is the width, 0 < alpha <= 1. */
#ifndef WEFT_SHADING_BRDF_GGX_H
#define WEFT_SHADING_BRDF_GGX_H

#include "shading/brdf/half_vector.h"

/**
 * GGX normal distribution, in 1/sr; the integral of D (n.h) over the hemisphere is 1.
 *
 *     D = alpha^2 / (pi (alpha^2 nh^2 + s2)^2),   s2 = 1 - nh^2
 *
 * @param nh  n.h, 0..1
 * @param s2  1 - nh^2, which the caller has without cancellation (half.h); the textbook form
 *            nh^2 (alpha^2 - 1) + 1 loses six digits near nh = 1 at alpha = 1e-3
 * Source: Walter et al. 2007 eq. 33; S-ORD-02, S-CNV-02.
 */
WEFT_INLINE weft_real weft_ggx_d(weft_real nh, weft_real s2, weft_real alpha)
{
    const weft_real a2 = alpha * alpha, t = a2 * nh * nh + s2;
    return a2 / (WEFT_PI * t * t);
}

/**
 * Smith masking in the form that holds its share of 1/(4 nl nv): G1(nl) G1(nv)/(4 nl nv) = V1(nl) V1(nv).
 *
 *     V1(x) = 1 / (x + sqrt(alpha^2 + (1 - alpha^2) x^2)),   x = n.l or n.v, 0..1
 *
 * V1(0) = 1/alpha, V1(1) = 1/2.  Source: S-ORD-04 (the Order's GGX_V1).
 */
WEFT_INLINE weft_real weft_ggx_v1(weft_real x, weft_real alpha)
{
    const weft_real a2 = alpha * alpha;
    return 1 / (x + weft_sqrt(a2 + (1 - a2) * x * x));
}

/** Smith masking, 0..1: G1 = 2 x V1(x).  Source: S-ORD-03. */
WEFT_INLINE weft_real weft_ggx_g1(weft_real x, weft_real alpha)
{
    return 2 * x * weft_ggx_v1(x, alpha);
}

/**
 * Height-correlated Smith masking in place of V1(nl) V1(nv), the 1/4 inside.
 *
 *     V = 1/2 / (nl sqrt(alpha^2 + (1 - alpha^2) nv^2) + nv sqrt(alpha^2 + (1 - alpha^2) nl^2))
 *
 * Source: Heitz 2014 eq. 99; used to compare (S-ORD-05 uses the separable form).
 */
WEFT_INLINE weft_real weft_ggx_v_correlated(weft_real nl, weft_real nv, weft_real alpha)
{
    const weft_real a2 = alpha * alpha;
    return WEFT_R(0.5) / (nl * weft_sqrt(a2 + (1 - a2) * nv * nv) + nv * weft_sqrt(a2 + (1 - a2) * nl * nl));
}

/** Widths of the Order's anisotropy, 0..1: along the tangent alpha, along the bitangent
 *  alpha (1 - anisotropy), not below `floor`.  Source: S-ORD-06. */
WEFT_INLINE weft_real weft_ggx_alpha_b(weft_real alpha, weft_real anisotropy, weft_real floor)
{
    return weft_max(alpha * (1 - anisotropy), floor);
}

/**
 * Anisotropic GGX of a unit half vector (hx along the tangent).
 *
 *     D = 1 / (pi at ab [(hx/at)^2 + (hy/ab)^2 + hz^2]^2)
 *
 * Source: S-ORD-07.
 */
WEFT_INLINE weft_real weft_ggx_d_aniso(weft_real hx, weft_real hy, weft_real hz, weft_real at, weft_real ab)
{
    const weft_real x = hx / at, y = hy / ab, t = x * x + y * y + hz * hz;
    return 1 / (WEFT_PI * at * ab * t * t);
}

/**
 * Its masking, separable: V1(d) = 1/(dz + sqrt((at dx)^2 + (ab dy)^2 + dz^2)); equals weft_ggx_v1() for
 * at = ab.  `dz` may be the raised cosine while dx, dy are those of the true direction.
 * Source: S-ORD-07 (the seed prints no shadowing).
 */
WEFT_INLINE weft_real weft_ggx_v1_aniso(weft_real dx, weft_real dy, weft_real dz, weft_real at, weft_real ab)
{
    const weft_real x = at * dx, y = ab * dy;
    return 1 / (dz + weft_sqrt(x * x + y * y + dz * dz));
}

#endif
