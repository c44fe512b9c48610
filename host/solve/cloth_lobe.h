/**
 * The mirror light of a fabric: one lobe for the whole cloth, found from the set itself.
 *
 * A broad lobe reaches every one of ten lights, so no choice of lights is free of it, and least squares takes
 * it for relief: every yarn looks taller.  But the lobe is the same all over a cloth, while albedo and normal
 * change from pixel to pixel, so a few thousand pixels under ten lights determine its few numbers:
 *
 *     I'_j = k (n . l_j) + S(n, l_j, v),   S = strength pi D(h) V(n, l, v) F(l . h) / F0 (n . l)
 *
 * with D the anisotropic GGX distribution (Burley 2012, eq. 13), V Smith's joint masking for the mean
 * roughness (Heitz 2014, eq. 99) and Schlick's F for F0 = 5 %.  The fibres run in one of two directions
 * across each other, warp or weft; each pixel takes the one that fits.
 */
#ifndef WEFT_HOST_SOLVE_CLOTH_LOBE_H
#define WEFT_HOST_SOLVE_CLOTH_LOBE_H

#include "host/solve/samples.h"

/** What the fit came to. */
typedef struct weft_gloss_report {
    bool found;           /* the cloth shines: `gloss` explains much of what a matte surface does not */
    double matte, glossy; /* mean chi^2 per light and pixel of either model, each light at most 9 */
    int n_pixels;
} weft_gloss_report;

/**
 * Fits the lobe to blocks of samples.
 *
 * Nothing is fitted where a matte surface explains the samples within noise and WEFT_SOLVE_MISFIT, and the
 * lobe is only taken when it halves what is unexplained.
 *
 * @param blocks  [n], with `gloss` NULL and `view` filled
 */
weft_gloss_report weft_gloss_fit(weft_solve_samples *const *blocks, int n, weft_gloss *gloss);

/**
 * Solves samples with a lobe (samples->gloss): the scaled normal by Gauss-Newton for each fibre direction,
 * dark samples and then those beyond three sigma left out.
 *
 * @param matte  [n_lights] blocks' copy without the mirror light, ready for least squares
 * @param kept   [n_lights] weights of the samples that agree
 * @param cost   [lane] sum over the lights of min(chi^2, 9)
 */
void weft_gloss_solve(const weft_solve_samples *restrict samples, weft_solve_samples *restrict matte,
                      weft_lane_weights *restrict kept, float cost[WEFT_SOLVE_LANES]);

#endif
