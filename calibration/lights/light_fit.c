#include "calibration/lights/light_fit.h"

#include "calibration/lens/lens_model.h"
#include "calibration/lights/light_fit_internal.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DARK_SHARE    0.01 /* of the median light: below it a lamp is off */
#define LEFT_OUT_MOST 0.05

const weft_light_fit_options weft_light_fit_defaults = {
    .reflectance = 0.99,
    .grid_columns = 33,
    .grid_rows = 22,
    .max_rounds = WEFT_LIGHT_FIT_MAX_ROUNDS,
    .settled_mm = 0.1,
    .aim_sigma_rad = 0.01745,
    .exponent_sigma = 0.2,
};

weft_err fit_problem_init(fit_problem *f, int n_lights, int n_cells, weft_error *err)
{
    const size_t n = (size_t)n_cells, planes = 3 * (size_t)n_lights;
    *f = (fit_problem){.n_lights = n_lights, .n_cells = n_cells};
    if (!(f->x = weft_alloc(n, sizeof *f->x, err)) || !(f->place = weft_alloc(n, sizeof *f->place, err)) ||
        !(f->common = weft_alloc(n, sizeof *f->common, err)) ||
        !(f->y = weft_alloc(n * planes, sizeof *f->y, err)) ||
        !(f->weight = weft_alloc(n * planes, sizeof *f->weight, err)))
        return WEFT_ERR_NOMEM;
    return WEFT_OK;
}

void fit_problem_fini(fit_problem *f)
{
    weft_free(f->x);
    weft_free(f->place);
    weft_free(f->common);
    weft_free(f->y);
    weft_free(f->weight);
}

static weft_err place_cells(fit_problem *f, const weft_camera *camera, const weft_white_sheet *sheet,
                            weft_error *err)
{
    f->width = sheet->width;
    f->height = sheet->height;
    f->cx = camera->cx;
    f->cy = camera->cy;
    f->radius = hypot(fmax(f->cx, f->width - 1 - f->cx), fmax(f->cy, f->height - 1 - f->cy));
    for (int j = 0; j < sheet->rows; j++)
        for (int i = 0; i < sheet->columns; i++) {
            const double u = weft_white_sheet_centre(sheet, i), v = weft_white_sheet_centre(sheet, j);
            const int cell = j * sheet->columns + i;
            if (!weft_camera_to_plane(camera, u, v, 0, &f->x[cell]))
                return weft_fail(
                    err, WEFT_ERR_NODATA,
                    "by the calibration, pixel (%.0f, %.0f) does not see the table; make the pose again "
                    "with \"weft calibrate lens --board-on-table\"",
                    u, v);
            f->place[cell] = fit_place_at(f, u, v);
            f->field_mm = fmax(f->field_mm, hypot(f->x[cell].x, f->x[cell].y));
        }
    return WEFT_OK;
}

/* Mean of a plane of the sheet over the cells that are there. */
static double mean_value(const float *value, int n, int *n_there)
{
    double sum = 0;
    *n_there = 0;
    for (int i = 0; i < n; i++)
        if (!isnan(value[i])) {
            sum += (double)value[i];
            ++*n_there;
        }
    return *n_there ? sum / *n_there : 0;
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static weft_err check_brightness(const weft_white_sheet *sheet, weft_error *err)
{
    double mean[WEFT_LIGHTS_MAX], sorted[WEFT_LIGHTS_MAX];
    const int n = sheet->columns * sheet->rows;
    for (int l = 0; l < sheet->n_lights; l++) {
        int there;
        mean[l] = mean_value(weft_white_sheet_plane(sheet, l, 1), n, &there);
        if (there < (1 - LEFT_OUT_MOST) * n)
            return weft_fail(err, WEFT_ERR_NODATA,
                             "light %d: %.0f %% of the sheet's cells are missing or saturated", l,
                             100.0 - 100.0 * there / n);
    }
    memcpy(sorted, mean, sizeof sorted);
    qsort(sorted, (size_t)sheet->n_lights, sizeof *sorted, compare_doubles);
    const double median = sorted[sheet->n_lights / 2];
    for (int l = 0; l < sheet->n_lights; l++)
        if (!(mean[l] > 0 && mean[l] >= DARK_SHARE * median))
            return weft_fail(
                err, WEFT_ERR_NODATA,
                "light %d: the sheet is dark under it (%.2g against %.2g for the others); does the lamp "
                "work?",
                l, mean[l], median);
    return WEFT_OK;
}

static void take_values(fit_problem *f, const weft_white_sheet *sheet)
{
    for (int l = 0; l < f->n_lights; l++)
        for (int c = 0; c < 3; c++) {
            const float *const value = weft_white_sheet_plane(sheet, l, c);
            float *const y = f->y + fit_plane(f, l, c), *const w = f->weight + fit_plane(f, l, c);
            int there;
            const double mean = mean_value(value, f->n_cells, &there);
            for (int i = 0; i < f->n_cells; i++) {
                const bool good = value[i] > 0;
                y[i] = good ? (float)log((double)value[i] / f->options->reflectance) : NAN;
                w[i] = good ? (float)((double)value[i] / mean) : 0;
            }
        }
}

/* What all lights see alike beside the polynomial is the camera's or the sheet's: their mean residual. */
static weft_err update_common(fit_problem *f, fit_planes *p, weft_error *err)
{
    for (int i = 0; i < f->n_cells; i++) {
        double sum = 0;
        int n = 0;
        for (int l = 0; l < f->n_lights; l++)
            for (int c = 0; c < 3; c++)
                if (f->weight[fit_plane(f, l, c) + (size_t)i] > 0) {
                    sum += fit_residual(f, l, c, i) + f->common[i];
                    n++;
                }
        p->residual[i] = n ? (float)(sum / n) : NAN;
    }
    int first;
    fit_smooth_robust(f, p, &first);
    for (int i = 0; i < p->smooth.columns * p->smooth.rows; i++)
        if (isnan(p->nodes[i]))
            return weft_fail(
                err, WEFT_ERR_NODATA,
                "near pixel (%d, %d) every light finds something unlike the rest of the sheet; does the "
                "sheet fill the frame?",
                i % p->smooth.columns * (f->width - 1) / (p->smooth.columns - 1),
                i / p->smooth.columns * (f->height - 1) / (p->smooth.rows - 1));
    const weft_white_sheet *const sheet = p->smooth.sheet;
    for (int i = 0; i < f->n_cells; i++)
        f->common[i] = fit_smooth_at(&p->smooth, p->nodes, weft_white_sheet_centre(sheet, i % sheet->columns),
                                     weft_white_sheet_centre(sheet, i / sheet->columns));
    return WEFT_OK;
}

/* rms of measured/model - 1, over one light or all (-1). */
static double model_rms(const fit_problem *f, int light)
{
    double sum = 0;
    long n = 0;
    for (int l = 0; l < f->n_lights; l++)
        for (int c = 0; c < 3 && (light < 0 || l == light); c++)
            for (int i = 0; i < f->n_cells; i++)
                if (f->weight[fit_plane(f, l, c) + (size_t)i] > 0) {
                    const double r = exp(fit_residual(f, l, c, i)) - 1;
                    sum += r * r;
                    n++;
                }
    return n ? sqrt(sum / (double)n) : 0;
}

static double largest_move(const fit_problem *f, const fit_lamp *before)
{
    double most = 0;
    for (int l = 0; l < f->n_lights; l++) {
        double sum = 0;
        for (int k = 0; k < 3; k++)
            sum += (f->lamps[l].p[k] - before[l].p[k]) * (f->lamps[l].p[k] - before[l].p[k]);
        most = fmax(most, sqrt(sum));
    }
    return most;
}

static weft_err run_rounds(fit_problem *f, fit_planes *planes, weft_light_fit_report *report, weft_error *err)
{
    for (int round = 0; round < f->options->max_rounds && !report->settled; round++) {
        fit_lamp before[WEFT_LIGHTS_MAX];
        memcpy(before, f->lamps, sizeof before);
        if (weft_cancelled())
            return weft_fail(err, WEFT_ERR_CANCELLED, "cancelled");
        WEFT_TRY(fit_solve(f, (fit_scope){0, f->n_lights, true, round == 0 ? 3 : 1}, err));
        weft_light_fit_round *const r = &report->rounds[report->n_rounds++];
        *r = (weft_light_fit_round){largest_move(f, before), model_rms(f, -1)};
        weft_explain("round %d: lights moved by %.4f mm at most, measured/model differs by %.3f %% rms",
                     report->n_rounds, r->moved_mm, 100 * r->rms);
        report->settled = r->moved_mm < f->options->settled_mm;
        if (!report->settled)
            WEFT_TRY(update_common(f, planes, err));
    }
    return WEFT_OK;
}

static void fill_light(const fit_problem *f, int light, weft_light *out)
{
    const fit_lamp *const lamp = &f->lamps[light];
    const weft_vec3 p = {lamp->p[0], lamp->p[1], lamp->p[2]}, spot = {lamp->m[0], lamp->m[1], 0};
    *out = (weft_light){.position = p,
                        .axis = weft_normalise(weft_sub(spot, p)),
                        .exponent = fmax(lamp->e, 0),
                        .intensity = {exp(lamp->log_phi[0]), exp(lamp->log_phi[1]), exp(lamp->log_phi[2])},
                        .position_sigma_mm = f->position_sigma[light]};
    for (int c = 0; c < 3; c++) /* the sheet is neutral */
        out->white_balance[c] = out->intensity[1] / out->intensity[c];
}

static weft_err fill_result(const fit_problem *f, fit_planes *planes, weft_light *lights, float *gain,
                            weft_light_fit_report *report, weft_error *err)
{
    const size_t nodes = (size_t)planes->smooth.columns * (size_t)planes->smooth.rows;
    for (int l = 0; l < f->n_lights; l++) {
        fill_light(f, l, &lights[l]);
        for (int c = 0; c < 3; c++)
            WEFT_TRY(
                fit_grid(f, planes, l, c, gain + (size_t)(3 * l + c) * nodes, &report->left_out[l], err));
        lights[l].residual = fit_grid_residual(f, planes, l, gain);
        report->model_rms[l] = model_rms(f, l);
    }
    memcpy(report->vignetting, f->shared.v, sizeof report->vignetting);
    memcpy(report->slope, f->shared.v + FIT_RADIAL, sizeof report->slope);
    report->exponent = f->shared.e0;
    return WEFT_OK;
}

static void put_result(weft_calibration *cal, int n_lights, const weft_light *lights, weft_light_grid grid)
{
    memcpy(cal->lights, lights, (size_t)n_lights * sizeof *lights);
    weft_free(cal->grid.gain);
    cal->grid = grid;
    cal->n_lights = n_lights;
    cal->has_lights = true;
}

static weft_err check_inputs(const weft_camera *camera, const weft_white_sheet *sheet,
                             const weft_light_fit_options *options, weft_error *err)
{
    if (!camera->has_pose)
        return weft_fail(err, WEFT_ERR_MISSING,
                         "the camera has no pose; make it with \"weft calibrate lens --board-on-table\"");
    if (camera->width != sheet->width || camera->height != sheet->height)
        return weft_fail(err, WEFT_ERR_MISMATCH, "the sheet is %dx%d, the calibration is for %dx%d",
                         sheet->width, sheet->height, camera->width, camera->height);
    if (options->n_guess && options->n_guess != sheet->n_lights)
        return weft_fail(err, WEFT_ERR_MISMATCH, "the guess has %d lights, the sheet %d", options->n_guess,
                         sheet->n_lights);
    return check_brightness(sheet, err);
}

weft_err weft_light_fit(const weft_camera *camera, const weft_white_sheet *sheet,
                        const weft_light_fit_options *options, weft_calibration *cal,
                        weft_light_fit_report *report, weft_error *err)
{
    fit_problem f;
    fit_planes planes = {0};
    weft_light lights[WEFT_LIGHTS_MAX];
    weft_light_fit_report r = {0};
    weft_light_grid grid = {options->grid_columns, options->grid_rows, NULL};
    WEFT_TRY(check_inputs(camera, sheet, options, err));
    weft_err status = fit_problem_init(&f, sheet->n_lights, sheet->columns * sheet->rows, err);
    f.options = options;
    if (status == WEFT_OK)
        status = place_cells(&f, camera, sheet, err);
    if (status == WEFT_OK) {
        take_values(&f, sheet);
        status = fit_planes_init(&planes, &f, sheet, err);
    }
    if (status == WEFT_OK)
        status = fit_start(&f, err);
    if (status == WEFT_OK)
        status = run_rounds(&f, &planes, &r, err);
    if (status == WEFT_OK) {
        grid.gain =
            weft_alloc((size_t)f.n_lights * 3 * (size_t)(grid.columns * grid.rows), sizeof(float), err);
        status = grid.gain ? fill_result(&f, &planes, lights, grid.gain, &r, err) : WEFT_ERR_NOMEM;
    }
    if (status == WEFT_OK) {
        put_result(cal, f.n_lights, lights, grid);
        *report = r;
    } else {
        weft_free(grid.gain);
    }
    fit_planes_fini(&planes);
    fit_problem_fini(&f);
    return status;
}
