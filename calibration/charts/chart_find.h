/**
 * Finds a chart in a photograph by itself.
 *
 * Any rotation in the plane, moderate tilt, uneven light, any table; needs neither lens nor lights.  How:
 * blobs of any brightness that are parallelograms (chart_blobs.h), those that stand in rows and columns
 * (chart_lattice.h), the placement and rotation whose reference colours explain what was measured, and the
 * edges of all patches to place it to a fraction of a pixel (chart_edges.h).
 */
#ifndef WEFT_CALIBRATION_CHARTS_CHART_FIND_H
#define WEFT_CALIBRATION_CHARTS_CHART_FIND_H

#include "calibration/charts/chart.h"
#include "calibration/charts/chart_picture.h"
#include "core/linalg.h"

/** Where a chart lies in a picture. */
typedef struct weft_chart_pose {
    weft_mat3 to_pixel;   /* (x_mm, y_mm, 1) of the chart to (u, v, 1) */
    double corners[4][2]; /* outer corners of the dark frame, px: at the first patch, then clockwise */
    int n_seen;           /* patches that stood out by themselves; 0 for corners given by hand */
    int n_edges;          /* pieces of patch edges that placed it; 0: placed by its corners only */
    double edge_rms_px;   /* of those edges off the plane, lens distortion included */
    double score;         /* share of the patches' log variance that the reference explains, at most 1 */
    double runner_up;     /* the same for the best other rotation or placement */
} weft_chart_pose;

/** Smallest score that is believed, and the smallest lead over every other rotation. */
#define WEFT_CHART_SCORE_MIN 0.70
#define WEFT_CHART_LEAD_MIN  0.10

/**
 * Finds the chart.
 *
 * @return WEFT_ERR_NODATA with reason and number: not found (what was seen instead), two of them, mirrored,
 *         rotation ambiguous, grey patches not in order.  `pose` is then untouched.
 */
weft_err weft_chart_locate(const weft_chart *chart, const weft_chart_picture *picture, weft_chart_pose *pose,
                           weft_error *err);

/**
 * The chart of four corners found by hand: outer corners of the dark frame, px, beginning at the first patch
 * and then clockwise as the chart is read.  Patch edges refine them where they can be seen.
 *
 * @return WEFT_ERR_USAGE for corners that are no convex quadrilateral in that order or lie far outside,
 *         WEFT_ERR_NODATA when the colours say that the chart lies otherwise
 */
weft_err weft_chart_place(const weft_chart *chart, const weft_chart_picture *picture,
                          const double corners[4][2], weft_chart_pose *pose, weft_error *err);

/** Half the outer size of the chart's frame, mm. */
void weft_chart_half_size(const weft_chart *chart, double *half_width_mm, double *half_height_mm);

#endif
