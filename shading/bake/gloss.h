/** Gloss of Call of Duty: WWII, the mean normal length of GGX, and filtering both together
 *  (S-COD-01 to S-COD-09).  Gloss is 0..1; lengths are those of a mean of unit normals, 2/3..1. */
#ifndef WEFT_SHADING_BAKE_GLOSS_H
#define WEFT_SHADING_BAKE_GLOSS_H

#include <math.h>

/** alpha = sqrt(2/(1 + 2^(18 g))): 1 at g = 0, 0.0027621 at g = 1.  Source: Chan 2018 page 6 with its
 *  erratum; S-COD-01. */
static inline double weft_gloss_alpha(double gloss)
{
    return sqrt(2 / (1 + exp2(18 * gloss)));
}

/** The form of Advanced Warfare, sqrt(2/(2 + 2^(16 g))).  Source: S-COD-01. */
static inline double weft_gloss_alpha_advanced(double gloss)
{
    return sqrt(2 / (2 + exp2(16 * gloss)));
}

/** Inverse of weft_gloss_alpha(), cut to 0..1: log2(2/alpha^2 - 1)/18; alpha = 0 gives 1. */
double weft_gloss_of_alpha(double alpha);

/**
 * 1 - r, r the length of the mean of normals with density D (n.h), by its closed form, any alpha > 0:
 *
 *     1 - r = alpha^2 (atanh(sqrt q)/sqrt q - 1)/q,   q = 1 - alpha^2
 *
 * with atan for q < 0 and the series sum of q^k/(2k + 3) near 0.  Kept as what is missing from 1, for r
 * itself has lost its digits where surfaces are smooth; alpha = 0 gives 0.  Source: S-COD-03.
 */
double weft_ggx_missing_length(double alpha);

/** 1 - r of a gloss: what Call of Duty's 256-row table holds.  Source: S-COD-04. */
double weft_gloss_missing_length(double gloss);

/** Inverse: gloss whose length is 1 - missing, 0 from 1/3 on and 1 below that of gloss 1.  One step of a
 *  half float below length 1 is 0.99 in gloss: keep lengths in float or better.  Source: S-COD-04. */
double weft_gloss_of_missing_length(double missing);

/** The deck's rational fit of length by gloss, off by up to 3.2e-4: for comparison; with the exact inverse it
 *  is wrong by 0.12 in gloss.  Source: S-COD-06. */
double weft_gloss_length_fit(double gloss);

/** One gloss for two independent roughnesses: the lengths multiply; below length 2/3 it is 0.
 *  Source: S-COD-08. */
double weft_gloss_combine(double x, double y);

/** The deck's rational fit of it, off by up to 0.0167.  Source: S-COD-09, its lost brackets restored. */
double weft_gloss_combine_fit(double x, double y);

/** Unit normal and gloss of a texel, and the length of the shortened normal. */
typedef struct weft_gloss_texel {
    double normal[3], gloss, length;
} weft_gloss_texel;

/**
 * One texel of a coarser level: normals shortened by their gloss, averaged, and lengthened again.
 *
 *     s = r(alpha(g)) n,   s' = sum w s,   g' = gloss(|s'|),   n' = s'/|s'|
 *
 * @param weights  of the n texels; NULL for equal ones.  With negative ones |s'| is cut to what gloss 1 has.
 * |s'| = 0 gives (0, 0, 1) and gloss 0; `length` is |s'|, from which the next level is to be made, not from
 * the encoded result.  Source: Chan 2018 pages 17-24; S-COD-05.
 */
weft_gloss_texel weft_gloss_filter(int n, const weft_gloss_texel texels[], const double weights[]);

#endif
