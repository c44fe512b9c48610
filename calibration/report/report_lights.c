/* Lights: where they are, how the fit went, what each does on the plate and what the model misses. */
#include "calibration/calibration_report.h"
#include "calibration/lens/lens_model.h"
#include "calibration/lights/white_sheet_file.h"
#include "calibration/report/report_parts.h"

#include <stdio.h>

enum { GREEN = 1, COLUMNS = 40, SMALL = 164 };

/* The frame's outline on the plate, mm; false where it does not meet it. */
static bool outline(const weft_camera *camera, double x[5], double y[5])
{
    const double u[2] = {0, camera->width - 1.0}, v[2] = {0, camera->height - 1.0};
    static const int corner[5][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}};
    for (int k = 0; k < 5; k++) {
        weft_vec3 world;
        if (!weft_camera_to_plane(camera, u[corner[k][0]], v[corner[k][1]], 0, &world))
            return false;
        x[k] = world.x;
        y[k] = world.y;
    }
    return true;
}

static double reach_of(const weft_calibration *cal)
{
    double reach = 100;
    for (int l = 0; l < cal->n_lights; l++)
        if (!cal->lights[l].distant)
            reach = fmax(reach, fmax(fabs(cal->lights[l].position.x),
                                     fmax(fabs(cal->lights[l].position.y), cal->lights[l].position.z)));
    return 1.15 * reach;
}

static void mark_light(weft_plot *plot, const weft_light *light, int number, double x, double y, double ax,
                       double ay, double reach)
{
    char words[120], name[16];
    const double length = 0.12 * reach;
    snprintf(words, sizeof words, "light %d: %.1f, %.1f, %.1f mm, +- %.1f mm, exponent %.3f", number,
             light->position.x, light->position.y, light->position.z, light->position_sigma_mm,
             light->exponent);
    snprintf(name, sizeof name, "%d", number);
    weft_plot_stroke(plot, 4, x, y, x + length * ax, y + length * ay, true);
    if (light->position_sigma_mm > 0)
        weft_plot_circle(plot, 1, x, y, light->position_sigma_mm);
    weft_plot_dot(plot, 0, 3, x, y, words);
    weft_plot_words(plot, x, y, 6, -5, name);
}

static void plot_plan(const weft_calibration *cal, weft_text_buffer *page)
{
    const double reach = reach_of(cal);
    double x[5], y[5];
    weft_plot plot;
    const weft_plot_spec spec = {.title = "The lights from above",
                                 .width = 430,
                                 .height = 430,
                                 .x = {"x, mm", -reach, reach, false},
                                 .y = {"y, mm", -reach, reach, false},
                                 .same_scale = true};
    weft_report_figure_begin(page);
    weft_plot_begin(&plot, &spec, page);
    if (cal->has_camera && cal->camera.has_pose && outline(&cal->camera, x, y))
        weft_plot_line(&plot, 7, 5, x, y, NULL);
    for (int l = 0; l < cal->n_lights; l++) {
        const weft_light *const t = &cal->lights[l];
        if (!t->distant)
            mark_light(&plot, t, l, t->position.x, t->position.y, t->axis.x, t->axis.y, reach);
    }
    weft_plot_end(&plot);
    weft_report_figure_end(
        page, "Plan: the rectangle is what the camera sees, arrows are where the lamps point, circles "
              "how well their places are known.");
}

static void plot_elevation(const weft_calibration *cal, weft_text_buffer *page)
{
    const double reach = reach_of(cal);
    weft_plot plot;
    const weft_plot_spec spec = {.title = "The lights from the side",
                                 .width = 430,
                                 .height = 260,
                                 .x = {"x, mm", -reach, reach, false},
                                 .y = {"z, mm", -20, reach, false},
                                 .same_scale = true};
    weft_report_figure_begin(page);
    weft_plot_begin(&plot, &spec, page);
    weft_plot_stroke(&plot, 7, -reach, 0, reach, 0, false);
    for (int l = 0; l < cal->n_lights; l++) {
        const weft_light *const t = &cal->lights[l];
        if (!t->distant)
            mark_light(&plot, t, l, t->position.x, t->position.z, t->axis.x, t->axis.z, reach);
    }
    weft_plot_end(&plot);
    weft_report_figure_end(page, "Elevation: the line is the plate.");
}

static void plot_convergence(const json_t *rounds, weft_text_buffer *page)
{
    enum { MOST = 64 };
    double x[MOST], moved[MOST], rms[MOST], low = INFINITY, high = 0;
    int n = 0;
    for (size_t i = 0; i < json_array_size(rounds) && n < MOST; i++, n++) {
        const json_t *const round = json_array_get(rounds, i);
        x[n] = n + 1;
        moved[n] = weft_report_number(round, "moved_mm");
        rms[n] = 100 * weft_report_number(round, "rms");
        if (moved[n] > 0) {
            low = fmin(low, moved[n]);
            high = fmax(high, moved[n]);
        }
        if (rms[n] > 0) {
            low = fmin(low, rms[n]);
            high = fmax(high, rms[n]);
        }
    }
    if (n == 0 || !(high > 0))
        return;
    weft_plot plot;
    const weft_plot_spec spec = {.title = "Convergence",
                                 .width = 430,
                                 .height = 240,
                                 .x = {"round", 0.5, n + 0.5, false},
                                 .y = {NULL, 0.5 * low, 2 * high, true},
                                 .legend_rows = 1};
    weft_report_figure_begin(page);
    weft_plot_begin(&plot, &spec, page);
    weft_plot_line(&plot, 0, n, x, moved, "farthest move of a lamp, mm");
    weft_plot_dots(&plot, 0, 3, n, x, moved, NULL);
    weft_plot_line(&plot, 1, n, x, rms, "off the sheet, %");
    weft_plot_dots(&plot, 1, 3, n, x, rms, NULL);
    weft_plot_end(&plot);
    weft_report_figure_end(
        page, "Lamps, and what they have in common, are fitted in turns until no lamp moves by more "
              "than 0.1 mm.");
}

/* ---- maps over the plate ---- */

typedef enum map_kind { MAP_MODEL, MAP_MEASURED, MAP_GAIN, MAP_RESIDUAL, MAPS } map_kind;

static double map_value(const weft_calibration *cal, const weft_white_sheet *sheet,
                        const weft_sheet_kind *laid, map_kind kind, int light, int column, int row)
{
    const double model = weft_white_sheet_predict(sheet, cal, laid, light, GREEN, column, row, false);
    const double gained = weft_white_sheet_predict(sheet, cal, laid, light, GREEN, column, row, true);
    const double seen =
        sheet->value ? (double)weft_white_sheet_plane(sheet, light, GREEN)[row * sheet->columns + column]
                     : (double)NAN;
    switch (kind) {
    case MAP_MODEL:
        return model;
    case MAP_MEASURED:
        return seen;
    case MAP_GAIN:
        return 100 * (gained / model - 1);
    default:
        return 100 * (seen / gained - 1);
    }
}

static weft_err fill_map(const weft_calibration *cal, const weft_white_sheet *sheet,
                         const weft_sheet_kind *laid, map_kind kind, int light, weft_image *map, double *most,
                         weft_error *err)
{
    WEFT_TRY(weft_image_init(map, sheet->columns, sheet->rows, 1, err));
    *most = 0;
    for (int r = 0; r < sheet->rows; r++)
        for (int c = 0; c < sheet->columns; c++) {
            const double value = map_value(cal, sheet, laid, kind, light, c, r);
            weft_image_row(map, 0, r)[c] = (float)value;
            if (isfinite(value))
                *most = fmax(*most, fabs(value));
        }
    return WEFT_OK;
}

static void plot_map(const weft_camera *camera, const weft_image *map, map_kind kind, double scale, int light,
                     weft_text_buffer *page)
{
    static const char *const names[MAPS] = {"model", "measured", "grid", "residual"};
    char title[64];
    weft_plot plot;
    snprintf(title, sizeof title, "light %d: %s", light, names[kind]);
    const weft_plot_spec spec = {.title = title,
                                 .width = SMALL + 86,
                                 .height = 34 + SMALL * camera->height / camera->width,
                                 .x = {NULL, 0, camera->width, false},
                                 .y = {NULL, 0, camera->height, false},
                                 .y_down = true,
                                 .no_ticks = true,
                                 .colour_bar = true};
    const bool deviation = kind == MAP_GAIN || kind == MAP_RESIDUAL;
    weft_report_figure_begin(page);
    weft_plot_begin(&plot, &spec, page);
    weft_plot_heat(&plot, map, 0, 0, 0, camera->width, camera->height, deviation ? -scale : 0, scale,
                   deviation ? WEFT_MAP_DIVERGING : WEFT_MAP_VIRIDIS, deviation ? "%" : "1/s");
    weft_plot_end(&plot);
    weft_text_add(page, "</figure>\n");
}

/* Model and measured share one scale; deviations have their own. */
static void plot_light(const weft_calibration *cal, const weft_white_sheet *sheet,
                       const weft_sheet_kind *laid, int light, weft_text_buffer *page)
{
    weft_image maps[MAPS] = {{0}};
    double most[MAPS] = {0};
    for (int k = 0; k < MAPS; k++)
        if (fill_map(cal, sheet, laid, (map_kind)k, light, &maps[k], &most[k], &page->failure) != WEFT_OK)
            break;
    const double shared = fmax(most[MAP_MODEL], most[MAP_MEASURED]);
    weft_text_add(page, "<div class=\"maps\">\n");
    for (int k = 0; k < MAPS; k++) {
        const bool wanted = k == MAP_MODEL || (k == MAP_GAIN ? cal->grid.columns > 0 : sheet->value != NULL);
        const double scale = k == MAP_RESIDUAL ? 1.0 : k == MAP_GAIN ? fmax(most[k], 0.1) : shared;
        if (wanted && maps[k].data)
            plot_map(&cal->camera, &maps[k], (map_kind)k, scale, light, page);
    }
    weft_text_add(page, "</div>\n");
    for (int k = 0; k < MAPS; k++)
        weft_image_fini(&maps[k]);
}

static void plot_maps(const weft_calibration *cal, const weft_white_sheet *sheet, weft_text_buffer *page)
{
    const json_t *const report = weft_calibration_get_report(cal, "lights");
    const double reflectance = weft_report_number(report, "reflectance");
    const double height = weft_report_number(report, "sheet_height_mm");
    const weft_sheet_kind laid = {isnan(reflectance) ? 1 : reflectance, isnan(height) ? 0 : height};
    const int rows = COLUMNS * cal->camera.height / cal->camera.width;
    weft_white_sheet cells = {.width = cal->camera.width,
                              .height = cal->camera.height,
                              .cell_px = cal->camera.width / COLUMNS > 0 ? cal->camera.width / COLUMNS : 1,
                              .columns = COLUMNS,
                              .rows = rows > 0 ? rows : 1,
                              .n_lights = cal->n_lights};
    weft_text_add(
        page,
        "<h3>What each lamp does on the sheet (green)</h3>\n<p class=\"soft\">Model: lamp and distance "
        "alone. Measured: the sheet. Grid: what the model misses and the grid of gains carries, vignetting "
        "included. Residual: what is left of the measurement after both; it should be noise without "
        "shape. Red is brighter than it should be.</p>\n");
    if (!sheet)
        weft_report_absent(
            page,
            "The averaged sheet is not in the calibration's folder: measured maps and residuals cannot be "
            "drawn. It is kept by",
            "weft calibrate lights white.set -o CAL --force");
    if (json_is_true(json_object_get(json_object_get(report, "sheet"), "bow_used")))
        weft_text_add(page,
                      "<p>The sheet was bowed and the lights were fitted so; the maps take it for flat, so "
                      "what it does to the light shows in them.</p>\n");
    for (int l = 0; l < cal->n_lights; l++)
        plot_light(cal, sheet ? sheet : &cells, &laid, l, page);
}

static void table(const weft_calibration *cal, const json_t *report, weft_text_buffer *page)
{
    const json_t *const lights = json_object_get(report, "lights");
    weft_text_add(
        page,
        "<table><tr><th>light</th><th>x, mm</th><th>y</th><th>z</th><th>&plusmn; mm</th><th>exponent</th>"
        "<th>red</th><th>green</th><th>blue</th><th>&plusmn; %%</th><th>off by, %%</th><th>without "
        "grid</th><th>left "
        "out</th></tr>\n");
    for (int l = 0; l < cal->n_lights; l++) {
        const weft_light *const t = &cal->lights[l];
        const json_t *const more = json_array_get(lights, (size_t)l);
        const weft_vec3 at = t->distant ? t->direction : t->position;
        weft_text_add(page, "<tr><td>%d%s</td>", l, t->distant ? " (direction)" : "");
        weft_report_cell(page, 3, at.x);
        weft_report_cell(page, 3, at.y);
        weft_report_cell(page, 3, at.z);
        weft_report_cell(page, 2, t->position_sigma_mm > 0 ? t->position_sigma_mm : (double)NAN);
        weft_report_cell(page, 3, t->distant ? (double)NAN : t->exponent);
        for (int c = 0; c < 3; c++)
            weft_report_cell(page, 4, t->intensity[c]);
        weft_report_cell(page, 2, 100 * weft_report_number(json_object_get(more, "sigma"), "irradiance"));
        weft_report_cell(page, 3, t->residual > 0 ? 100 * t->residual : (double)NAN);
        weft_report_cell(page, 3, 100 * weft_report_number(more, "residual_without_grid"));
        weft_report_cell(page, 4, weft_report_number(more, "left_out"));
        weft_text_add(page, "</tr>\n");
    }
    weft_text_add(page, "</table>\n");
}

void weft_report_lights(const weft_calibration *cal, const weft_white_sheet *sheet, weft_text_buffer *page)
{
    const json_t *const report = weft_calibration_get_report(cal, "lights");
    weft_text_add(page, "<h2>Lights</h2>\n");
    if (!cal->has_lights) {
        weft_report_absent(page, "There are no lights: ", "weft calibrate lights white.set -o CAL");
        return;
    }
    table(cal, report, page);
    plot_plan(cal, page);
    weft_text_add(page, "<div class=\"column\">\n");
    plot_elevation(cal, page);
    if (json_array_size(json_object_get(report, "rounds")) > 0)
        plot_convergence(json_object_get(report, "rounds"), page);
    else
        weft_report_absent(page, "The calibration does not say how the fit converged.", NULL);
    weft_text_add(page, "</div>\n");
    if (cal->has_camera && cal->camera.has_pose && !cal->lights[0].distant)
        plot_maps(cal, sheet, page);
}
