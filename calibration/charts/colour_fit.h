/**
 * From camera RGB to linear sRGB: a model of colour_model.h from patches of known colour.
 *
 * More terms than a root-polynomial of degree 2 fit 24 patches better and cloth worse
 * (docs/calibration-charts.md), so there are no more.
 */
#ifndef WEFT_CALIBRATION_CHARTS_COLOUR_FIT_H
#define WEFT_CALIBRATION_CHARTS_COLOUR_FIT_H

#include "calibration/charts/chart.h"
#include "calibration/colour_model.h"

#include <stdbool.h>

/** Fewest patches that are believed: three for each term, 9, 18 and 12. */
int weft_colour_patches_min(weft_colour_method method);

/** One patch as the camera saw it: white balanced, 1 = the perfect diffuser (or any common scale). */
typedef struct weft_colour_sample {
    double camera[3];
    double reference[3]; /* linear sRGB */
    bool used;
} weft_colour_sample;

typedef struct weft_colour_fit {
    weft_colour_model model;
    int n_used, rank, n_terms;               /* rank of n_terms columns */
    double condition;                        /* of the scaled columns */
    double before[WEFT_CHART_MAX_PATCHES];   /* CIEDE2000 without the model, brightness matched */
    double trained[WEFT_CHART_MAX_PATCHES];  /* with it */
    double held_out[WEFT_CHART_MAX_PATCHES]; /* each patch by a model fitted without it */
    double before_mean, before_max;          /* over the patches used */
    double trained_mean, trained_max;
    double held_out_mean, held_out_max;
} weft_colour_fit;

/**
 * Fits a model and tells how good it is on the patches, on patches held out, and without it.
 *
 * Matrix: least squares in linear sRGB, each patch weighted by 1 / Y of its reference (errors count relative
 * to brightness, as the eye counts them).  Root-polynomial: plain least squares in linear sRGB.  Sequence:
 * plain least squares in xyY.
 * Pivoted QR on scaled columns.
 *
 * @return WEFT_ERR_NODATA with fewer than weft_colour_patches_min() used samples, for values that are not
 *         finite, or when the colours do not determine all columns (all grey)
 */
weft_err weft_colour_fit_patches(const weft_colour_sample *samples, int n, weft_colour_method method,
                                 weft_colour_fit *fit, weft_error *err);

#endif
