/** Means over a window around every pixel, at a cost that does not grow with the window. */
#ifndef WEFT_HOST_SOLVE_RUNNING_MEAN_H
#define WEFT_HOST_SOLVE_RUNNING_MEAN_H

#include "core/image.h"

/**
 * Replaces every plane by its mean over (2 reach + 1)^2 neighbours, `rounds` times over; three rounds are a
 * Gaussian in all but name, of the variance ((2 reach + 1)^2 - 1) / 4.
 *
 * Beyond the edges there is 0: give values times weights and the weights as another plane, and divide.
 * @return WEFT_ERR_NOMEM
 */
weft_err weft_running_mean(weft_image *image, int reach, int rounds, weft_error *err);

#endif
