/** Plane to picture: projective maps of the plane, fitted to points and to edges. */
#ifndef WEFT_CALIBRATION_CHARTS_HOMOGRAPHY_H
#define WEFT_CALIBRATION_CHARTS_HOMOGRAPHY_H

#include "core/error.h"
#include "core/linalg.h"

#include <stdbool.h>

/**
 * Maps (x, y, 1) through `h` and divides.
 *
 * @return false when the point lies on or behind the line that goes to infinity (w <= 0; maps of this file
 *         have w > 0 at the origin): u and v are then untouched
 */
bool weft_homography_apply(const weft_mat3 *h, double x, double y, double *u, double *v);

/** The map that takes (x, y) to (u, v) in one direction (nu, nv): what an edge tells.  A point is two of
 * them. */
typedef struct weft_homography_sight {
    double x, y;   /* in the plane */
    double u, v;   /* where it was seen, px */
    double nu, nv; /* unit direction in which it was seen; across an edge */
} weft_homography_sight;

/** The map through four points exactly.  False when three of them lie on a line. */
bool weft_homography_from_corners(const double from[4][2], const double to[4][2], weft_mat3 *h);

/**
 * Least squares over all sights by Gauss-Newton, starting from `h`.
 *
 * @param robust  leaves out sights that lie far off (Tukey's biweight, 4.7 robust sigmas)
 * @param scratch room for 2 * n doubles
 * @param rms     gets the rms of the sights that count, px
 * @return WEFT_ERR_NODATA with fewer than 8 sights or when they do not determine the map; `h` untouched
 */
weft_err weft_homography_refine(const weft_homography_sight *sights, int n, bool robust, double *scratch,
                                weft_mat3 *h, double *rms, weft_error *err);

#endif
