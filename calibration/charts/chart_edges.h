/** Places a chart by the edges of its patches, to a fraction of a pixel. */
#ifndef WEFT_CALIBRATION_CHARTS_CHART_EDGES_H
#define WEFT_CALIBRATION_CHARTS_CHART_EDGES_H

#include "calibration/charts/chart.h"
#include "core/image.h"
#include "core/linalg.h"

/**
 * Refines a map from chart mm to the pixels of `contrast` (weft_chart_picture_contrast()).
 *
 * Every side of every patch is crossed at three places; where the profile passes half way between the patch
 * and the gap is an edge.  Homography by robust least squares over all edges, twice.
 *
 * @param n_edges  gets the number of edges that were seen; below 24 `map` is left as it is
 * @param rms      gets their rms distance from the map, pixels of `contrast`
 */
weft_err weft_chart_edges_refine(const weft_chart *chart, const weft_image *contrast, weft_mat3 *map,
                                 int *n_edges, double *rms, weft_error *err);

#endif
