#include "calibration/charts/grey_fit.h"

#include <math.h>
#include <string.h>

double weft_grey_tolerance(double munsell_value)
{
    return munsell_value < 4 ? 0.10 : 0.05;
}

static int n_patches(const weft_chart *chart)
{
    return chart->columns * chart->rows;
}

static double rho(const weft_chart *chart, int patch)
{
    return weft_munsell_reflectance(chart->patches[patch].munsell_value);
}

/* Why patches were left out. */
typedef struct refusals {
    int clipped, dark, bright;
} refusals;

static void choose_usable(const weft_chart *chart, const weft_grey_light *light, weft_grey_fit *fit,
                          refusals *why)
{
    const double scale = light->full_scale;
    for (int p = 0; p < n_patches(chart); p++) {
        const weft_patch_reading *const r = &light->readings[p];
        if (!(chart->patches[p].munsell_value > 0))
            continue;
        double low = INFINITY, high = 0;
        for (int s = 0; s < WEFT_SITES; s++) {
            low = fmin(low, r->mean[s]);
            high = fmax(high, r->mean[s]);
        }
        const bool dark = !(low > 0) || (scale > 0 && low * scale < WEFT_GREY_RANGE_MIN);
        const bool bright = scale > 0 && high * scale > WEFT_GREY_RANGE_MAX;
        why->clipped += r->clipped > 0;
        why->dark += dark;
        why->bright += bright && !(r->clipped > 0);
        if (r->clipped > 0 || dark || bright)
            continue;
        fit->usable[p] = true;
        fit->n_usable++;
        if (scale > 0) {
            fit->range[0] = fit->n_usable == 1 ? low * scale : fmin(fit->range[0], low * scale);
            fit->range[1] = fmax(fit->range[1], high * scale);
        }
    }
}

/* log(m / rho) = log slope_s + g.x, the slopes of the four classes free: weighted by brightness. */
static void fit_gradient(const weft_chart *chart, const weft_grey_light *light, weft_grey_fit *fit)
{
    double w_sum = 0, xm = 0, ym = 0, dm[WEFT_SITES] = {0};
    for (int p = 0; p < n_patches(chart); p++) {
        double x, y;
        if (!fit->usable[p])
            continue;
        const double w = rho(chart, p);
        weft_chart_patch_centre(chart, p, &x, &y);
        w_sum += w;
        xm += w * x;
        ym += w * y;
        for (int s = 0; s < WEFT_SITES; s++)
            dm[s] += w * log(light->readings[p].mean[s] / rho(chart, p));
    }
    double xx = 0, xy = 0, yy = 0, dx = 0, dy = 0;
    for (int p = 0; p < n_patches(chart); p++) {
        double x, y;
        if (!fit->usable[p])
            continue;
        const double w = rho(chart, p);
        weft_chart_patch_centre(chart, p, &x, &y);
        x -= xm / w_sum;
        y -= ym / w_sum;
        for (int s = 0; s < WEFT_SITES; s++) {
            const double d = log(light->readings[p].mean[s] / rho(chart, p)) - dm[s] / w_sum;
            xx += w * x * x;
            xy += w * x * y;
            yy += w * y * y;
            dx += w * x * d;
            dy += w * y * d;
        }
    }
    const double det = xx * yy - xy * xy;
    if (det > 1e-6 * xx * yy) {
        fit->gradient[0] = (yy * dx - xy * dy) / det;
        fit->gradient[1] = (xx * dy - xy * dx) / det;
    }
}

/* The reading as it would be under irradiance 1. */
static double flat(const weft_chart *chart, const weft_grey_light *light, const weft_grey_fit *fit, int patch,
                   int site)
{
    double x, y;
    if (light->irradiance)
        return light->readings[patch].mean[site] / light->irradiance[patch][weft_site_colour[site]];
    weft_chart_patch_centre(chart, patch, &x, &y);
    return light->readings[patch].mean[site] * exp(-fit->gradient[0] * x - fit->gradient[1] * y);
}

static void fit_slopes(const weft_chart *chart, const weft_grey_light *light, weft_grey_fit *fit)
{
    for (int s = 0; s < WEFT_SITES; s++) {
        double mr = 0, rr = 0;
        for (int p = 0; p < n_patches(chart); p++)
            if (fit->usable[p]) {
                mr += flat(chart, light, fit, p, s) * rho(chart, p);
                rr += rho(chart, p) * rho(chart, p);
            }
        fit->slope[s] = mr / rr;
    }
    for (int p = 0; p < n_patches(chart); p++)
        for (int s = 0; s < WEFT_SITES && fit->usable[p]; s++) {
            const double d = flat(chart, light, fit, p, s) / (fit->slope[s] * rho(chart, p)) - 1;
            fit->deviation[p][s] = d;
            if (fabs(d) > fit->max_deviation) {
                fit->max_deviation = fabs(d);
                fit->worst_patch = p;
            }
        }
}

static weft_err check_order(const weft_chart *chart, const weft_grey_light *light, const weft_grey_fit *fit,
                            weft_error *err)
{
    for (int a = 0; a < n_patches(chart); a++)
        for (int b = 0; b < n_patches(chart); b++) {
            if (!fit->usable[a] || !fit->usable[b] ||
                !(chart->patches[a].munsell_value > chart->patches[b].munsell_value))
                continue;
            for (int s = 0; s < WEFT_SITES; s++)
                if (flat(chart, light, fit, a, s) <= flat(chart, light, fit, b, s))
                    return weft_fail(
                        err, WEFT_ERR_NODATA,
                        "\"%s\" does not answer more than \"%s\" in %s (%.4g, %.4g): look for glints, "
                        "shadows, or automatic exposure",
                        chart->patches[a].name, chart->patches[b].name, weft_site_names[s],
                        flat(chart, light, fit, a, s), flat(chart, light, fit, b, s));
        }
    return WEFT_OK;
}

weft_err weft_grey_fit_light(const weft_chart *chart, const weft_grey_light *light, weft_grey_fit *fit,
                             weft_error *err)
{
    weft_grey_fit result = {0};
    refusals why = {0};
    choose_usable(chart, light, &result, &why);
    if (result.n_usable < WEFT_GREY_PATCHES_MIN)
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "%d grey patches are usable, %d are wanted: %d clipped, %d above %.0f %% and %d below %.0f %% "
            "of the range; change the exposure",
            result.n_usable, WEFT_GREY_PATCHES_MIN, why.clipped, why.bright, 100 * WEFT_GREY_RANGE_MAX,
            why.dark, 100 * WEFT_GREY_RANGE_MIN);
    if (!light->irradiance)
        fit_gradient(chart, light, &result);
    fit_slopes(chart, light, &result);
    WEFT_TRY(check_order(chart, light, &result, err));
    *fit = result;
    return WEFT_OK;
}
