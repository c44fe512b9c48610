/**
 * Several exposures of one light, merged into the linear light that they show together.
 *
 * Each photosite is the mean of its values, weighted by the inverse of their variance (Robertson, Borman,
 * Stevenson 2003; Hasinoff, Durand, Freeman 2010, eq. 8):
 *
 *     w(x) = m t^2 / (read + shot x t)
 *
 * with x the linear value, t exposure times gain, m how many frames the file is the mean of, and the noise of
 * noise.h.  Which x stands in the weights is one number per photosite, the value of the longest exposure that
 * counts: were each value weighted by itself, dark outliers would count more.
 *
 * A value counts when neither its photosite nor a neighbour is saturated, and when it lies below 95 % of the
 * range, where sensors begin to bend.  Which side of that it is on is judged by its mean with the next
 * shorter exposure, weighted as in the merge: whatever that mean is, the shorter exposures differ from it by
 * noise of their own, so leaving the longer one out is no bias.  (Judged by the value itself just the dark
 * half of the noise would stay: -0.2 % at 30000 electrons; by the shorter exposure the other half: +0.3 %.)
 */
#ifndef WEFT_HOST_SET_BRACKET_H
#define WEFT_HOST_SET_BRACKET_H

#include "host/set/noise.h"
#include "host/set/plate.h"

/** Share of the range above which a longer exposure is left out. */
#define WEFT_BRACKET_LIMIT 0.95

/**
 * Merges frames of one scene.
 *
 * The noise is that of the set (set->noise) when it was recorded at the gain of all these frames, else it is
 * found from the two longest exposures.  A photosite that no exposure holds keeps the value of the shortest,
 * saturated as it is, and is marked.
 *
 * @param frames  `n` >= 2 indices into the set
 */
weft_err weft_bracket_merge(const weft_set *set, const int *frames, int n, weft_plate *plate,
                            weft_error *err);

/**
 * Measures the noise of a single frame by the two longest exposures of a light.
 *
 * @param found  false (noise untouched) when the light has no two, or they do not determine it
 */
weft_err weft_bracket_measure_noise(const weft_set *set, int light, weft_noise *noise, bool *found,
                                    weft_error *err);

/** The weight of a value x (1/s) in a frame. */
double weft_bracket_weight(const weft_noise *noise, const weft_set_frame *frame, double x);

#endif
