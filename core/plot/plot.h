/**
 * Plots as SVG: axes, lines, dots, false-colour pictures, a legend.
 *
 * Written straight into a text buffer, mark by mark, in the units of the data.  Inline in a page, or a file
 * of its own (`standalone`).  Readable on light and dark paper: colours follow the reader's scheme; the eight
 * series colours are those of Okabe and Ito, which colour-blind readers can tell apart.
 *
 *     weft_plot plot;
 *     const weft_plot_spec spec = {.title = "Falloff", .x = {"mm", -80, 80, false}, .y = {"gain", 0.9, 1.1,
 * false}}; weft_plot_begin(&plot, &spec, &buffer); weft_plot_line(&plot, 0, n, x, y, "light 0");
 *     weft_plot_end(&plot);
 *
 * All text is escaped.  Values that are not finite are left out (a line breaks there); what lies outside the
 * axes is clipped.  Failures stick in the buffer (core/text_buffer.h).
 */
#ifndef WEFT_CORE_PLOT_PLOT_H
#define WEFT_CORE_PLOT_PLOT_H

#include "core/colour_map.h"
#include "core/image.h"
#include "core/text_buffer.h"

#include <stdbool.h>

#define WEFT_PLOT_SERIES 8 /* colours; a higher series begins again */
#define WEFT_PLOT_LEGEND 16

typedef struct weft_plot_axis {
    const char *label; /* with the unit; NULL: none */
    double min, max;   /* of the data shown; min < max, above 0 for log10 */
    bool log10;
} weft_plot_axis;

typedef struct weft_plot_spec {
    const char *title; /* above the plot, and for screen readers; NULL: none */
    int width, height; /* of the whole, px; 0: 460 x 300 */
    weft_plot_axis x, y;
    bool y_down;     /* y grows downwards, as rows of a picture do */
    bool same_scale; /* a unit is as long on both axes: the shorter range is widened */
    bool no_ticks;   /* neither numbers nor grid */
    int legend_rows; /* lines kept free below the title for the legend; 0: no legend */
    bool colour_bar; /* room at the right for weft_plot_heat()'s scale */
    bool standalone; /* an SVG file of its own, with its style inside */
} weft_plot_spec;

typedef struct weft_plot_legend_entry {
    char text[64];
    int series;
    char mark; /* 'l' line, 'd' dashed line, 'o' dot */
} weft_plot_legend_entry;

/** A plot under way; the members are the writer's own. */
typedef struct weft_plot {
    weft_plot_spec spec;
    weft_text_buffer *out;
    double left, top, right, bottom; /* of the axes, px */
    int n_legend;
    weft_plot_legend_entry legend[WEFT_PLOT_LEGEND];
    int clip; /* number of this plot's clip path, unique in the buffer */
} weft_plot;

/** Range with a margin of 5 % around values; those that are not finite are disregarded.  Never empty. */
void weft_plot_range(int n, const double *values, double *min, double *max);

/** Begins: frame, grid, ticks, labels. */
void weft_plot_begin(weft_plot *plot, const weft_plot_spec *spec, weft_text_buffer *out);
/** Ends: legend, closing tags. */
void weft_plot_end(weft_plot *plot);

/** Where data coordinates lie in the SVG, px. */
double weft_plot_u(const weft_plot *plot, double x);
double weft_plot_v(const weft_plot *plot, double y);

/** A line through points.  @param legend  NULL: not in the legend, nor when that is full */
void weft_plot_line(weft_plot *plot, int series, int n, const double *x, const double *y, const char *legend);
void weft_plot_dashed(weft_plot *plot, int series, int n, const double *x, const double *y,
                      const char *legend);
/** Dots of `radius_px`. */
void weft_plot_dots(weft_plot *plot, int series, double radius_px, int n, const double *x, const double *y,
                    const char *legend);
/** One dot; `words` show when the pointer rests on it (NULL: none). */
void weft_plot_dot(weft_plot *plot, int series, double radius_px, double x, double y, const char *words);
/** A straight stroke, with an arrow head at the end when asked. */
void weft_plot_stroke(weft_plot *plot, int series, double x0, double y0, double x1, double y1, bool arrow);
/** A circle in the units of x, not filled; for plots of the same scale. */
void weft_plot_circle(weft_plot *plot, int series, double x, double y, double radius);
/** A filled rectangle: `colour` as "#rrggbb", or NULL for the colour of the series. */
void weft_plot_box(weft_plot *plot, int series, const char *colour, double x0, double y0, double x1,
                   double y1, const char *words);
/** Words beginning at a point, `du`, `dv` px off. */
void weft_plot_words(weft_plot *plot, double x, double y, double du, double dv, const char *words);

/**
 * One plane in false colour between two corners of the data, with the scale at the right (spec.colour_bar).
 *
 * @param plane   plane of the image; row 0 at y0, column 0 at x0; NaN is left transparent
 * @param low,high  ends of the scale
 * @param words   beside the scale, with the unit
 */
void weft_plot_heat(weft_plot *plot, const weft_image *image, int plane, double x0, double y0, double x1,
                    double y1, double low, double high, weft_colour_map map, const char *words);

/** The style of all plots, for the <style> of a page with inline plots. */
const char *weft_plot_style(void);

#endif
