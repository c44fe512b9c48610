#include "core/plot/plot.h"

#include "core/formats/png_file.h"
#include "core/mem.h"
#include "core/plot/plot_axes.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { CHARACTER_PX = 7, LEGEND_ROW_PX = 16 };

void weft_plot_range(int n, const double *values, double *min, double *max)
{
    double low = INFINITY, high = -INFINITY;
    for (int i = 0; i < n; i++)
        if (isfinite(values[i])) {
            low = fmin(low, values[i]);
            high = fmax(high, values[i]);
        }
    if (!(low <= high))
        low = 0, high = 1;
    const double margin = high > low ? 0.05 * (high - low) : fmax(0.05 * fabs(low), 1e-6);
    *min = low - margin;
    *max = high + margin;
}

static double along(const weft_plot_axis *axis, double value)
{
    if (axis->log10)
        return log10(value / axis->min) / log10(axis->max / axis->min);
    return (value - axis->min) / (axis->max - axis->min);
}

double weft_plot_u(const weft_plot *plot, double x)
{
    return plot->left + along(&plot->spec.x, x) * (plot->right - plot->left);
}

double weft_plot_v(const weft_plot *plot, double y)
{
    const double t = along(&plot->spec.y, y);
    return plot->spec.y_down ? plot->top + t * (plot->bottom - plot->top)
                             : plot->bottom - t * (plot->bottom - plot->top);
}

static void widen(weft_plot_axis *axis, double factor)
{
    const double middle = 0.5 * (axis->min + axis->max), half = 0.5 * factor * (axis->max - axis->min);
    axis->min = middle - half;
    axis->max = middle + half;
}

static void equalise(weft_plot *p)
{
    const double x_unit = (p->right - p->left) / (p->spec.x.max - p->spec.x.min);
    const double y_unit = (p->bottom - p->top) / (p->spec.y.max - p->spec.y.min);
    if (x_unit > y_unit)
        widen(&p->spec.x, x_unit / y_unit);
    else
        widen(&p->spec.y, y_unit / x_unit);
}

/* Plots of one page have clip paths of different names: their place in the buffer. */
static void open_svg(weft_plot *p)
{
    p->clip = (int)p->out->n;
    if (p->spec.standalone)
        weft_text_add(p->out, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    weft_text_add(
        p->out,
        "<svg class=\"weft-plot\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" width=\"%d\" "
        "height=\"%d\" role=\"img\">\n",
        p->spec.width, p->spec.height, p->spec.width, p->spec.height);
    if (p->spec.title) {
        weft_text_add(p->out, "<title>");
        weft_text_add_escaped(p->out, p->spec.title);
        weft_text_add(p->out, "</title>\n");
    }
    if (p->spec.standalone)
        weft_text_add(p->out, "<style>%s</style>\n", weft_plot_style());
    weft_text_add(
        p->out,
        "<clipPath id=\"c%d\"><rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/></clipPath>\n",
        p->clip, p->left, p->top, p->right - p->left, p->bottom - p->top);
}

void weft_plot_begin(weft_plot *plot, const weft_plot_spec *spec, weft_text_buffer *out)
{
    assert(spec->x.min < spec->x.max && spec->y.min < spec->y.max);
    assert((!spec->x.log10 || spec->x.min > 0) && (!spec->y.log10 || spec->y.min > 0));
    *plot = (weft_plot){.spec = *spec, .out = out};
    plot->spec.width = spec->width ? spec->width : 460;
    plot->spec.height = spec->height ? spec->height : 300;
    plot->left = (spec->no_ticks ? 8 : 46) + (spec->y.label ? 16 : 0);
    plot->top = (spec->title ? 26 : 8) + LEGEND_ROW_PX * spec->legend_rows;
    plot->right = plot->spec.width - (spec->colour_bar ? 78 : 14);
    plot->bottom = plot->spec.height - (spec->no_ticks ? 8 : 22) - (spec->x.label ? 16 : 0);
    if (spec->same_scale)
        equalise(plot);
    open_svg(plot);
    weft_plot_draw_axes(plot);
}

static void draw_legend(const weft_plot *p)
{
    double u = p->left, v = p->top - LEGEND_ROW_PX * p->spec.legend_rows + 5;
    for (int i = 0; i < p->n_legend; i++) {
        const weft_plot_legend_entry *const e = &p->legend[i];
        const double width = 30 + CHARACTER_PX * (double)strlen(e->text);
        if (u > p->left && u + width > p->spec.width) {
            u = p->left;
            v += LEGEND_ROW_PX;
        }
        if (e->mark == 'o')
            weft_text_add(p->out, "<circle class=\"f%d\" cx=\"%.1f\" cy=\"%.1f\" r=\"3.5\"/>\n", e->series,
                          u + 10, v);
        else
            weft_text_add(p->out, "<path class=\"l%d %c\" d=\"M%.1f %.1fh18\"/>\n", e->series,
                          e->mark == 'd' ? 'd' : 'w', u, v);
        weft_text_add(p->out, "<text x=\"%.1f\" y=\"%.1f\">", u + 23, v + 4);
        weft_text_add_escaped(p->out, e->text);
        weft_text_add(p->out, "</text>\n");
        u += width;
    }
}

void weft_plot_end(weft_plot *plot)
{
    if (plot->spec.legend_rows > 0)
        draw_legend(plot);
    weft_text_add(plot->out, "</svg>\n");
}

static int colour_of(int series)
{
    return (series % WEFT_PLOT_SERIES + WEFT_PLOT_SERIES) % WEFT_PLOT_SERIES;
}

static void remember(weft_plot *p, const char *text, int series, char mark)
{
    if (!text || p->n_legend >= WEFT_PLOT_LEGEND)
        return;
    weft_plot_legend_entry *const e = &p->legend[p->n_legend++];
    snprintf(e->text, sizeof e->text, "%s", text);
    e->series = colour_of(series);
    e->mark = mark;
}

static bool shown(const weft_plot *p, double x, double y)
{
    return isfinite(x) && isfinite(y) && (!p->spec.x.log10 || x > 0) && (!p->spec.y.log10 || y > 0);
}

static void draw_line(weft_plot *p, int series, int n, const double *x, const double *y, char style)
{
    bool pen = false;
    weft_text_add(p->out, "<path class=\"l%d %c\" clip-path=\"url(#c%d)\" d=\"", colour_of(series), style,
                  p->clip);
    for (int i = 0; i < n; i++) {
        const bool there = shown(p, x[i], y[i]);
        if (there)
            weft_text_add(p->out, "%c%.2f %.2f", pen ? 'L' : 'M', weft_plot_u(p, x[i]), weft_plot_v(p, y[i]));
        pen = there;
    }
    weft_text_add(p->out, "\"/>\n");
}

void weft_plot_line(weft_plot *plot, int series, int n, const double *x, const double *y, const char *legend)
{
    draw_line(plot, series, n, x, y, 'w');
    remember(plot, legend, series, 'l');
}

void weft_plot_dashed(weft_plot *plot, int series, int n, const double *x, const double *y,
                      const char *legend)
{
    draw_line(plot, series, n, x, y, 'd');
    remember(plot, legend, series, 'd');
}

void weft_plot_dots(weft_plot *plot, int series, double radius_px, int n, const double *x, const double *y,
                    const char *legend)
{
    for (int i = 0; i < n; i++)
        weft_plot_dot(plot, series, radius_px, x[i], y[i], NULL);
    remember(plot, legend, series, 'o');
}

/* Ends an element: "/>", or with what shows when the pointer rests on it. */
static void close_with_words(weft_plot *p, const char *element, const char *words)
{
    if (!words) {
        weft_text_add(p->out, "/>\n");
        return;
    }
    weft_text_add(p->out, "><title>");
    weft_text_add_escaped(p->out, words);
    weft_text_add(p->out, "</title></%s>\n", element);
}

void weft_plot_dot(weft_plot *plot, int series, double radius_px, double x, double y, const char *words)
{
    if (!shown(plot, x, y))
        return;
    weft_text_add(plot->out,
                  "<circle class=\"f%d\" clip-path=\"url(#c%d)\" cx=\"%.2f\" cy=\"%.2f\" r=\"%.3g\"",
                  colour_of(series), plot->clip, weft_plot_u(plot, x), weft_plot_v(plot, y), radius_px);
    close_with_words(plot, "circle", words);
}

void weft_plot_stroke(weft_plot *plot, int series, double x0, double y0, double x1, double y1, bool arrow)
{
    if (!shown(plot, x0, y0) || !shown(plot, x1, y1))
        return;
    const double u0 = weft_plot_u(plot, x0), v0 = weft_plot_v(plot, y0);
    const double u1 = weft_plot_u(plot, x1), v1 = weft_plot_v(plot, y1);
    weft_text_add(plot->out, "<path class=\"l%d\" clip-path=\"url(#c%d)\" d=\"M%.2f %.2fL%.2f %.2f",
                  colour_of(series), plot->clip, u0, v0, u1, v1);
    const double length = hypot(u1 - u0, v1 - v0);
    if (arrow && length > 0) {
        const double head = fmin(5, 0.5 * length), cu = head * (u1 - u0) / length,
                     cv = head * (v1 - v0) / length;
        weft_text_add(plot->out, "M%.2f %.2fL%.2f %.2fL%.2f %.2f", u1 - cu - 0.5 * cv, v1 - cv + 0.5 * cu, u1,
                      v1, u1 - cu + 0.5 * cv, v1 - cv - 0.5 * cu);
    }
    weft_text_add(plot->out, "\"/>\n");
}

void weft_plot_circle(weft_plot *plot, int series, double x, double y, double radius)
{
    const double r = fabs(weft_plot_u(plot, x + radius) - weft_plot_u(plot, x));
    if (shown(plot, x, y) && isfinite(r))
        weft_text_add(
            plot->out,
            "<circle class=\"l%d w\" clip-path=\"url(#c%d)\" cx=\"%.2f\" cy=\"%.2f\" r=\"%.2f\"/>\n",
            colour_of(series), plot->clip, weft_plot_u(plot, x), weft_plot_v(plot, y), r);
}

void weft_plot_box(weft_plot *plot, int series, const char *colour, double x0, double y0, double x1,
                   double y1, const char *words)
{
    if (!shown(plot, x0, y0) || !shown(plot, x1, y1))
        return;
    const double u0 = weft_plot_u(plot, x0), u1 = weft_plot_u(plot, x1);
    const double v0 = weft_plot_v(plot, y0), v1 = weft_plot_v(plot, y1);
    weft_text_add(plot->out,
                  "<rect clip-path=\"url(#c%d)\" x=\"%.2f\" y=\"%.2f\" width=\"%.2f\" height=\"%.2f\"",
                  plot->clip, fmin(u0, u1), fmin(v0, v1), fabs(u1 - u0), fabs(v1 - v0));
    if (colour)
        weft_text_add(plot->out, " fill=\"%s\"", colour);
    else
        weft_text_add(plot->out, " class=\"f%d\"", colour_of(series));
    close_with_words(plot, "rect", words);
}

void weft_plot_words(weft_plot *plot, double x, double y, double du, double dv, const char *words)
{
    if (!shown(plot, x, y))
        return;
    weft_text_add(plot->out, "<text x=\"%.1f\" y=\"%.1f\">", weft_plot_u(plot, x) + du,
                  weft_plot_v(plot, y) + dv);
    weft_text_add_escaped(plot->out, words);
    weft_text_add(plot->out, "</text>\n");
}

/* ---- false colour ---- */

static void add_picture(weft_plot *p, const weft_raster *raster, double u, double v, double width,
                        double height)
{
    weft_text_buffer png = {0};
    weft_text_add(p->out,
                  "<image x=\"%.2f\" y=\"%.2f\" width=\"%.2f\" height=\"%.2f\" preserveAspectRatio=\"none\" "
                  "href=\"data:image/png;base64,",
                  u, v, width, height);
    if (weft_png_encode(raster, &png) == WEFT_OK)
        weft_text_add_base64(p->out, png.text, png.n);
    else if (p->out->failure.code == WEFT_OK)
        p->out->failure = png.failure;
    weft_text_add(p->out, "\"/>\n");
    weft_text_buffer_fini(&png);
}

static void paint(weft_raster *raster, size_t at, weft_colour_map map, double t)
{
    double rgb[3];
    weft_colour_map_get(map, t, rgb);
    for (size_t c = 0; c < 3; c++)
        raster->data[4 * at + c] = (uint16_t)lround(255 * rgb[c]);
    raster->data[4 * at + 3] = isnan(t) ? 0 : 255;
}

static void draw_scale(weft_plot *p, double low, double high, weft_colour_map map, const char *words)
{
    enum { STEPS = 64 };
    weft_raster bar;
    if (weft_raster_init(&bar, 1, STEPS, 4, 8, &p->out->failure) != WEFT_OK)
        return;
    for (size_t i = 0; i < STEPS; i++)
        paint(&bar, i, map, 1 - ((double)i + 0.5) / STEPS);
    const double u = p->right + 10, height = p->bottom - p->top;
    add_picture(p, &bar, u, p->top, 12, height);
    weft_raster_fini(&bar);
    double ticks[40];
    const weft_plot_axis axis = {NULL, low, high, false};
    const int n = weft_plot_ticks(&axis, (int)fmax(height / 40, 2), ticks);
    for (int i = 0; i < n; i++)
        weft_text_add(p->out, "<text class=\"n\" x=\"%.1f\" y=\"%.1f\">%.4g</text>\n", u + 16,
                      p->bottom - (ticks[i] - low) / (high - low) * height + 4, ticks[i]);
    if (!words)
        return;
    weft_text_add(p->out, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"end\">", p->spec.width - 4.0,
                  p->top - 6);
    weft_text_add_escaped(p->out, words);
    weft_text_add(p->out, "</text>\n");
}

void weft_plot_heat(weft_plot *plot, const weft_image *image, int plane, double x0, double y0, double x1,
                    double y1, double low, double high, weft_colour_map map, const char *words)
{
    weft_raster raster;
    const double top = high > low ? high : low + 1;
    if (plot->out->failure.code != WEFT_OK ||
        weft_raster_init(&raster, image->width, image->height, 4, 8, &plot->out->failure) != WEFT_OK)
        return;
    const float *const values = weft_image_plane(image, plane);
    const double u0 = weft_plot_u(plot, x0), u1 = weft_plot_u(plot, x1);
    const double v0 = weft_plot_v(plot, y0), v1 = weft_plot_v(plot, y1);
    for (int row = 0; row < image->height;
         row++) /* turned so that it can be drawn from its left upper corner */
        for (int column = 0; column < image->width; column++) {
            const size_t from = (size_t)row * (size_t)image->width + (size_t)column;
            const int r = v1 < v0 ? image->height - 1 - row : row,
                      c = u1 < u0 ? image->width - 1 - column : column;
            paint(&raster, (size_t)r * (size_t)image->width + (size_t)c, map,
                  ((double)values[from] - low) / (top - low));
        }
    add_picture(plot, &raster, fmin(u0, u1), fmin(v0, v1), fabs(u1 - u0), fabs(v1 - v0));
    weft_raster_fini(&raster);
    if (plot->spec.colour_bar)
        draw_scale(plot, low, top, map, words);
}
