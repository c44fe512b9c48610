/* Lens and pose: where corners were seen, how far they are off, which parts of the frame were reached. */
#include "calibration/calibration_report.h"
#include "calibration/report/report_parts.h"

#include <stdio.h>

enum { COVER_COLUMNS = 16, COVER_ROWS = 12 };

/* Four numbers a corner: u, v, du, dv. */
static size_t n_corners(const json_t *view)
{
    return json_array_size(json_object_get(view, "corners")) / 4;
}

static void corner(const json_t *view, size_t i, double c[4])
{
    for (size_t k = 0; k < 4; k++)
        c[k] = weft_report_item(json_object_get(view, "corners"), 4 * i + k);
}

static weft_plot_spec frame_spec(const weft_camera *camera, const char *title)
{
    const double ratio = (double)camera->height / camera->width;
    return (weft_plot_spec){.title = title,
                            .width = 470,
                            .height = 84 + (int)(396 * ratio),
                            .x = {"u, px", 0, camera->width, false},
                            .y = {"v, px", 0, camera->height, false},
                            .y_down = true};
}

/* Every residual as a stroke, so long that the usual one can be seen. */
static void plot_residuals(const weft_calibration *cal, const json_t *views, weft_text_buffer *page)
{
    char words[200];
    weft_plot plot;
    const weft_plot_spec spec = frame_spec(&cal->camera, "Residuals of the corners");
    const double longer = 0.02 * cal->camera.width / fmax(cal->camera.rms_px, 1e-3);
    weft_report_figure_begin(page);
    weft_plot_begin(&plot, &spec, page);
    for (size_t k = 0; k < json_array_size(views); k++)
        for (size_t i = 0; i < n_corners(json_array_get(views, k)); i++) {
            double c[4];
            corner(json_array_get(views, k), i, c);
            weft_plot_stroke(&plot, (int)k, c[0], c[1], c[0] + longer * c[2], c[1] + longer * c[3], false);
            weft_plot_dot(&plot, (int)k, 1, c[0], c[1], NULL);
        }
    weft_plot_end(&plot);
    snprintf(words, sizeof words,
             "From where each corner should be to where it was seen, %.0f times as long; a colour a picture. "
             "They should "
             "point anywhere: a pattern is a lens the model does not fit, or a bent board.",
             longer);
    weft_report_figure_end(page, words);
}

static void plot_scatter(const weft_calibration *cal, const json_t *views, weft_text_buffer *page)
{
    const double reach = fmax(4 * cal->camera.rms_px, 1e-3);
    weft_plot plot;
    const weft_plot_spec spec = {.title = "The same, one upon another",
                                 .width = 340,
                                 .height = 348,
                                 .x = {"du, px", -reach, reach, false},
                                 .y = {"dv, px", -reach, reach, false},
                                 .same_scale = true,
                                 .y_down = true};
    weft_report_figure_begin(page);
    weft_plot_begin(&plot, &spec, page);
    for (size_t k = 0; k < json_array_size(views); k++)
        for (size_t i = 0; i < n_corners(json_array_get(views, k)); i++) {
            double c[4];
            corner(json_array_get(views, k), i, c);
            weft_plot_dot(&plot, (int)k, 1.3, c[2], c[3], NULL);
        }
    weft_plot_circle(&plot, 7, 0, 0, cal->camera.rms_px);
    weft_plot_end(&plot);
    weft_report_figure_end(page, "The circle is the rms.");
}

static void plot_coverage(const weft_calibration *cal, const json_t *views, weft_text_buffer *page)
{
    weft_image count;
    weft_plot plot;
    weft_plot_spec spec = frame_spec(&cal->camera, "Where boards were");
    double most = 1;
    if (weft_image_init(&count, COVER_COLUMNS, COVER_ROWS, 1, &page->failure) != WEFT_OK)
        return;
    for (size_t k = 0; k < json_array_size(views); k++)
        for (size_t i = 0; i < n_corners(json_array_get(views, k)); i++) {
            double c[4];
            corner(json_array_get(views, k), i, c);
            const int column = (int)(c[0] / cal->camera.width * COVER_COLUMNS);
            const int row = (int)(c[1] / cal->camera.height * COVER_ROWS);
            if (column < 0 || row < 0 || column >= COVER_COLUMNS || row >= COVER_ROWS)
                continue;
            float *const cell = weft_image_row(&count, 0, row) + column;
            most = fmax(most, (double)++*cell);
        }
    for (int i = 0; i < COVER_COLUMNS * COVER_ROWS; i++)
        if (count.data[i] < 0.5F)
            count.data[i] = NAN; /* nothing there: no colour */
    spec.width = 540;
    spec.colour_bar = true;
    weft_report_figure_begin(page);
    weft_plot_begin(&plot, &spec, page);
    weft_plot_heat(&plot, &count, 0, 0, 0, cal->camera.width, cal->camera.height, 0, most, WEFT_MAP_VIRIDIS,
                   "corners");
    weft_plot_end(&plot);
    weft_report_figure_end(
        page, "Corners of all pictures in each part of the frame. In the empty parts the lens is "
              "extrapolated.");
    weft_image_fini(&count);
}

static void plot_views(const json_t *views, double rms, weft_text_buffer *page)
{
    const size_t n = json_array_size(views);
    double most = rms;
    weft_plot plot;
    for (size_t i = 0; i < n; i++)
        most = fmax(most, weft_report_number(json_array_get(views, i), "rms_px"));
    const weft_plot_spec spec = {.title = "Error of each picture",
                                 .x = {"picture", -0.5, (double)n - 0.5, false},
                                 .y = {"rms, px", 0, 1.1 * fmax(most, 1e-6), false}};
    weft_report_figure_begin(page);
    weft_plot_begin(&plot, &spec, page);
    for (size_t i = 0; i < n; i++) {
        const json_t *const view = json_array_get(views, i);
        const bool used = json_is_true(json_object_get(view, "used"));
        weft_plot_box(&plot, used ? 0 : 1, NULL, (double)i - 0.35, 0, (double)i + 0.35,
                      weft_report_number(view, "rms_px"), weft_report_text(view, "image"));
    }
    weft_plot_dashed(&plot, 7, 2, (const double[]){-0.5, (double)n - 0.5}, (const double[]){rms, rms}, NULL);
    weft_plot_end(&plot);
    weft_report_figure_end(
        page, "Dashed: all together. In the second colour: left out. The name shows under the pointer.");
}

static void row(weft_text_buffer *page, const char *name, double value, double sigma, const char *unit)
{
    weft_text_add(page, "<tr><td>%s</td><td class=\"n\">%.6g</td><td class=\"n\">", name, value);
    if (isnan(sigma))
        weft_text_add(page, "</td>");
    else
        weft_text_add(page, "&plusmn; %.2g</td>", sigma);
    weft_text_add(page, "<td>%s</td></tr>\n", unit);
}

static void table(const weft_camera *c, const json_t *lens, weft_text_buffer *page)
{
    static const char *const names[WEFT_DISTORTION] = {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
    const json_t *const sigma = json_object_get(lens, "sigma"), *const bent =
                                                                    json_object_get(sigma, "distortion");
    weft_text_add(page, "<table>\n");
    row(page, "fx", c->fx, weft_report_number(sigma, "fx"), "px");
    row(page, "fy", c->fy, weft_report_number(sigma, "fy"), "px");
    row(page, "cx", c->cx, weft_report_number(sigma, "cx"), "px");
    row(page, "cy", c->cy, weft_report_number(sigma, "cy"), "px");
    for (size_t i = 0; i < WEFT_DISTORTION; i++)
        if (i < 5 || c->distortion[i] != 0)
            row(page, names[i], c->distortion[i], weft_report_item(bent, i), "");
    row(page, "rms", c->rms_px, (double)NAN, "px");
    if (!isnan(weft_report_number(lens, "held_out_px")))
        row(page, "held out", weft_report_number(lens, "held_out_px"), (double)NAN, "px");
    weft_text_add(page, "</table>\n");
}

/* The models that were tried; the one with the least held-out error was taken. */
static void tried_table(const json_t *lens, weft_text_buffer *page)
{
    const json_t *const tried = json_object_get(lens, "tried");
    if (json_array_size(tried) == 0)
        return;
    weft_text_add(page, "<table><tr><th>model of the lens</th><th>board</th><th>held out, px</th></tr>\n");
    for (size_t i = 0; i < json_array_size(tried); i++) {
        const json_t *const one = json_array_get(tried, i);
        weft_text_add(page, "<tr><td>");
        weft_text_add_escaped(page, weft_report_text(one, "model"));
        weft_text_add(page, "</td><td>%s</td>", json_is_true(json_object_get(one, "bent")) ? "bent" : "flat");
        weft_report_cell(page, 4, weft_report_number(one, "held_out_px"));
        weft_text_add(page, "</tr>\n");
    }
    weft_text_add(page, "</table>\n<p class=\"soft\">Taken: ");
    weft_text_add_escaped(page, weft_report_text(lens, "model"));
    weft_text_add(page, ", %s board.</p>\n",
                  json_is_true(json_object_get(lens, "board_bent")) ? "bent" : "flat");
}

void weft_report_lens(const weft_calibration *cal, weft_text_buffer *page)
{
    const json_t *const lens = weft_calibration_get_report(cal, "lens"), *const views =
                                                                             json_object_get(lens, "views");
    weft_text_add(page, "<h2>Lens and pose</h2>\n");
    if (!cal->has_camera) {
        weft_report_absent(page, "There is no camera: ", "weft calibrate lens board-*.set -o CAL");
        return;
    }
    table(&cal->camera, lens, page);
    tried_table(lens, page);
    if (json_array_size(views) == 0) {
        weft_report_absent(page, "The calibration does not say from which pictures the lens was made.", NULL);
        return;
    }
    plot_views(views, cal->camera.rms_px, page);
    bool corners = false;
    for (size_t i = 0; i < json_array_size(views); i++)
        corners |= n_corners(json_array_get(views, i)) > 0;
    if (!corners) {
        weft_report_absent(page, "Its corners were not kept: residuals and coverage cannot be drawn.", NULL);
        return;
    }
    plot_coverage(cal, views, page);
    plot_residuals(cal, views, page);
    plot_scatter(cal, views, page);
}
