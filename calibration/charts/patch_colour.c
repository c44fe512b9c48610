#include "calibration/charts/patch_colour.h"

#include "calibration/charts/robust.h"
#include "core/text.h"

#include <assert.h>
#include <math.h>
#include <string.h>
#include <strings.h>

const char *const weft_patch_clipped = "clipped";
const char *const weft_patch_unsteady = "the lights disagree by more than 5 %";
const char *const weft_patch_dark = "too dark";
const char *const weft_patch_stained = "dust or a stain: it is not of one colour";
const char *const weft_patch_by_hand = "by hand";

static const double unsteady = 0.05;
static const double uneven = 0.03;       /* S-FC3-03 allows 5 % with the noise */
static const double stained_share = 0.1; /* of photosites that are of another colour */
static const double apart = 0.03;        /* a light within this of the median is never left out */

/* Reflectance of one patch as each light shows it. */
typedef struct views {
    int n;
    int stained; /* views in which the patch is not one colour */
    double rgb[WEFT_LIGHTS_MAX][3];
} views;

static views look(const weft_patch_light *lights, int n_lights, int patch)
{
    views v = {0};
    for (int l = 0; l < n_lights; l++) {
        const weft_patch_reading *const r = &lights[l].readings[patch];
        const double *const e = lights[l].irradiance[patch];
        if (r->clipped > 0)
            continue;
        v.stained += r->unevenness > uneven || r->outliers > stained_share;
        v.rgb[v.n][0] = r->mean[WEFT_SITE_R] / e[0];
        v.rgb[v.n][1] = 0.5 * (r->mean[WEFT_SITE_G1] + r->mean[WEFT_SITE_G2]) / e[1];
        v.rgb[v.n][2] = r->mean[WEFT_SITE_B] / e[2];
        v.n++;
    }
    return v;
}

/* Leaves the views that agree with the median in every channel. */
static void drop_strays(views *v)
{
    double median[3], limit[3], column[WEFT_LIGHTS_MAX];
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < v->n; i++)
            column[i] = v->rgb[i][c];
        median[c] = weft_median(column, v->n);
        for (int i = 0; i < v->n; i++)
            column[i] = fabs(v->rgb[i][c] - median[c]);
        limit[c] = fmax(3.5 * 1.4826 * weft_median(column, v->n), apart * fabs(median[c]));
    }
    int kept = 0;
    for (int i = 0; i < v->n; i++) {
        bool stays = true;
        for (int c = 0; c < 3; c++)
            stays &= fabs(v->rgb[i][c] - median[c]) <= limit[c];
        if (stays)
            memcpy(v->rgb[kept++], v->rgb[i], sizeof v->rgb[i]);
    }
    v->n = kept;
}

static void average(const views *v, weft_patch_colour *colour)
{
    for (int c = 0; c < 3; c++) {
        double sum = 0, square = 0;
        for (int i = 0; i < v->n; i++)
            sum += v->rgb[i][c];
        const double mean = sum / v->n;
        for (int i = 0; i < v->n; i++)
            square += (v->rgb[i][c] - mean) * (v->rgb[i][c] - mean);
        colour->camera[c] = mean;
        if (v->n > 1 && mean > 0)
            colour->spread = fmax(colour->spread, sqrt(square / (v->n - 1)) / mean);
    }
}

void weft_patch_colours(const weft_chart *chart, const weft_patch_light *lights, int n_lights,
                        weft_patch_colour *colours)
{
    assert(n_lights <= WEFT_LIGHTS_MAX);
    for (int p = 0; p < chart->columns * chart->rows; p++) {
        views v = look(lights, n_lights, p);
        colours[p] = (weft_patch_colour){0};
        if (2 * v.n < n_lights || v.n == 0) {
            colours[p].excluded = weft_patch_clipped;
            continue;
        }
        const bool stained = 2 * v.stained > v.n;
        drop_strays(&v);
        colours[p].n_lights = v.n;
        if (v.n == 0) {
            colours[p].excluded = weft_patch_unsteady;
            continue;
        }
        average(&v, &colours[p]);
        const double *const rgb = colours[p].camera;
        if (!(rgb[0] > 0 && rgb[1] > 0 && rgb[2] > 0))
            colours[p].excluded = weft_patch_dark;
        else if (stained)
            colours[p].excluded = weft_patch_stained;
        else if (colours[p].spread > unsteady || 2 * v.n < n_lights)
            colours[p].excluded = weft_patch_unsteady;
    }
}

weft_err weft_patch_exclude(const weft_chart *chart, const weft_texts *names, weft_patch_colour *colours,
                            weft_error *err)
{
    const int n = chart->columns * chart->rows;
    for (int i = 0; i < names->n; i++) {
        int patch = -1, number;
        if (weft_text_to_int(names->values[i], &number) && number >= 1 && number <= n)
            patch = number - 1;
        for (int p = 0; p < n && patch < 0; p++)
            if (strcasecmp(chart->patches[p].name, names->values[i]) == 0)
                patch = p;
        if (patch < 0)
            return weft_fail(
                err, WEFT_ERR_USAGE,
                "--exclude %s: the chart has no such patch; give its number, 1 to %d, or its name as "
                "\"%s\"",
                names->values[i], n, chart->patches[0].name);
        colours[patch].excluded = weft_patch_by_hand;
    }
    return WEFT_OK;
}

weft_err weft_patch_samples(const weft_chart *chart, const weft_patch_colour *colours,
                            weft_colour_sample *samples, weft_error *err)
{
    const int n = chart->columns * chart->rows;
    int clipped = 0;
    for (int p = 0; p < n; p++) {
        memcpy(samples[p].camera, colours[p].camera, sizeof samples[p].camera);
        memcpy(samples[p].reference, chart->patches[p].linear_srgb, sizeof samples[p].reference);
        samples[p].used = !colours[p].excluded;
        clipped += colours[p].excluded == weft_patch_clipped;
    }
    if (clipped > n / 4)
        return weft_fail(err, WEFT_ERR_NODATA,
                         "%d of %d patches are clipped: take the chart with a shorter exposure", clipped, n);
    return WEFT_OK;
}

void weft_patch_fill_part(const weft_chart *chart, const weft_patch_colour *colours,
                          const weft_colour_fit *fit, weft_colour_part *part)
{
    *part = (weft_colour_part){.model = fit->model,
                               .delta_e_mean = fit->trained_mean,
                               .delta_e_max = fit->trained_max,
                               .delta_e_held_out_mean = fit->held_out_mean};
    for (int p = 0; p < chart->columns * chart->rows; p++)
        if (!colours[p].excluded)
            memcpy(part->gamut[part->n_gamut++], chart->patches[p].linear_srgb, sizeof part->gamut[0]);
}
