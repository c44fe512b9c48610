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
#define CERTAIN       3.5 /* standard deviations before the sheet is held to be tilted or bowed */
#define PI            3.14159265358979323846

const weft_light_fit_options weft_light_fit_defaults = {
    .reflectance = 0.99,
    .grid_columns = 33,
    .grid_rows = 22,
    .max_rounds = WEFT_LIGHT_FIT_MAX_ROUNDS / 2,
    .settled_mm = 0.1,
    .flatness_mm = 0.02,
    .tilt_most_rad = 0.5 * PI / 180,
    .bow_most_mm = 2,
    .guess_off_mm = 60,
    .aim_sigma_rad = 0.01745,
    .exponent_sigma = 0.2,
};

weft_err fit_problem_init(fit_problem *f, int n_lights, int n_cells, weft_error *err)
{
    const size_t n = (size_t)n_cells, planes = 3 * (size_t)n_lights;
    *f = (fit_problem){.n_lights = n_lights, .n_cells = n_cells};
    if (!(f->cell = weft_alloc(n, sizeof *f->cell, err)) ||
        !(f->place = weft_alloc(n, sizeof *f->place, err)) ||
        !(f->common = weft_alloc(3 * n, sizeof *f->common, err)) ||
        !(f->y = weft_alloc(n * planes, sizeof *f->y, err)) ||
        !(f->weight = weft_alloc(n * planes, sizeof *f->weight, err)))
        return WEFT_ERR_NOMEM;
    return WEFT_OK;
}

void fit_problem_fini(fit_problem *f)
{
    weft_free(f->cell);
    weft_free(f->place);
    weft_free(f->common);
    weft_free(f->y);
    weft_free(f->weight);
}

static weft_err place_cell(fit_problem *f, const weft_camera *camera, double u, double v, int cell,
                           weft_error *err)
{
    const double height = f->options->sheet_height_mm;
    weft_vec3 low, high;
    if (!weft_camera_to_plane(camera, u, v, height, &low) ||
        !weft_camera_to_plane(camera, u, v, height + 1, &high))
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "by the calibration, pixel (%.0f, %.0f) does not see the table; make the pose again with "
            "\"weft calibrate lens --board-on-table\"",
            u, v);
    f->cell[cell] = (fit_cell){low.x, low.y, high.x - low.x, high.y - low.y};
    f->place[cell] = fit_place_at(f, u, v);
    f->field_mm = fmax(f->field_mm, hypot(low.x, low.y));
    f->half_field_mm[0] = fmax(f->half_field_mm[0], fabs(low.x));
    f->half_field_mm[1] = fmax(f->half_field_mm[1], fabs(low.y));
    if (hypot(low.x, low.y) < hypot(f->cell[f->middle].x, f->cell[f->middle].y))
        f->middle = cell;
    const double x = (u - camera->cx) / camera->fx, y = (v - camera->cy) / camera->fy;
    for (int c = 0; c < 3; c++) /* cos^4 of the field angle, to begin with */
        f->common[(size_t)c * (size_t)f->n_cells + (size_t)cell] = -2 * log1p(x * x + y * y);
    return WEFT_OK;
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
        for (int i = 0; i < sheet->columns; i++)
            WEFT_TRY(place_cell(f, camera, weft_white_sheet_centre(sheet, i),
                                weft_white_sheet_centre(sheet, j), j * sheet->columns + i, err));
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

/* Fits, looks how much the model misses, fits with that weight; until the lights stay where they are. */
static weft_err run_rounds(fit_problem *f, fit_planes *planes, fit_scope scope, weft_light_fit_report *report,
                           weft_error *err)
{
    report->settled = false;
    for (int round = 0; round < f->options->max_rounds && !report->settled; round++) {
        fit_lamp before[WEFT_LIGHTS_MAX];
        memcpy(before, f->lamps, sizeof before);
        if (weft_cancelled())
            return weft_fail(err, WEFT_ERR_CANCELLED, "cancelled");
        scope.runs = round == 0 ? 3 : 1;
        WEFT_TRY(fit_solve(f, scope, err));
        weft_light_fit_round *const r = &report->rounds[report->n_rounds++];
        *r = (weft_light_fit_round){largest_move(f, before), model_rms(f, -1)};
        weft_explain("round %d: lights moved by %.4f mm at most, measured/model differs by %.3f %% rms",
                     report->n_rounds, r->moved_mm, 100 * r->rms);
        report->settled = r->moved_mm < f->options->settled_mm;
        const double missed = fit_model_error(f, planes),
                     cells = planes->smooth.sigma_px / planes->smooth.sheet->cell_px;
        report->model_error = sqrt(missed);
        weft_explain("the model misses %.4f %% rms smoothly", 100 * sqrt(missed));
        /* A smooth error moves all cells under the window and all three colours alike: it weighs as much as
         * independent noise of that many times its square. */
        f->model_variance = 3 * 4 * PI * cells * cells * missed;
    }
    return WEFT_OK;
}

/* What the fit says of the sheet, from shape and its sigmas. */
static weft_light_sheet sheet_of(const fit_problem *f)
{
    const double *const s = f->shared.shape, *const sigma = f->shared_sigma.shape;
    weft_light_sheet sheet = {.bow_used = false};
    for (int k = 0; k < 2; k++) {
        const double edge = f->half_field_mm[k] / f->field_mm, term = FIT_TILT + 2 * k;
        sheet.bow_mm[k] = -s[(int)term] * edge * edge;
        sheet.bow_sigma_mm[k] = sigma[(int)term] * edge * edge;
        sheet.tilt_rad[k] = s[k] / f->field_mm;
        sheet.tilt_sigma_rad[k] = sigma[k] / f->field_mm;
    }
    return sheet;
}

static weft_err refuse_shape(const fit_problem *f, const weft_light_sheet *s, weft_error *err)
{
    const double tilt = hypot(s->tilt_rad[0], s->tilt_rad[1]);
    const double tilt_sigma = fmax(s->tilt_sigma_rad[0], s->tilt_sigma_rad[1]);
    const bool certain = fabs(s->tilt_rad[0]) > CERTAIN * s->tilt_sigma_rad[0] ||
                         fabs(s->tilt_rad[1]) > CERTAIN * s->tilt_sigma_rad[1];
    const double degrees = 180 / PI;
    if (tilt > f->options->tilt_most_rad && certain)
        return weft_fail(
            err, WEFT_ERR_RANGE,
            "the sheet is tilted by %.1f +- %.1f degrees against the table (it rises towards %s); lay it "
            "flat on the table, or make the pose again if the table was moved",
            tilt * degrees, tilt_sigma * degrees,
            fabs(s->tilt_rad[0]) > fabs(s->tilt_rad[1]) ? (s->tilt_rad[0] > 0 ? "the right" : "the left")
            : s->tilt_rad[1] > 0                        ? "the top"
                                                        : "the bottom");
    const int worse = fabs(s->bow_mm[1]) > fabs(s->bow_mm[0]);
    if (fabs(s->bow_mm[worse]) > f->options->bow_most_mm &&
        fabs(s->bow_mm[worse]) > CERTAIN * s->bow_sigma_mm[worse])
        return weft_fail(
            err, WEFT_ERR_RANGE,
            "the sheet is not flat: its middle stands %.1f +- %.1f mm %s its %s edges; press it flat or "
            "take a stiffer one",
            fabs(s->bow_mm[worse]), s->bow_sigma_mm[worse], s->bow_mm[worse] > 0 ? "over" : "under",
            worse ? "upper and lower" : "left and right");
    return WEFT_OK;
}

/* Leaves tilt and bow of the sheet open and says whether they stand out.  The lights stay as they were. */
static weft_err look_at_shape(fit_problem *f, weft_light_sheet *sheet, bool *bowed, weft_error *err)
{
    fit_problem flat = *f;
    f->model_variance = 0; /* what a flat sheet misses may be its shape */
    WEFT_TRY(fit_solve(f, (fit_scope){0, f->n_lights, true, true, true, true, 2}, err));
    *sheet = sheet_of(f);
    *bowed = false;
    for (int k = FIT_TILT; k < FIT_SHAPE; k++)
        *bowed |= fabs(f->shared.shape[k]) > CERTAIN * f->shared_sigma.shape[k];
    const weft_err status = refuse_shape(f, sheet, err);
    *f = flat;
    return status;
}

static double off_guess(const fit_problem *f, int light, int guess)
{
    const double *const p = f->lamps[light].p;
    return weft_length(weft_sub((weft_vec3){p[0], p[1], p[2]}, f->options->guess[guess]));
}

/* A light that is where another was expected, and that one where it was: the two were swapped. */
static weft_err check_order(const fit_problem *f, weft_error *err)
{
    for (int i = 0; i < f->options->n_guess; i++) {
        if (off_guess(f, i, i) <= f->options->guess_off_mm)
            continue;
        for (int j = 0; j < f->n_lights; j++)
            if (j != i && off_guess(f, i, j) < 0.5 * off_guess(f, i, i) &&
                off_guess(f, j, i) < 0.5 * off_guess(f, j, j))
                return weft_fail(
                    err, WEFT_ERR_MISMATCH,
                    "light %d is where light %d was expected, and the other way round: two lights are "
                    "swapped; check their plugs (\"weft light on %d\" lights one)",
                    i, j, i);
        weft_warn("light %d: found %.0f mm from where it was expected", i, off_guess(f, i, i));
    }
    return WEFT_OK;
}

/* A chart or a sheet that ends inside the frame would come out bent or tilted: say what it is before that. */
static weft_err check_sheet(fit_problem *f, fit_planes *planes, weft_error *err)
{
    double unused = 0;
    WEFT_TRY(fit_settle_common(f, err));
    return fit_grid(f, planes, 0, 1, planes->colours, &unused, err);
}

static weft_err fit_lights(fit_problem *f, fit_planes *planes, weft_light_fit_report *report, weft_error *err)
{
    fit_scope scope = {.n = f->n_lights, .common_free = f->n_lights >= FIT_LIGHTS_LEAST};
    weft_light_sheet open = {.bow_used = false};
    WEFT_TRY(run_rounds(f, planes, scope, report, err));
    WEFT_TRY(check_sheet(f, planes, err));
    if (scope.common_free)
        WEFT_TRY(look_at_shape(f, &open, &scope.bow_free, err));
    if (scope.bow_free) {
        f->model_variance = 0;
        WEFT_TRY(run_rounds(f, planes, scope, report, err));
    }
    WEFT_TRY(check_order(f, err));
    scope.runs = 1; /* S was made for the other sheet */
    scope.sigmas = true;
    WEFT_TRY(fit_solve(f, scope, err));
    report->sheet = open;
    if (scope.bow_free) {
        const weft_light_sheet bowed = sheet_of(f);
        memcpy(report->sheet.bow_mm, bowed.bow_mm, sizeof bowed.bow_mm);
        memcpy(report->sheet.bow_sigma_mm, bowed.bow_sigma_mm, sizeof bowed.bow_sigma_mm);
        report->sheet.bow_used = true;
    }
    return fit_settle_common(f, err);
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

static weft_light_sigma sigma_of(const fit_problem *f, int light)
{
    const fit_lamp *const lamp = &f->lamps[light], *const s = &f->sigma[light];
    const double distance = weft_length((weft_vec3){lamp->p[0], lamp->p[1], lamp->p[2]});
    weft_light_sigma sigma = {.aim_rad = hypot(s->m[0], s->m[1]) / distance,
                              .exponent = s->e,
                              .irradiance = f->irradiance_sigma[light]};
    memcpy(sigma.position_mm, s->p, sizeof sigma.position_mm);
    memcpy(sigma.intensity, s->log_phi, sizeof sigma.intensity);
    return sigma;
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
        report->sigma[l] = sigma_of(f, l);
    }
    memcpy(report->vignetting, f->v, sizeof report->vignetting);
    memcpy(report->slope, f->v + FIT_RADIAL, sizeof report->slope);
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
        status = fit_lights(&f, &planes, &r, err);
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
