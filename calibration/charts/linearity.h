/** Is the sensor linear, and over which part of its range? */
#ifndef WEFT_CALIBRATION_CHARTS_LINEARITY_H
#define WEFT_CALIBRATION_CHARTS_LINEARITY_H

#include "calibration/calibration.h"
#include "calibration/charts/grey_fit.h"

/** Largest deviation of an exposure series that passes, as a share of full scale. */
#define WEFT_LINEARITY_SERIES_MAX 0.01

/**
 * From grey scales: the range in which every patch answers as its nominal reflectance says, within
 * weft_grey_tolerance().  Where only the ends of the range fail, they are cut off.
 *
 * @param fits       one per light, as fitted; with full_scale known
 * @param readings   [light][patch]
 * @param full_scale one per light
 * @param linearity  range and largest deviation (relative) inside it
 * @return WEFT_ERR_NODATA naming light, patch, class and number when the sensor bends inside its range
 */
weft_err weft_linearity_from_greys(const weft_chart *chart, const weft_grey_fit *fits,
                                   const weft_patch_reading *const *readings, const double *full_scale,
                                   int n_lights, weft_linearity *linearity, weft_error *err);

/** One photograph of a series: the same scene and light, another exposure. */
typedef struct weft_exposure {
    double exposure;                    /* exposure_s * gain */
    const weft_patch_reading *readings; /* of the frame: (DN - black) / (white - black) / exposure */
} weft_exposure;

typedef struct weft_exposure_fit {
    int n_points;              /* patches and exposures that took part */
    double offset[WEFT_SITES]; /* share of full scale at exposure 0: black level that is off */
    double max_deviation;      /* from straight lines through all, share of full scale */
    double worst_at;           /* where, share of full scale */
    double range[2];           /* covered */
} weft_exposure_fit;

/**
 * Straight lines through a series: value = offset_class + radiance_patch,class * exposure, by least squares.
 * Patches with a clipped photosite and values above WEFT_GREY_RANGE_MAX take no part.
 *
 * @return WEFT_ERR_NODATA with fewer than 3 different exposures or 12 points of a class
 */
weft_err weft_linearity_from_series(const weft_chart *chart, const weft_exposure *exposures, int n,
                                    weft_exposure_fit *fit, weft_error *err);

#endif
