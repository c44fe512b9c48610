/**
 * From camera RGB to linear sRGB: a 3x3 matrix from patches of known colour.
 *
 * More terms fit 24 patches better and cloth worse (docs/calibration-charts.md), so there are no more.
 */
#ifndef WEFT_CALIBRATION_CHARTS_COLOUR_FIT_H
#define WEFT_CALIBRATION_CHARTS_COLOUR_FIT_H

#include "calibration/charts/chart.h"
#include "core/linalg.h"

#include <stdbool.h>

/** Fewest patches that are believed: three for each term. */
#define WEFT_COLOUR_PATCHES_MIN 9

/** One patch as the camera saw it: white balanced, 1 = the perfect diffuser (or any common scale). */
typedef struct weft_colour_sample {
    double camera[3];
    double reference[3]; /* linear sRGB */
    bool used;
} weft_colour_sample;

typedef struct weft_colour_fit {
    weft_mat3 to_linear_srgb;
    int n_used, rank;                        /* of the 3 columns */
    double condition;                        /* of the scaled columns */
    double before[WEFT_CHART_MAX_PATCHES];   /* CIEDE2000 without the matrix, brightness matched */
    double trained[WEFT_CHART_MAX_PATCHES];  /* with it */
    double held_out[WEFT_CHART_MAX_PATCHES]; /* each patch by a matrix fitted without it */
    double before_mean, before_max;          /* over the patches used */
    double trained_mean, trained_max;
    double held_out_mean, held_out_max;
} weft_colour_fit;

/**
 * Least squares in linear sRGB, each patch weighted by 1 / Y of its reference (errors count relative to
 * brightness, as the eye counts them).  Pivoted QR on scaled columns.
 *
 * @return WEFT_ERR_NODATA with fewer than WEFT_COLOUR_PATCHES_MIN used samples, for values that are not
 *         finite, or when the colours do not determine three columns (all grey)
 */
weft_err weft_colour_fit_matrix(const weft_colour_sample *samples, int n, weft_colour_fit *fit,
                                weft_error *err);

#endif
