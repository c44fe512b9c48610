/** The light that a calibration's model puts on the patches of a chart. */
#ifndef WEFT_CALIBRATION_CHARTS_CHART_LIGHT_H
#define WEFT_CALIBRATION_CHARTS_CHART_LIGHT_H

#include "calibration/calibration.h"
#include "calibration/charts/chart_find.h"

/**
 * Irradiance on the middle of every patch, for a chart that lies flat: n.l a(theta) / r^2 times the grid's
 * gain; times the light's intensity it is the linear value of a white patch there.
 *
 * @param height_mm   of the chart's surface over the sample plane
 * @param irradiance  [patch][channel]
 * @return WEFT_ERR_NODATA when a patch cannot be placed or gets no light by the model
 */
weft_err weft_chart_irradiance(const weft_calibration *cal, int light, const weft_chart *chart,
                               const weft_chart_pose *pose, double height_mm, double (*irradiance)[3],
                               weft_error *err);

#endif
