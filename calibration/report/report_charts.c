/* Charts: the Munsell line, noise, white, and the colour chart with the error of each patch. */
#include "calibration/calibration_report.h"
#include "calibration/charts/chart.h"
#include "calibration/report/report_parts.h"
#include "core/colour.h"

#include <stdio.h>

static const char *const site_names[4] = {"red", "green 1", "green 2", "blue"};
static const int site_series[4] = {1, 2, 6, 0};

/* ---- linearity ---- */

static void plot_line(const json_t *greys, weft_text_buffer *page)
{
    enum { MOST = WEFT_CHART_MAX_PATCHES };
    double x[MOST], y[4][MOST], ones[2] = {0.01, 1};
    const int n = json_array_size(greys) < MOST ? (int)json_array_size(greys) : MOST;
    weft_plot plot;
    for (int i = 0; i < n; i++) {
        const json_t *const grey = json_array_get(greys, (size_t)i);
        x[i] = weft_report_number(grey, "reflectance");
        for (size_t s = 0; s < 4; s++)
            y[s][i] = x[i] * (1 + weft_report_item(json_object_get(grey, "deviation"), s));
    }
    const weft_plot_spec spec = {.title = "The Munsell line",
                                 .x = {"reflectance of the chip", 0.02, 1, true},
                                 .y = {"what the sensor makes of it", 0.02, 1, true},
                                 .legend_rows = 1};
    weft_report_figure_begin(page);
    weft_plot_begin(&plot, &spec, page);
    weft_plot_dashed(&plot, 7, 2, ones, ones, NULL);
    for (int s = 0; s < 4; s++)
        weft_plot_dots(&plot, site_series[s], 3, n, x, y[s], site_names[s]);
    weft_plot_end(&plot);
    weft_report_figure_end(
        page, "Mean over the lights, each divided by its slope and by the light on the chip. On the "
              "dashed line the sensor is linear; a bend is a gamma.");
}

static void plot_deviation(const json_t *greys, weft_text_buffer *page)
{
    enum { MOST = WEFT_CHART_MAX_PATCHES };
    double x[MOST], y[4][MOST], most = 5;
    const int n = json_array_size(greys) < MOST ? (int)json_array_size(greys) : MOST;
    weft_plot plot;
    for (int i = 0; i < n; i++) {
        const json_t *const grey = json_array_get(greys, (size_t)i);
        x[i] = weft_report_number(grey, "reflectance");
        for (size_t s = 0; s < 4; s++) {
            y[s][i] = 100 * weft_report_item(json_object_get(grey, "deviation"), s);
            if (isfinite(y[s][i]))
                most = fmax(most, 1.1 * fabs(y[s][i]));
        }
    }
    const weft_plot_spec spec = {.title = "Off the line",
                                 .x = {"reflectance of the chip", 0.02, 1, true},
                                 .y = {"%", -most, most, false},
                                 .legend_rows = 1};
    const double ends[2] = {0.02, 1}, above[2] = {5, 5}, below[2] = {-5, -5};
    weft_report_figure_begin(page);
    weft_plot_begin(&plot, &spec, page);
    weft_plot_dashed(&plot, 7, 2, ends, above, NULL);
    weft_plot_dashed(&plot, 7, 2, ends, below, NULL);
    for (int s = 0; s < 4; s++)
        weft_plot_dots(&plot, site_series[s], 3, n, x, y[s], site_names[s]);
    weft_plot_end(&plot);
    weft_report_figure_end(page, "Dashed: what the nominal values of the chips allow (10 % below N4).");
}

/* Level over black and variance of a class of photosites. */
static int noise_points(const json_t *class, double *x, double *y, int room)
{
    const json_t *const levels = json_object_get(class, "level_dn");
    const json_t *const variances = json_object_get(class, "variance_dn2");
    int n = 0;
    for (size_t i = 0; i < json_array_size(levels) && n < room; i++) {
        x[n] = weft_report_item(levels, i);
        y[n] = weft_report_item(variances, i);
        n += x[n] > 0 && y[n] > 0;
    }
    return n;
}

/* What was fitted: read noise, shot noise, fixed pattern, and the rounding to whole DN. */
static double fitted_variance(const json_t *class, double level)
{
    const double gain = weft_report_number(class, "gain_e_per_dn");
    const double read = weft_report_number(class, "read_noise_e") / gain;
    const double pattern = weft_report_number(class, "fixed_pattern");
    return read * read + level / gain + (isnan(pattern) ? 0 : pattern * pattern * level * level) + 1 / 12.0;
}

static void plot_noise(const json_t *channels, weft_text_buffer *page)
{
    enum { MOST = 512 };
    double x[MOST], y[MOST], low[2] = {INFINITY, INFINITY}, high[2] = {0, 0};
    const int n_channels = json_array_size(channels) < 4 ? (int)json_array_size(channels) : 4;
    for (int c = 0; c < n_channels; c++) {
        const int n = noise_points(json_array_get(channels, (size_t)c), x, y, MOST);
        for (int i = 0; i < n; i++) {
            low[0] = fmin(low[0], x[i]), high[0] = fmax(high[0], x[i]);
            low[1] = fmin(low[1], y[i]), high[1] = fmax(high[1], y[i]);
        }
    }
    if (!(high[0] > 0)) {
        weft_report_absent(page, "There are no points of the noise curve in the calibration.", NULL);
        return;
    }
    weft_plot plot;
    const weft_plot_spec spec = {.title = "Noise",
                                 .x = {"signal over black, DN", low[0] / 1.3, high[0] * 1.3, true},
                                 .y = {"variance, DN^2", low[1] / 1.5, high[1] * 1.5, true},
                                 .legend_rows = 1};
    weft_report_figure_begin(page);
    weft_plot_begin(&plot, &spec, page);
    for (int c = 0; c < n_channels; c++) {
        const json_t *const channel = json_array_get(channels, (size_t)c);
        const int n = noise_points(channel, x, y, MOST);
        weft_plot_dots(&plot, site_series[c], 2.5, n, x, y, site_names[c]);
        for (int i = 0; i < 60; i++) {
            x[i] = low[0] * pow(high[0] / low[0], i / 59.0);
            y[i] = fitted_variance(channel, x[i]);
        }
        weft_plot_line(&plot, site_series[c], 60, x, y, NULL);
    }
    weft_plot_end(&plot);
    weft_report_figure_end(
        page, "Variance of a photosite against its signal, and the sum of read noise, shot noise and "
              "fixed pattern that was fitted to it.");
}

static void noise_table(const json_t *channels, weft_text_buffer *page)
{
    static const char *const keys[] = {"black_dn", "gain_e_per_dn", "gain_sigma", "read_noise_e"};
    weft_text_add(page,
                  "<table><tr><th>photosites</th><th>black, DN</th><th>gain, e-/DN</th><th>&plusmn;</th>"
                  "<th>read noise, e-</th><th>fixed pattern, %%</th><th>saturates at, DN</th></tr>\n");
    for (size_t c = 0; c < json_array_size(channels) && c < 4; c++) {
        const json_t *const one = json_array_get(channels, c);
        weft_text_add(page, "<tr><td>%s</td>", site_names[c]);
        for (int k = 0; k < 4; k++)
            weft_report_cell(page, k == 0 ? 1 : 3, weft_report_number(one, keys[k]));
        weft_report_cell(page, 2, 100 * weft_report_number(one, "fixed_pattern"));
        weft_report_cell(page, 0, weft_report_number(one, "saturation_dn"));
        weft_text_add(page, "</tr>\n");
    }
    weft_text_add(page, "</table>\n");
}

void weft_report_linearity(const weft_calibration *cal, weft_text_buffer *page)
{
    const json_t *const report = weft_calibration_get_report(cal, "linearity");
    const json_t *const greys = json_object_get(report, "greys");
    const json_t *const noise = json_object_get(report, "noise");
    weft_text_add(page, "<h2>Linearity and noise</h2>\n");
    if (!cal->has_linearity) {
        weft_report_absent(page, "Not checked: ", "weft calibrate linearity munsell.set -o CAL");
    } else {
        weft_text_add(page, "<p>Linear from %.3f to %.3f of the range, within %.2f %%; light %s.</p>\n",
                      cal->linearity.range[0], cal->linearity.range[1], 100 * cal->linearity.max_deviation,
                      weft_report_text(report, "illumination"));
        if (json_array_size(greys) > 0) {
            plot_line(greys, page);
            plot_deviation(greys, page);
        } else
            weft_report_absent(page,
                               "The greys were not kept: the Munsell line cannot be drawn. They are kept by",
                               "weft calibrate linearity munsell.set -o CAL --force");
    }
    if (json_array_size(noise) == 0) {
        weft_report_absent(page, "The noise of the sensor has not been measured.", NULL);
        return;
    }
    noise_table(noise, page);
    plot_noise(noise, page);
}

/* ---- white ---- */

void weft_report_white(const weft_calibration *cal, weft_text_buffer *page)
{
    const json_t *const lights = json_object_get(weft_calibration_get_report(cal, "white"), "lights");
    weft_text_add(page, "<h2>White balance</h2>\n");
    if (!cal->has_lights) {
        weft_report_absent(page, "There are no lights to balance.", NULL);
        return;
    }
    double values[3 * WEFT_LIGHTS_MAX], x[WEFT_LIGHTS_MAX], low, high;
    double gains[3][WEFT_LIGHTS_MAX];
    for (int l = 0; l < cal->n_lights; l++) {
        x[l] = l;
        for (int c = 0; c < 3; c++)
            values[3 * l + c] = gains[c][l] = cal->lights[l].white_balance[c];
    }
    weft_plot_range(3 * cal->n_lights, values, &low, &high);
    weft_plot plot;
    const weft_plot_spec spec = {.title = "Gains of each light",
                                 .x = {"light", -0.5, cal->n_lights - 0.5, false},
                                 .y = {"gain, green is 1", low, high, false},
                                 .legend_rows = 1};
    weft_report_figure_begin(page);
    weft_plot_begin(&plot, &spec, page);
    weft_plot_dots(&plot, 1, 4, cal->n_lights, x, gains[0], "red");
    weft_plot_dots(&plot, 2, 4, cal->n_lights, x, gains[1], "green");
    weft_plot_dots(&plot, 0, 4, cal->n_lights, x, gains[2], "blue");
    weft_plot_end(&plot);
    weft_report_figure_end(
        page, json_array_size(lights) > 0
                  ? "By the grey chart. Lamps of one bin differ by some percent; one that stands apart is "
                    "of another bin, or ageing."
                  : "By the white sheet; no grey chart has checked it. Lamps of one bin differ by some "
                    "percent; one that stands apart is of another bin, or ageing.");
}

/* ---- colour ---- */

static void hex_of(const double rgb[3], char text[8])
{
    snprintf(text, 8, "#%02x%02x%02x", (unsigned)weft_srgb_encode8(rgb[0]) & 0xff,
             (unsigned)weft_srgb_encode8(rgb[1]) & 0xff, (unsigned)weft_srgb_encode8(rgb[2]) & 0xff);
}

static void numbers(const json_t *patch, const char *key, double v[3])
{
    for (size_t c = 0; c < 3; c++)
        v[c] = weft_report_item(json_object_get(patch, key), c);
}

/* One patch: its colour as it should be, in it the colour that the calibration makes, and the error held out.
 */
static void draw_patch(weft_plot *plot, const weft_colour_model *model, const json_t *patch, double x,
                       double y)
{
    double camera[3], reference[3], seen[3];
    char wanted[8], got[8], words[160], figure[40];
    const double error = weft_report_number(patch, "held_out");
    const char *const excluded = weft_report_text(patch, "excluded");
    numbers(patch, "camera", camera);
    numbers(patch, "reference", reference);
    weft_colour_model_apply(model, camera, seen);
    hex_of(reference, wanted);
    hex_of(seen, got);
    snprintf(words, sizeof words, "%s: held out %.2f, trained %.2f, before %.2f%s%s",
             weft_report_text(patch, "name"), error, weft_report_number(patch, "trained"),
             weft_report_number(patch, "before"), excluded[0] ? ", left out: " : "", excluded);
    weft_plot_box(plot, 0, wanted, x, y, x + 0.92, y + 0.92, words);
    weft_plot_box(plot, 0, got, x + 0.24, y + 0.1, x + 0.68, y + 0.5, words);
    snprintf(figure, sizeof figure, excluded[0] ? "(%.1f)" : "%.1f", error);
    weft_plot_box(plot, 0, "#ffffff", x + 0.26, y + 0.62, x + 0.66, y + 0.86, NULL);
    weft_text_add(plot->out,
                  "<text style=\"fill:#000\" text-anchor=\"middle\" x=\"%.1f\" y=\"%.1f\">%s</text>\n",
                  weft_plot_u(plot, x + 0.46), weft_plot_v(plot, y + 0.74) + 4, figure);
}

static void plot_chart(const weft_calibration *cal, const json_t *report, weft_text_buffer *page)
{
    const json_t *const patches = json_object_get(report, "patches");
    const weft_chart *chart;
    if (weft_chart_find(weft_report_text(report, "chart"), weft_report_text(report, "edition"), &chart,
                        NULL) != WEFT_OK ||
        (int)json_array_size(patches) != chart->columns * chart->rows)
        return;
    weft_plot plot;
    const weft_plot_spec spec = {.title = "The chart",
                                 .width = 520,
                                 .height = 34 + 500 * chart->rows / chart->columns,
                                 .x = {NULL, -0.05, chart->columns, false},
                                 .y = {NULL, -0.05, chart->rows, false},
                                 .y_down = true,
                                 .no_ticks = true};
    weft_report_figure_begin(page);
    weft_plot_begin(&plot, &spec, page);
    for (int p = 0; p < chart->columns * chart->rows; p++) {
        const int column = p % chart->columns, row = p / chart->columns;
        draw_patch(&plot, &cal->colour.model, json_array_get(patches, (size_t)p), column, row);
    }
    weft_plot_end(&plot);
    weft_report_figure_end(
        page, "Outside the colour as it should be, inside as it comes out, below it CIEDE2000 of the patch "
              "when a fit has not seen it; in brackets: left out. Names show under the pointer.");
}

static void plot_errors(const json_t *patches, weft_text_buffer *page)
{
    enum { MOST = WEFT_CHART_MAX_PATCHES };
    const int n = json_array_size(patches) < MOST ? (int)json_array_size(patches) : MOST;
    double most = 1;
    for (int i = 0; i < n; i++)
        most = fmax(most, weft_report_number(json_array_get(patches, (size_t)i), "held_out"));
    weft_plot plot;
    const weft_plot_spec spec = {.title = "Error of each patch",
                                 .width = 480,
                                 .x = {"patch", 0.5, n + 0.5, false},
                                 .y = {"CIEDE2000", 0, 1.1 * most, false},
                                 .legend_rows = 1};
    double x[MOST], trained[MOST], held[MOST];
    weft_report_figure_begin(page);
    weft_plot_begin(&plot, &spec, page);
    for (int i = 0; i < n; i++) {
        const json_t *const patch = json_array_get(patches, (size_t)i);
        x[i] = i + 1;
        trained[i] = weft_report_number(patch, "trained");
        held[i] = weft_report_number(patch, "held_out");
        weft_plot_stroke(&plot, 7, x[i], trained[i], x[i], held[i], false);
    }
    weft_plot_dots(&plot, 0, 3.5, n, x, trained, "trained");
    weft_plot_dots(&plot, 1, 3.5, n, x, held, "held out");
    weft_plot_end(&plot);
    weft_report_figure_end(page, "Far apart: the fit hangs on this patch.");
}

void weft_report_colour(const weft_calibration *cal, weft_text_buffer *page)
{
    const json_t *const report = weft_calibration_get_report(cal, "colour");
    weft_text_add(page, "<h2>Colour</h2>\n");
    if (!cal->has_colour) {
        weft_report_absent(page, "There is no colour: ", "weft calibrate colour macbeth.set -o CAL");
        return;
    }
    const weft_colour_part *const c = &cal->colour;
    weft_text_add(page, "<p>");
    weft_text_add_escaped(page, weft_report_text(report, "chart"));
    weft_text_add(page, " ");
    weft_text_add_escaped(page, weft_report_text(report, "edition"));
    weft_text_add(
        page, ", method %s: CIEDE2000 trained %.2f in the mean and %.2f at most, held out %.2f in the mean",
        weft_colour_method_name(c->model.method), c->delta_e_mean, c->delta_e_max, c->delta_e_held_out_mean);
    if (!isnan(weft_report_number(report, "before_mean")))
        weft_text_add(page, "; before %.2f; condition %.0f", weft_report_number(report, "before_mean"),
                      weft_report_number(report, "condition"));
    weft_text_add(page, ".</p>\n");
    if (json_array_size(json_object_get(report, "patches")) == 0) {
        weft_report_absent(page, "The patches were not kept.", NULL);
        return;
    }
    plot_chart(cal, report, page);
    plot_errors(json_object_get(report, "patches"), page);
}
