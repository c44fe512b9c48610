/** Upsampling of half-size results that keeps edges of depth (S-BLG-09). */
#ifndef WEFT_SHADING_PREVIEW_BILATERAL_H
#define WEFT_SHADING_PREVIEW_BILATERAL_H

/** Loss of weight per unit of depth: 0.05 rejects from 20 units on. */
#define WEFT_BILATERAL_SLOPE 0.05

/**
 * Mean of n samples by nearness in depth.
 *
 *     w_k = max(0, 1 - slope |z_k - z|),   value = sum w_k c_k/(sum w_k + 1e-4)
 *
 * The 1e-4 darkens by that share, and gives 0 where no sample is near.
 *
 * @param z  linear depth of the place in world units; `depths` and `values` are of the samples
 * Source: S-BLG-09.
 */
static inline double weft_bilateral_mean(double z, int n, const double *depths, const double *values,
                                         double slope)
{
    double sum = 0, weight = 0;
    for (int k = 0; k < n; k++) {
        const double off = depths[k] > z ? depths[k] - z : z - depths[k], w = 1 - slope * off;
        if (w > 0) {
            sum += w * values[k];
            weight += w;
        }
    }
    return sum / (weight + 1e-4);
}

#endif
