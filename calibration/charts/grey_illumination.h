/**
 * How the light of each lamp falls on a chart of greys, found from the chart itself: for calibrations that
 * have no lights yet.
 *
 * A gradient of the light and a bend of the sensor look alike under one lamp: the scale runs along the chart.
 * Over lamps from all sides they do not: what differs between the lamps is light only, and what they have in
 * common is nearly even, because the gradients of opposite lamps cancel.
 */
#ifndef WEFT_CALIBRATION_CHARTS_GREY_ILLUMINATION_H
#define WEFT_CALIBRATION_CHARTS_GREY_ILLUMINATION_H

#include "calibration/calibration.h"
#include "calibration/charts/chart_measure.h"

/** Fewest lamps from all sides that make an even light together. */
#define WEFT_GREY_LIGHTS_MIN 4

typedef double weft_grey_irradiance[WEFT_CHART_MAX_PATCHES][3];

/**
 * Relative irradiance on each patch under each lamp.
 *
 * The lamps' differences from their geometric mean are taken patch by patch as they are.  The mean itself is
 * fitted as exp(a + g.x + quadratic) with a price on the gradient (half a chart: about 5 %) and a small one
 * on the quadratic terms (falloff and vignetting), together with the nominal reflectances.
 *
 * Measured on the virtual scanner (chips a little off neutral): greys off by 2.0 % this way, 1.8 % with the
 * true lights; a sensor with a gamma of 0.92 shows 30 % at N2 both ways.
 *
 * @param readings    [light], each [patch]
 * @param irradiance  [light]; 1 for readings that are clipped or not above 0
 */
void weft_grey_illumination(const weft_chart *chart, const weft_patch_reading *const *readings, int n_lights,
                            weft_grey_irradiance *irradiance);

#endif
