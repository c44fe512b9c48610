/** Which patch is which: judged by the reference colours. */
#ifndef WEFT_CALIBRATION_CHARTS_CHART_ORDER_H
#define WEFT_CALIBRATION_CHARTS_CHART_ORDER_H

#include "calibration/charts/chart.h"
#include "core/image.h"
#include "core/linalg.h"

#include <stdbool.h>

/** Mean R, G, B in the middle of every patch. */
typedef struct weft_chart_colours {
    double rgb[WEFT_CHART_MAX_PATCHES][3];
} weft_chart_colours;

/** Reads the patches from reduced cells through a map from chart mm to cells.  False when a patch lies
 * outside. */
bool weft_chart_colours_read(const weft_chart *chart, const weft_image *cells, const weft_mat3 *to_cell,
                             weft_chart_colours *colours);

/**
 * How well the reference explains the colours: 1 - (unexplained + price of the gradient) / variance, of the
 * logarithms.
 *
 * Each channel of the camera may be any mixture of the reference's three (cameras and lamps differ), and the
 * light may have a gradient over the chart, which is paid for: a grey scale read backwards is a steep
 * gradient too.  1 is perfect, 0 is nothing, negative is worse.
 */
double weft_chart_score(const weft_chart *chart, const weft_chart_colours *colours);

/**
 * Whether the chart's neutral patches (munsell_value > 0) get darker in the order of their values, after the
 * gradient found by the score is taken out.  On false `*first` and `*second` are the pair out of order.
 */
bool weft_chart_greys_in_order(const weft_chart *chart, const weft_chart_colours *colours, int *first,
                               int *second);

#endif
