/** Regions that look like a patch seen at an angle: bright parallelograms on something darker. */
#ifndef WEFT_CALIBRATION_CHARTS_CHART_BLOBS_H
#define WEFT_CALIBRATION_CHARTS_CHART_BLOBS_H

#include "core/error.h"
#include "core/image.h"

typedef struct weft_blob {
    double u, v;          /* centroid */
    double area;          /* pixels */
    double cuu, cuv, cvv; /* covariance of its pixels */
    double squareness;    /* area / (12 sqrt(det covariance)): 1 for every parallelogram, 1.05 for ellipses */
} weft_blob;

typedef struct weft_blobs {
    int n, capacity;
    weft_blob *items;
} weft_blobs;

/**
 * Finds the blobs of one plane at any brightness.
 *
 * Pixels join from bright to dark in steps of 8 %; at each step every region that has grown is judged by its
 * moments (the component tree of Matas et al. 2002, with a shape test in place of stability).  So one dark
 * corner of the picture and one bright one need no common threshold.  Of the versions of one region the
 * largest that is still a parallelogram is kept.
 */
weft_err weft_blobs_find(const weft_image *plane, weft_blobs *blobs, weft_error *err);
void weft_blobs_fini(weft_blobs *blobs);

#endif
