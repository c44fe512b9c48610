/** What the sensor saw of each patch: raw photosites, no demosaicing. */
#ifndef WEFT_CALIBRATION_CHARTS_CHART_MEASURE_H
#define WEFT_CALIBRATION_CHARTS_CHART_MEASURE_H

#include "calibration/charts/chart.h"
#include "calibration/charts/chart_find.h"

/** Classes of photosites.  Green on red rows is G1, on blue rows G2 (S-ORD-19 keeps them apart). */
typedef enum weft_site { WEFT_SITE_R, WEFT_SITE_G1, WEFT_SITE_G2, WEFT_SITE_B, WEFT_SITES } weft_site;

/** "R", "G1", "G2", "B" */
extern const char *const weft_site_names[WEFT_SITES];
/** Colour 0 red, 1 green, 2 blue of a class. */
extern const int weft_site_colour[WEFT_SITES];

typedef struct weft_patch_reading {
    double u, v;             /* centre, px */
    double mean[WEFT_SITES]; /* linear value of the picture; outliers (dust, glints, hot pixels) left out */
    double std_dev[WEFT_SITES]; /* of one photosite */
    int n[WEFT_SITES];          /* photosites that count */
    double clipped;             /* share of photosites that are not trustworthy */
    double outliers;            /* share that was left out */
    double unevenness; /* relative deviation of parts of the patch from a plane, noise apart: stains */
} weft_patch_reading;

/**
 * Reads the middle 50 % (side) of every patch, photosite by photosite.
 *
 * RGB pictures fill G1 and G2 alike, grey ones all four.
 *
 * @param readings  columns * rows
 * @return WEFT_ERR_NODATA when a patch has fewer than 16 photosites of a class: the chart is too small
 */
weft_err weft_chart_measure(const weft_chart *chart, const weft_chart_picture *picture,
                            const weft_chart_pose *pose, weft_patch_reading *readings, weft_error *err);

#endif
