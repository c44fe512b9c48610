#include "calibration/charts/colour_fit.h"

#include "calibration/charts/colour_lsq.h"
#include "calibration/charts/colour_sequence.h"
#include "core/colour.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static const double darkest_weighted = 0.01; /* Y below which a patch weighs no more */

static double luminance_of(const double rgb[3])
{
    return weft_luminance(rgb[0], rgb[1], rgb[2]);
}

/* The matrix errs most where it is dark, in relative terms; the roots do not, and are better left alone:
 * on 24 patches under a white LED 0.86 held out instead of 1.10. */
static double weight_of(const weft_colour_sample *s, int n_terms)
{
    if (n_terms > 3)
        return 1;
    return 1 / fmax(luminance_of(s->reference), darkest_weighted);
}

/* Matrix or root-polynomial in linear sRGB, without one sample (-1: with all).  Returns the rank. */
static int fit_terms(const weft_colour_sample *samples, int n, int left_out, int n_terms,
                     double x[3][WEFT_LSQ_TERMS_MAX], double *condition)
{
    weft_colour_lsq s = {.n_terms = n_terms, .n_sides = 3};
    for (int i = 0; i < n; i++) {
        double terms[WEFT_COLOUR_ROOT_TERMS];
        if (!samples[i].used || i == left_out)
            continue;
        weft_colour_root_terms(samples[i].camera, terms); /* the matrix's terms are the first three */
        memcpy(s.a[s.n_rows], terms, (size_t)n_terms * sizeof *terms);
        memcpy(s.b[s.n_rows], samples[i].reference, sizeof samples[i].reference);
        s.weight[s.n_rows++] = weight_of(&samples[i], n_terms);
    }
    return weft_colour_lsq_solve(&s, x, condition);
}

static void to_xyy(const double rgb[3], double xyy[3])
{
    double xyz[3];
    weft_srgb_to_xyz(rgb, xyz);
    weft_xyz_to_xyy(xyz, xyy);
}

static int fit_sequence(const weft_colour_sample *samples, int n, int left_out,
                        weft_colour_sequence *sequence, double *condition)
{
    double x[WEFT_CHART_MAX_PATCHES][3], y[WEFT_CHART_MAX_PATCHES][3];
    int rows = 0;
    for (int i = 0; i < n; i++)
        if (samples[i].used && i != left_out) {
            to_xyy(samples[i].camera, x[rows]);
            to_xyy(samples[i].reference, y[rows++]);
        }
    return weft_colour_sequence_fit(rows, (const double(*)[3])x, (const double(*)[3])y, true, sequence,
                                    condition);
}

static int terms_of(weft_colour_method method)
{
    return method == WEFT_COLOUR_MATRIX            ? 3
           : method == WEFT_COLOUR_ROOT_POLYNOMIAL ? WEFT_COLOUR_ROOT_TERMS
                                                   : 4;
}

/* The model without one sample (-1: with all).  Returns the rank of the method's columns. */
static int solve(const weft_colour_sample *samples, int n, int left_out, weft_colour_model *model,
                 double *condition)
{
    double x[3][WEFT_LSQ_TERMS_MAX] = {{0}};
    int rank = fit_terms(samples, n, left_out, 3, x, condition);
    for (int i = 0; i < 9; i++)
        model->matrix.m[i] = x[i / 3][i % 3];
    if (rank < 3 || model->method == WEFT_COLOUR_MATRIX)
        return rank;
    if (model->method == WEFT_COLOUR_SEQUENCE)
        return fit_sequence(samples, n, left_out, &model->sequence, condition);
    rank = fit_terms(samples, n, left_out, WEFT_COLOUR_ROOT_TERMS, x, condition);
    for (int c = 0; c < 3; c++)
        memcpy(model->root[c], x[c], sizeof model->root[c]);
    return rank;
}

static double error_of(const weft_colour_sample *s, const weft_colour_model *model)
{
    double rgb[3], seen[3], wanted[3];
    weft_colour_model_apply(model, s->camera, rgb);
    weft_srgb_to_lab(rgb, seen);
    weft_srgb_to_lab(s->reference, wanted);
    return weft_delta_e_2000(seen, wanted);
}

/* What the eye would see without the model: camera RGB as it is, brightness matched over the patches. */
static weft_colour_model plain_scale(const weft_colour_sample *samples, int n)
{
    double wanted = 0, seen = 0;
    for (int i = 0; i < n; i++)
        if (samples[i].used) {
            wanted += luminance_of(samples[i].reference);
            seen += luminance_of(samples[i].camera);
        }
    const double k = seen > 0 ? wanted / seen : 1;
    return (weft_colour_model){.method = WEFT_COLOUR_MATRIX, .matrix = {{k, 0, 0, 0, k, 0, 0, 0, k}}};
}

static void summarise(const weft_colour_sample *samples, int n, const double *errors, double *mean,
                      double *max)
{
    int used = 0;
    *mean = *max = 0;
    for (int i = 0; i < n; i++)
        if (samples[i].used) {
            *mean += errors[i];
            *max = fmax(*max, errors[i]);
            used++;
        }
    *mean /= used;
}

int weft_colour_patches_min(weft_colour_method method)
{
    return 3 * terms_of(method);
}

static weft_err check_samples(const weft_colour_sample *samples, int n, weft_colour_method method,
                              int *n_used, weft_error *err)
{
    *n_used = 0;
    for (int i = 0; i < n; i++) {
        if (!samples[i].used)
            continue;
        for (int c = 0; c < 3; c++)
            if (!isfinite(samples[i].camera[c]) || !isfinite(samples[i].reference[c]))
                return weft_fail(err, WEFT_ERR_NODATA, "patch %d has no finite colour", i + 1);
        ++*n_used;
    }
    if (*n_used < weft_colour_patches_min(method))
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "%d patches are usable, the method %s wants %d: mend exposure (nothing clipped, nothing "
            "black) and take the chart again",
            *n_used, weft_colour_method_name(method), weft_colour_patches_min(method));
    return WEFT_OK;
}

weft_err weft_colour_fit_patches(const weft_colour_sample *samples, int n, weft_colour_method method,
                                 weft_colour_fit *fit, weft_error *err)
{
    assert(n <= WEFT_CHART_MAX_PATCHES);
    weft_colour_fit result = {.model.method = method, .n_terms = terms_of(method)};
    WEFT_TRY(check_samples(samples, n, method, &result.n_used, err));
    result.rank = solve(samples, n, -1, &result.model, &result.condition);
    if (result.rank < result.n_terms)
        return weft_fail(err, WEFT_ERR_NODATA,
                         "the patches' colours determine only %d of %d columns of the fit: is this a chart "
                         "of greys?",
                         result.rank < 0 ? 0 : result.rank, result.n_terms);
    const weft_colour_model plain = plain_scale(samples, n);
    for (int i = 0; i < n; i++) {
        weft_colour_model without = result.model; /* a patch that was not used is held out as it is */
        if (samples[i].used)
            solve(samples, n, i, &without, NULL);
        result.before[i] = error_of(&samples[i], &plain);
        result.trained[i] = error_of(&samples[i], &result.model);
        result.held_out[i] = error_of(&samples[i], &without);
    }
    summarise(samples, n, result.before, &result.before_mean, &result.before_max);
    summarise(samples, n, result.trained, &result.trained_mean, &result.trained_max);
    summarise(samples, n, result.held_out, &result.held_out_mean, &result.held_out_max);
    *fit = result;
    return WEFT_OK;
}
