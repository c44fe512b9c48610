/** Blobs that stand in rows and columns: the patches of a chart, before it is known which is which. */
#ifndef WEFT_CALIBRATION_CHARTS_CHART_LATTICE_H
#define WEFT_CALIBRATION_CHARTS_CHART_LATTICE_H

#include "calibration/charts/chart_blobs.h"
#include "core/linalg.h"

#include <stdbool.h>

#define WEFT_LATTICE_MAX 256

typedef struct weft_lattice_node {
    int blob; /* index of the blob */
    int i, j; /* column and row, counted from the seed */
} weft_lattice_node;

typedef struct weft_lattice {
    int n;
    weft_lattice_node nodes[WEFT_LATTICE_MAX];
    int i_min, i_max, j_min, j_max;
    weft_mat3 to_pixel; /* (i, j, 1) to the plane of the blobs; i and j turn the same way as u and v */
} weft_lattice;

/**
 * Grows a lattice from one blob.
 *
 * A square of side s has the covariance s^2/12 in its own axes whatever the view, so its neighbour at
 * distance `pitch` lies at the Mahalanobis distance sqrt(12) * pitch / s, and the two directions are
 * perpendicular in that metric: no scale and no angle needs to be known beforehand.
 *
 * @param ratio  pitch / side of a patch, e.g. 1.25
 * @param used   [blobs->n] blobs that are taken are non-zero and left out
 * @return false when fewer than 6 blobs or fewer than 2 rows or columns belong together
 */
bool weft_lattice_grow(const weft_blobs *blobs, int seed, double ratio, const unsigned char *used,
                       weft_lattice *lattice);

#endif
