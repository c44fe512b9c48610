/** The GGX whose distribution of micro-slopes is closest to a footprint's: the rule WEFT_MIP_CLOSEST of
 * mips.h. */
#ifndef WEFT_SHADING_BAKE_MIP_CLOSEST_H
#define WEFT_SHADING_BAKE_MIP_CLOSEST_H

/** Texels that are summed side by side; arrays have room for a whole number of them. */
#define WEFT_MIP_LANES 4

/**
 * alpha of the GGX that is nowhere far from the footprint.
 *
 * The footprint has within the slope t of its mean normal the mean of its texels' P (mips.h), the GGX
 * t^2/(t^2 + alpha^2).  They are held against each other at seven slopes about the footprint's median; the
 * largest distance is least where it is as large above as below, which is a root.
 *
 * @param d2  [n] squared slope (tan^2) of a texel's normal against the mean normal
 * @param a2  [n] squared alpha of the texel
 * @param w   [n] weights, not all 0
 *            all three with room for n rounded up to WEFT_MIP_LANES: what is behind n is overwritten
 * @return alpha > 0, perhaps above 1
 */
double weft_mip_closest(int n, float *d2, float *a2, float *w);

#endif
