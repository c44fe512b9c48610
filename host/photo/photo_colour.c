#include "host/photo/photo_colour.h"

#include "calibration/charts/chart_measure.h"
#include "core/colour.h"

#include <math.h>
#include <string.h>

enum { SLOPE_ROUNDS = 12 };
static const double slope_least = 0.02;

/* Gains by the neutrals: the slope of what was read against what it should be. */
static weft_err balance(const weft_chart *chart, const weft_patch_reading *readings, double gain[3],
                        weft_error *err)
{
    double read[3] = {0}, wanted[3] = {0};
    int n = 0;
    for (int p = 0; p < chart->columns * chart->rows; p++) {
        const weft_patch_reading *const r = &readings[p];
        const double *const reference = chart->patches[p].linear_srgb;
        if (!(chart->patches[p].munsell_value > 0) || r->clipped > 0)
            continue;
        const double mean[3] = {r->mean[WEFT_SITE_R], 0.5 * (r->mean[WEFT_SITE_G1] + r->mean[WEFT_SITE_G2]),
                                r->mean[WEFT_SITE_B]};
        for (int c = 0; c < 3; c++) {
            read[c] += mean[c] * reference[c];
            wanted[c] += reference[c] * reference[c];
        }
        n++;
    }
    if (n < 3 || !(read[0] > 0 && read[1] > 0 && read[2] > 0))
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "%d neutral patches are usable, 3 are wanted to balance white: expose so that none clips", n);
    for (int c = 0; c < 3; c++)
        gain[c] = wanted[c] / read[c];
    return WEFT_OK;
}

/* How the light changes over the chart, in logarithms per mm. */
typedef struct slope {
    double x, y;
} slope;

/* A plane through the logarithms of fitted over wanted luminance. */
static slope slope_of(const weft_chart *chart, const weft_patch_colour *colours, const weft_colour_fit *fit)
{
    double mx = 0, my = 0, n = 0, xx = 0, xy = 0, yy = 0, xr = 0, yr = 0;
    for (int round = 0; round < 2; round++) /* first the middle, then about it */
        for (int p = 0; p < chart->columns * chart->rows; p++) {
            double x, y, rgb[3];
            const double *const wanted = chart->patches[p].linear_srgb;
            if (colours[p].excluded)
                continue;
            weft_chart_patch_centre(chart, p, &x, &y);
            if (round == 0) {
                mx += x, my += y, n++;
                continue;
            }
            weft_colour_model_apply(&fit->model, colours[p].camera, rgb);
            const double r = log(fmax(weft_luminance(rgb[0], rgb[1], rgb[2]), 1e-4) /
                                 fmax(weft_luminance(wanted[0], wanted[1], wanted[2]), 1e-4));
            x -= mx / n, y -= my / n;
            xx += x * x, xy += x * y, yy += y * y, xr += x * r, yr += y * r;
        }
    const double det = xx * yy - xy * xy;
    return det > 0 ? (slope){(yy * xr - xy * yr) / det, (xx * yr - xy * xr) / det} : (slope){0, 0};
}

static double change_over(const weft_chart *chart, slope s)
{
    double half_x, half_y;
    weft_chart_half_size(chart, &half_x, &half_y);
    return expm1(2 * fmax(fabs(s.x) * half_x, fabs(s.y) * half_y));
}

static weft_err fit(const weft_chart *chart, const weft_patch_colour *colours, weft_colour_method method,
                    weft_colour_fit *result, weft_error *err)
{
    weft_colour_sample samples[WEFT_CHART_MAX_PATCHES];
    WEFT_TRY(weft_patch_samples(chart, colours, samples, err));
    return weft_colour_fit_patches(samples, chart->columns * chart->rows, method, result, err);
}

/* Model and slope of the light in turns: without the slope the model would bend to it. */
static weft_err fit_with_slope(const weft_chart *chart, weft_colour_method method, weft_photo_chart *s,
                               weft_error *err)
{
    weft_patch_colour flat[WEFT_CHART_MAX_PATCHES];
    slope total = {0, 0};
    memcpy(flat, s->colours, sizeof flat);
    WEFT_TRY(fit(chart, flat, method, &s->fit, err));
    for (int round = 0; round < SLOPE_ROUNDS; round++) {
        const slope more = slope_of(chart, flat, &s->fit);
        total.x += more.x;
        total.y += more.y;
        if (round == 0 && change_over(chart, total) < slope_least)
            break; /* as good as none: a free slope would only be two terms more */
        for (int p = 0; p < chart->columns * chart->rows; p++) {
            double x, y;
            weft_chart_patch_centre(chart, p, &x, &y);
            for (int c = 0; c < 3; c++)
                flat[p].camera[c] = s->colours[p].camera[c] * exp(-total.x * x - total.y * y);
        }
        WEFT_TRY(fit(chart, flat, method, &s->fit, err));
    }
    s->light_gradient = change_over(chart, total);
    memcpy(s->colours, flat, sizeof flat);
    return WEFT_OK;
}

weft_err weft_photo_correction_fit(const weft_photo *photo, const weft_chart *chart,
                                   const double (*corners)[2], const weft_texts *exclude,
                                   weft_colour_method method, weft_photo_chart *seen,
                                   weft_photo_correction *correction, weft_error *err)
{
    const weft_chart_picture picture = {&photo->image, photo->cfa, &photo->clipped};
    weft_patch_reading readings[WEFT_CHART_MAX_PATCHES];
    weft_patch_light light = {.readings = readings};
    weft_photo_chart s = {.chart = chart};
    weft_photo_correction c = {.exposure = photo->exposure};
    WEFT_TRY(corners ? weft_chart_place(chart, &picture, corners, &s.pose, err)
                     : weft_chart_locate(chart, &picture, &s.pose, err));
    WEFT_TRY(weft_chart_measure(chart, &picture, &s.pose, readings, err));
    WEFT_TRY(balance(chart, readings, c.gain, err));
    for (int p = 0; p < WEFT_CHART_MAX_PATCHES; p++)
        for (int k = 0; k < 3; k++)
            light.irradiance[p][k] = 1 / c.gain[k];
    weft_patch_colours(chart, &light, 1, s.colours);
    WEFT_TRY(weft_patch_exclude(chart, exclude, s.colours, err));
    WEFT_TRY(fit_with_slope(chart, method, &s, err));
    weft_patch_fill_part(chart, s.colours, &s.fit, &c.colour);
    *seen = s;
    *correction = c;
    return WEFT_OK;
}

weft_err weft_photo_correction_of(const weft_calibration *cal, const char *folder,
                                  weft_photo_correction *correction, weft_error *err)
{
    weft_photo_correction c = {.colour = cal->colour};
    WEFT_TRY(weft_calibration_require(cal, WEFT_CALIBRATION_COLOUR | WEFT_CALIBRATION_LIGHTS, folder, err));
    for (int l = 0; l < cal->n_lights; l++)
        for (int k = 0; k < 3; k++)
            c.gain[k] += cal->lights[l].white_balance[k] / cal->n_lights;
    *correction = c;
    return WEFT_OK;
}

weft_err weft_photo_correct(weft_photo *photo, const weft_photo_correction *correction, weft_error *err)
{
    const bool known = correction->exposure > 0 && photo->exposure > 0;
    const double scale = known ? correction->exposure / photo->exposure : 1;
    double gain[3];
    for (int c = 0; c < 3; c++)
        gain[c] = scale * correction->gain[c];
    WEFT_TRY(weft_photo_develop(photo, gain, err));
    for (int v = 0; v < photo->image.height; v++) {
        float *const rgb[3] = {weft_image_row(&photo->image, 0, v), weft_image_row(&photo->image, 1, v),
                               weft_image_row(&photo->image, 2, v)};
        weft_colour_model_apply_row(&correction->colour.model, rgb, photo->image.width);
    }
    return WEFT_OK;
}
