/** The correction of plain photographs: white, brightness and colour by a chart in one of them. */
#ifndef WEFT_HOST_PHOTO_PHOTO_COLOUR_H
#define WEFT_HOST_PHOTO_PHOTO_COLOUR_H

#include "calibration/calibration.h"
#include "calibration/charts/chart_find.h"
#include "calibration/charts/patch_colour.h"
#include "host/photo/photo.h"

typedef struct weft_photo_correction {
    double gain[3];          /* of the channels: white is balanced, the chart as bright as it should be */
    double exposure;         /* of the chart's photograph (weft_photo); 0 unknown: all are taken for alike */
    weft_colour_part colour; /* model and gamut */
} weft_photo_correction;

/** What the chart's photograph gave, for people. */
typedef struct weft_photo_chart {
    const weft_chart *chart;
    weft_chart_pose pose;
    weft_patch_colour colours[WEFT_CHART_MAX_PATCHES];
    weft_colour_fit fit;
    double light_gradient; /* how much brighter one side of the chart is lit than the other, after flattening;
                                 from 2 % on the fit allows for it */
} weft_photo_chart;

/**
 * Fits the correction to a photograph of a chart, flattened already.
 *
 * White comes from the chart's neutrals; there is no lamp to know it from.
 *
 * @param corners  four corners by hand, or NULL
 * @param exclude  patches that the user names
 * @return what weft_chart_locate(), weft_chart_measure(), weft_patch_exclude() and weft_colour_fit_patches()
 * say; WEFT_ERR_NODATA when more than a quarter of the patches is clipped
 */
weft_err weft_photo_correction_fit(const weft_photo *photo, const weft_chart *chart,
                                   const double (*corners)[2], const weft_texts *exclude,
                                   weft_colour_method method, weft_photo_chart *seen,
                                   weft_photo_correction *correction, weft_error *err);

/** Takes colour and white from a scanner's calibration: for photographs under all its lights.
 *  @return WEFT_ERR_MISSING without colour or lights */
weft_err weft_photo_correction_of(const weft_calibration *cal, const char *folder,
                                  weft_photo_correction *correction, weft_error *err);

/** Corrects a photograph, flattened already, to linear sRGB in three planes. */
weft_err weft_photo_correct(weft_photo *photo, const weft_photo_correction *correction, weft_error *err);

#endif
