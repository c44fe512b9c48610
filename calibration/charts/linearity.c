#include "calibration/charts/linearity.h"

#include <math.h>

/* A sensor may end its straight line below and above these shares of its range; a bend between is one. */
static const double dark_end = 0.02, bright_end = 0.80;

/* One reading against its line, over all lights. */
typedef struct point {
    double at, deviation, tolerance; /* share of the range; relative */
    int light, patch, site;
} point;

/* The reading inside the range that exceeds its tolerance most (light -1: none), and the largest deviation.
 */
static void worst_inside(const weft_chart *chart, const weft_grey_fit *fits,
                         const weft_patch_reading *const *readings, const double *full_scale, int n_lights,
                         const double range[2], point *failing, double *deviation)
{
    *deviation = 0;
    *failing = (point){.light = -1};
    double excess = 0;
    for (int l = 0; l < n_lights; l++)
        for (int p = 0; p < chart->columns * chart->rows; p++)
            for (int s = 0; s < WEFT_SITES && fits[l].usable[p]; s++) {
                const double at = readings[l][p].mean[s] * full_scale[l], d = fabs(fits[l].deviation[p][s]);
                const double tolerance = weft_grey_tolerance(chart->patches[p].munsell_value);
                if (at < range[0] || at > range[1])
                    continue;
                *deviation = fmax(*deviation, d);
                if (d - tolerance > excess) {
                    excess = d - tolerance;
                    *failing = (point){at, fits[l].deviation[p][s], tolerance, l, p, s};
                }
            }
}

weft_err weft_linearity_from_greys(const weft_chart *chart, const weft_grey_fit *fits,
                                   const weft_patch_reading *const *readings, const double *full_scale,
                                   int n_lights, weft_linearity *linearity, weft_error *err)
{
    double range[2] = {INFINITY, 0}, deviation;
    for (int l = 0; l < n_lights; l++) {
        range[0] = fmin(range[0], fits[l].range[0]);
        range[1] = fmax(range[1], fits[l].range[1]);
    }
    point failing;
    worst_inside(chart, fits, readings, full_scale, n_lights, range, &failing, &deviation);
    while (failing.light >= 0 && (failing.at < dark_end || failing.at > bright_end)) {
        if (failing.at < dark_end)
            range[0] = nextafter(failing.at, 1);
        else
            range[1] = nextafter(failing.at, 0);
        worst_inside(chart, fits, readings, full_scale, n_lights, range, &failing, &deviation);
    }
    if (failing.light >= 0)
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "the sensor is not linear: under light %d \"%s\" reads %+.1f %% in %s at %.2f of the range "
            "(%.0f %% allowed); switch off gamma and automatic corrections of the camera, or look for "
            "glints and stray light",
            failing.light, chart->patches[failing.patch].name, 100 * failing.deviation,
            weft_site_names[failing.site], failing.at, 100 * failing.tolerance);
    *linearity = (weft_linearity){{range[0], range[1]}, deviation};
    return WEFT_OK;
}

/* A class's readings of one patch over the series: sums for its own line, centred on the common offset. */
typedef struct line_sums {
    int n;
    double t, tt, y, ty;
} line_sums;

static bool takes_part(const weft_exposure *e, int patch, int site, double *value)
{
    const weft_patch_reading *const r = &e->readings[patch];
    *value = r->mean[site] * e->exposure;
    double brightest = 0;
    for (int s = 0; s < WEFT_SITES; s++)
        brightest = fmax(brightest, r->mean[s] * e->exposure);
    return !(r->clipped > 0) && isfinite(*value) && brightest <= WEFT_GREY_RANGE_MAX;
}

static line_sums sum_patch(const weft_exposure *exposures, int n, int patch, int site)
{
    line_sums k = {0};
    for (int e = 0; e < n; e++) {
        double y;
        if (!takes_part(&exposures[e], patch, site, &y))
            continue;
        const double t = exposures[e].exposure;
        k.n++;
        k.t += t;
        k.tt += t * t;
        k.y += y;
        k.ty += t * y;
    }
    return k;
}

/* The offset shared by all patches of a class, each with its own slope eliminated. */
static double common_offset(const weft_chart *chart, const weft_exposure *exposures, int n, int site,
                            int *points)
{
    double a = 0, b = 0;
    *points = 0;
    for (int p = 0; p < chart->columns * chart->rows; p++) {
        const line_sums k = sum_patch(exposures, n, p, site);
        if (k.n < 2)
            continue;
        a += k.n - k.t * k.t / k.tt;
        b += k.y - k.t * k.ty / k.tt;
        *points += k.n;
    }
    return a > 0 ? b / a : 0;
}

static void judge_class(const weft_chart *chart, const weft_exposure *exposures, int n, int site,
                        weft_exposure_fit *fit)
{
    for (int p = 0; p < chart->columns * chart->rows; p++) {
        const line_sums k = sum_patch(exposures, n, p, site);
        if (k.n < 2)
            continue;
        const double radiance = (k.ty - fit->offset[site] * k.t) / k.tt;
        for (int e = 0; e < n; e++) {
            double y;
            if (!takes_part(&exposures[e], p, site, &y))
                continue;
            const double d = fabs(y - fit->offset[site] - radiance * exposures[e].exposure);
            fit->range[0] = fmin(fit->range[0], y);
            fit->range[1] = fmax(fit->range[1], y);
            fit->n_points++;
            if (d > fit->max_deviation) {
                fit->max_deviation = d;
                fit->worst_at = y;
            }
        }
    }
}

weft_err weft_linearity_from_series(const weft_chart *chart, const weft_exposure *exposures, int n,
                                    weft_exposure_fit *fit, weft_error *err)
{
    int different = 0;
    for (int i = 0; i < n; i++) {
        bool seen = false;
        for (int j = 0; j < i; j++)
            seen |= fabs(exposures[j].exposure / exposures[i].exposure - 1) < 0.01;
        different += !seen;
    }
    if (different < 3)
        return weft_fail(err, WEFT_ERR_NODATA, "%d different exposures are no series, 3 are wanted",
                         different);
    weft_exposure_fit result = {.range = {INFINITY, 0}};
    for (int s = 0; s < WEFT_SITES; s++) {
        int points;
        result.offset[s] = common_offset(chart, exposures, n, s, &points);
        if (points < 12)
            return weft_fail(err, WEFT_ERR_NODATA,
                             "only %d readings of %s are neither clipped nor alone: shorten the exposures",
                             points, weft_site_names[s]);
        judge_class(chart, exposures, n, s, &result);
    }
    *fit = result;
    return WEFT_OK;
}
