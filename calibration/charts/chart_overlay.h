/** A picture of what was found, for looking at. */
#ifndef WEFT_CALIBRATION_CHARTS_CHART_OVERLAY_H
#define WEFT_CALIBRATION_CHARTS_CHART_OVERLAY_H

#include "calibration/charts/chart_find.h"
#include "core/formats/raster.h"

/**
 * The photograph (balanced and brightened, sRGB) with the frame's outline in yellow, a ring at its first
 * corner, each patch in green or, when left out, in red, and the window that is measured inside.
 *
 * @param left_out  [patch] non-zero: drawn in red; NULL: none
 * @param raster    uninitialised; 8 bit RGB, half size for a mosaic
 */
weft_err weft_chart_overlay(const weft_chart *chart, const weft_chart_picture *picture,
                            const weft_chart_pose *pose, const unsigned char *left_out, weft_raster *raster,
                            weft_error *err);

#endif
