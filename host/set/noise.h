/** How noisy a frame is, found from the frames themselves. */
#ifndef WEFT_HOST_SET_NOISE_H
#define WEFT_HOST_SET_NOISE_H

#include "core/image.h"

/**
 * Variance of a photosite as a fraction of full scale: var(X) = read + shot * X (photon transfer, Janesick
 * 2001), X = 0 black, 1 white.
 */
typedef struct weft_noise {
    double read; /* read variance, >= 0 */
    double shot; /* full scale / full well in electrons, >= 0 */
} weft_noise;

/**
 * Standard deviation of the noise in the darkest tenth of a picture: the median over its 16 x 16 blocks of
 * the deviation of second differences between sites of one colour, so that gradients drop out and hot pixels
 * do not count.  In a frame without light this is the read noise; in a lit one an upper bound of it, as shot
 * noise and fine texture add.
 *
 * @param step  distance of sites of one colour: 2 for a Bayer mosaic, 1 else
 * @return      in the units of the picture; 0 when it is too small to tell (less than 16 x 16 sites)
 */
double weft_noise_floor(const weft_image *image, int step);

/**
 * Fits `noise` to two exposures of one scene: their difference holds no texture, only noise.
 *
 * @param a, b        linear pictures per second and gain, one size
 * @param time_a,_b   exposure * gain of each, s, different
 * @param bad_a,_b    non-zero where a value must not be used (clipped)
 * @return false (noise untouched) when the pictures do not determine it
 */
bool weft_noise_fit(const weft_image *a, double time_a, const weft_mask *bad_a, const weft_image *b,
                    double time_b, const weft_mask *bad_b, weft_noise *noise);

#endif
