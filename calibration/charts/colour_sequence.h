/** Fits the sequence affine, cubic, affine (S-FC3-01, S-FC3-02), each step on what the one before left. */
#ifndef WEFT_CALIBRATION_CHARTS_COLOUR_SEQUENCE_H
#define WEFT_CALIBRATION_CHARTS_COLOUR_SEQUENCE_H

#include "calibration/charts/chart.h"
#include "calibration/colour_model.h"

/** Least squares y = m (x, 1) over n pairs.  @return the rank of 4; below it m is of no use */
int weft_colour_affine_fit(int n, const double (*x)[3], const double (*y)[3], double m[3][4],
                           double *condition);

/** Least squares of a cubic per channel.  @return the smallest rank of 4 */
int weft_colour_cubic_fit(int n, const double (*x)[3], const double (*y)[3], double m[3][4]);

/**
 * Fits the sequence in whatever space the pairs are in.
 *
 * A cubic that is not monotone over the range of its inputs would swap colours: with `guarded` the whole
 * cubic step is then left out, and what remains is the affine map.
 *
 * @return the smallest rank of all steps; below 4 the sequence is of no use
 */
int weft_colour_sequence_fit(int n, const double (*x)[3], const double (*y)[3], bool guarded,
                             weft_colour_sequence *sequence, double *condition);

#endif
