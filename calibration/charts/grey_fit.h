/**
 * What a scale of greys says of one light: how much each class of photosites answers to reflectance, and
 * whether it does so in a straight line (S-ORD-19).
 */
#ifndef WEFT_CALIBRATION_CHARTS_GREY_FIT_H
#define WEFT_CALIBRATION_CHARTS_GREY_FIT_H

#include "calibration/charts/chart.h"
#include "calibration/charts/chart_measure.h"

#include <stdbool.h>

/** Part of the sensor's range that is used: below, noise and black level rule; above, saturation. */
#define WEFT_GREY_RANGE_MIN 0.01
#define WEFT_GREY_RANGE_MAX 0.95

/** Fewest patches of a light that are believed. */
#define WEFT_GREY_PATCHES_MIN 6

/** Readings of one light, borrowed. */
typedef struct weft_grey_light {
    const weft_patch_reading *readings;
    const double (*irradiance)[3]; /* [patch][channel] relative light on each patch; NULL: to be fitted */
    double full_scale; /* reading * this = share of the sensor's range (exposure_s * gain); 0 unknown */
} weft_grey_light;

typedef struct weft_grey_fit {
    double slope[WEFT_SITES]; /* reading per reflectance at irradiance 1 */
    double gradient[2]; /* fitted illumination: log units per mm in x and y of the chart; 0 when given */
    int n_usable;
    bool usable[WEFT_CHART_MAX_PATCHES]; /* neutral, not clipped, inside the range */
    double deviation[WEFT_CHART_MAX_PATCHES]
                    [WEFT_SITES]; /* reading / (slope * reflectance * irradiance) - 1 */
    double max_deviation;         /* largest magnitude over usable patches */
    int worst_patch;
    double range[2]; /* of the sensor, covered by usable patches; 0, 0 when full_scale is unknown */
} weft_grey_fit;

/**
 * Fits one light.  Slopes by sum(m rho) / sum(rho^2) on readings divided by the irradiance; when that is not
 * given, an illumination that is affine in its logarithm over the chart is fitted together with the slopes.
 *
 * @return WEFT_ERR_NODATA with fewer than WEFT_GREY_PATCHES_MIN usable patches (saying what was wrong with
 * the others), or when the readings do not fall with the Munsell value (naming the two patches)
 */
weft_err weft_grey_fit_light(const weft_chart *chart, const weft_grey_light *light, weft_grey_fit *fit,
                             weft_error *err);

/** Tolerance for nominal reflectances: 5 %, below N4 10 % (measured chips differ that much). */
double weft_grey_tolerance(double munsell_value);

#endif
