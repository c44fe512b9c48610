/** Inside of the plot writer: what frames the data. */
#ifndef WEFT_CORE_PLOT_PLOT_AXES_H
#define WEFT_CORE_PLOT_PLOT_AXES_H

#include "core/plot/plot.h"

/** Round values along an axis, about `wanted` of them.  @param ticks  room for 40  @return how many */
int weft_plot_ticks(const weft_plot_axis *axis, int wanted, double *ticks);

/** Grid, numbers, frame, title and labels. */
void weft_plot_draw_axes(const weft_plot *plot);

#endif
