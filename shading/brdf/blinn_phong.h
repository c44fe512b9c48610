/** Energy-normalised Blinn-Phong, as Far Cry 3 shipped it (S-FC3-09 to S-FC3-13). */
#ifndef WEFT_SHADING_BRDF_BLINN_PHONG_H
#define WEFT_SHADING_BRDF_BLINN_PHONG_H

#include "shading/brdf/log_positive.h"
#include "shading/brdf/schlick_smith.h"

/** Power of a gloss 0..1: m = 2^(13 g), 1..8192.  Source: S-FC3-10. */
static inline double weft_blinn_phong_power(double gloss)
{
    return weft_exp_negative(13 * 0.69314718055994530942 * gloss);
}

/** Gloss of a power, cut to 0..1; a power of 0 or less gives 0.  Source: S-FC3-14. */
static inline double weft_blinn_phong_gloss(double power)
{
    const double gloss = power > 1 ? log2(power) / 13 : 0;
    return gloss < 1 ? gloss : 1;
}

/** Power whose lobe is as wide as Beckmann's alpha: 2/alpha^2 - 2.  Source: S-BLG-04, S-CNV-04. */
static inline double weft_blinn_phong_power_of_alpha(double alpha)
{
    return 2 / (alpha * alpha) - 2;
}

/** Beckmann's alpha of a power: sqrt(2/(m + 2)). */
static inline double weft_blinn_phong_alpha_of_power(double power)
{
    return sqrt(2 / (power + 2));
}

/**
 * Distribution, in 1/sr; the integral of D (n.h) over the hemisphere is 1.
 *
 *     D = (m + 2)/(2 pi) nh^m
 *
 * The seed prints (n.v)^m, which does not depend on h and integrates to 33 in place of 1 (m 64): h is meant.
 *
 * @param s2     1 - nh^2 without cancellation (half.h); nh^m = (1 - s2)^(m/2)
 * @param power  m >= 0
 * Source: S-FC3-10 (which calls D/4 "D").
 */
static inline double weft_blinn_phong_d(double s2, double power)
{
    const double log_nh = s2 < 1 ? 0.5 * weft_log_one_minus(s2) : -1e4;
    return (power + 2) / 6.28318530717958647692 * weft_exp_negative(power * log_nh);
}

/**
 * Mean of the Schlick-Smith visibility over independent cosines of light and view:
 *
 *     avgV = (integral of 1/(u (1-k) + k), u = 0..1)^2 = (-ln k/(1 - k))^2
 *
 * @param k  0 < k < 1; weft_schlick_k_power().  Source: S-FC3-13, with the square the first line leaves out.
 */
static inline double weft_blinn_phong_average_visibility(double k)
{
    const double mean = -log(k) / (1 - k);
    return mean * mean;
}

/** Normalisation with the visibility averaged away: E = (m + 2)/8 avgV; f = E F nh^m/pi.  Twice too strong
 *  at normal view and far too weak at grazing ones.  Source: S-FC3-13. */
static inline double weft_blinn_phong_energy(double power)
{
    return (power + 2) / 8 * weft_blinn_phong_average_visibility(weft_schlick_k_power(power));
}

/** The seed's fit of weft_blinn_phong_energy(): 2^(-1.85689 + 16.1624 g).  Called "extremely accurate"
 *  there; it is half of the truth at g = 0 and within 10 % only above g = 0.5.  Source: S-FC3-13. */
static inline double weft_blinn_phong_energy_fit(double gloss)
{
    return exp2(-1.85689 + 16.1624 * gloss);
}

/** What was shipped: (2 m + 1)/8, below weft_blinn_phong_energy() everywhere.  Source: S-FC3-13. */
static inline double weft_blinn_phong_energy_shipped(double power)
{
    return (2 * power + 1) / 8;
}

#endif
