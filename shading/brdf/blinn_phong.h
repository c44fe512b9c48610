/** Energy-normalised Blinn-Phong, as Far Cry 3 shipped it (S-FC3-09 to S-FC3-13). */
#ifndef WEFT_SHADING_BRDF_BLINN_PHONG_H
#define WEFT_SHADING_BRDF_BLINN_PHONG_H

#include "shading/brdf/log_positive.h"
#include "shading/brdf/schlick_smith.h"

/** Power of a gloss 0..1: m = 2^(13 g), 1..8192.  Source: S-FC3-10. */
WEFT_INLINE weft_real weft_blinn_phong_power(weft_real gloss)
{
    return weft_exp_negative(13 * WEFT_LN2 * gloss);
}

/** Gloss of a power, cut to 0..1; a power of 0 or less gives 0.  Source: S-FC3-14. */
WEFT_INLINE weft_real weft_blinn_phong_gloss(weft_real power)
{
    const weft_real gloss = power > 1 ? weft_log_positive(power) / (13 * WEFT_LN2) : 0;
    return gloss < 1 ? gloss : 1;
}

/** Power whose lobe is as wide as Beckmann's alpha: 2/alpha^2 - 2.  Source: S-BLG-04, S-CNV-04. */
WEFT_INLINE weft_real weft_blinn_phong_power_of_alpha(weft_real alpha)
{
    return 2 / (alpha * alpha) - 2;
}

/** Beckmann's alpha of a power: sqrt(2/(m + 2)). */
WEFT_INLINE weft_real weft_blinn_phong_alpha_of_power(weft_real power)
{
    return weft_sqrt(2 / (power + 2));
}

/**
 * Distribution, in 1/sr; the integral of D (n.h) over the hemisphere is 1.
 *
 *     D = (m + 2)/(2 pi) nh^m
 *
 * The seed prints (n.v)^m, which does not depend on h and integrates to 33 in place of 1 (m 64): h is meant.
 *
 * @param nh,s2  n.h and 1 - nh^2, both without cancellation (half_vector.h); nh^m = (1 - s2)^(m/2)
 * @param power  m >= 0
 * Source: S-FC3-10 (which calls D/4 "D").
 */
WEFT_INLINE weft_real weft_blinn_phong_d(weft_real nh, weft_real s2, weft_real power)
{
    const weft_real log = weft_log_of(s2 < WEFT_R(0.5) ? 1 - s2 : nh * nh, -s2);
    const weft_real log_nh2 = nh > 0 ? log : WEFT_R(-2e4);
    return (power + 2) / (2 * WEFT_PI) * weft_exp_negative(WEFT_R(0.5) * power * log_nh2);
}

/**
 * Mean of the Schlick-Smith visibility over independent cosines of light and view:
 *
 *     avgV = (integral of 1/(u (1-k) + k), u = 0..1)^2 = (-ln k/(1 - k))^2
 *
 * @param k  0 < k < 1; weft_schlick_k_power().  Source: S-FC3-13, with the square the first line leaves out.
 */
WEFT_INLINE weft_real weft_blinn_phong_average_visibility(weft_real k)
{
    const weft_real mean = -weft_log_positive(k) / (1 - k);
    return mean * mean;
}

/** Normalisation with the visibility averaged away: E = (m + 2)/8 avgV; f = E F nh^m/pi.  Twice too strong
 *  at normal view and far too weak at grazing ones.  Source: S-FC3-13. */
WEFT_INLINE weft_real weft_blinn_phong_energy(weft_real power)
{
    return (power + 2) / 8 * weft_blinn_phong_average_visibility(weft_schlick_k_power(power));
}

/** The seed's fit of weft_blinn_phong_energy(): 2^(-1.85689 + 16.1624 g).  Called "extremely accurate"
 *  there; it is half of the truth at g = 0 and within 10 % only above g = 0.5.  Source: S-FC3-13. */
WEFT_INLINE weft_real weft_blinn_phong_energy_fit(weft_real gloss)
{
    return weft_exp_negative(WEFT_LN2 * (WEFT_R(16.1624) * gloss - WEFT_R(1.85689)));
}

/** What was shipped: (2 m + 1)/8, below weft_blinn_phong_energy() everywhere.  Source: S-FC3-13. */
WEFT_INLINE weft_real weft_blinn_phong_energy_shipped(weft_real power)
{
    return (2 * power + 1) / 8;
}

#endif
