#include "calibration/charts/colour_fit.h"

#include "core/colour.h"

#include <assert.h>
#include <lapacke.h>
#include <math.h>

static const double rcond = 1e-6;            /* columns that agree to this are one column */
static const double darkest_weighted = 0.01; /* Y below which a patch weighs no more */

static double luminance_of(const double rgb[3])
{
    return weft_luminance(rgb[0], rgb[1], rgb[2]);
}

/* Rows of used samples but `left_out`, weighted; columns scaled to length 1.  Returns the number of rows. */
static int fill_system(const weft_colour_sample *samples, int n, int left_out, double a[][3], double b[][3],
                       double scale[3])
{
    int rows = 0;
    scale[0] = scale[1] = scale[2] = 0;
    for (int i = 0; i < n; i++) {
        if (!samples[i].used || i == left_out)
            continue;
        const double weight = 1 / fmax(luminance_of(samples[i].reference), darkest_weighted);
        for (int c = 0; c < 3; c++) {
            a[rows][c] = weight * samples[i].camera[c];
            b[rows][c] = weight * samples[i].reference[c];
            scale[c] += a[rows][c] * a[rows][c];
        }
        rows++;
    }
    for (int c = 0; c < 3; c++)
        scale[c] = scale[c] > 0 ? 1 / sqrt(scale[c]) : 1;
    for (int r = 0; r < rows; r++)
        for (int c = 0; c < 3; c++)
            a[r][c] *= scale[c];
    return rows;
}

/* The matrix without one sample (-1: with all).  Returns the rank, or -1 when LAPACK refuses. */
static int solve(const weft_colour_sample *samples, int n, int left_out, weft_mat3 *matrix)
{
    double a[WEFT_CHART_MAX_PATCHES][3], b[WEFT_CHART_MAX_PATCHES][3], scale[3];
    const int rows = fill_system(samples, n, left_out, a, b, scale);
    lapack_int pivots[3] = {0}, rank = 0;
    if (rows < 3 || LAPACKE_dgelsy(LAPACK_ROW_MAJOR, rows, 3, 3, a[0], 3, b[0], 3, pivots, rcond, &rank) != 0)
        return -1;
    for (int out = 0; out < 3; out++)
        for (int in = 0; in < 3; in++)
            matrix->m[3 * out + in] = b[in][out] * scale[in];
    return rank;
}

static double condition_of(const weft_colour_sample *samples, int n)
{
    double a[WEFT_CHART_MAX_PATCHES][3], b[WEFT_CHART_MAX_PATCHES][3], scale[3], singular[3], superb[2];
    const int rows = fill_system(samples, n, -1, a, b, scale);
    if (LAPACKE_dgesvd(LAPACK_ROW_MAJOR, 'N', 'N', rows, 3, a[0], 3, singular, NULL, 1, NULL, 3, superb) !=
            0 ||
        !(singular[2] > 0))
        return (double)INFINITY;
    return singular[0] / singular[2];
}

static double error_of(const weft_colour_sample *s, const weft_mat3 *matrix)
{
    const weft_vec3 v = weft_mat3_apply(matrix, (weft_vec3){s->camera[0], s->camera[1], s->camera[2]});
    double seen[3], wanted[3];
    weft_srgb_to_lab((const double[]){v.x, v.y, v.z}, seen);
    weft_srgb_to_lab(s->reference, wanted);
    return weft_delta_e_2000(seen, wanted);
}

/* What the eye would see without the matrix: camera RGB as it is, brightness matched over the patches. */
static weft_mat3 plain_scale(const weft_colour_sample *samples, int n)
{
    double wanted = 0, seen = 0;
    for (int i = 0; i < n; i++)
        if (samples[i].used) {
            wanted += luminance_of(samples[i].reference);
            seen += luminance_of(samples[i].camera);
        }
    const double k = seen > 0 ? wanted / seen : 1;
    return (weft_mat3){{k, 0, 0, 0, k, 0, 0, 0, k}};
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

static weft_err check_samples(const weft_colour_sample *samples, int n, int *n_used, weft_error *err)
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
    if (*n_used < WEFT_COLOUR_PATCHES_MIN)
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "%d patches are usable, a colour matrix wants %d: mend exposure (nothing clipped, nothing "
            "black) and take the chart again",
            *n_used, WEFT_COLOUR_PATCHES_MIN);
    return WEFT_OK;
}

weft_err weft_colour_fit_matrix(const weft_colour_sample *samples, int n, weft_colour_fit *fit,
                                weft_error *err)
{
    assert(n <= WEFT_CHART_MAX_PATCHES);
    weft_colour_fit result = {0};
    WEFT_TRY(check_samples(samples, n, &result.n_used, err));
    result.rank = solve(samples, n, -1, &result.to_linear_srgb);
    result.condition = condition_of(samples, n);
    if (result.rank < 3)
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "the patches' colours determine only %d of 3 columns of the matrix: is this a chart of greys?",
            result.rank < 0 ? 0 : result.rank);
    const weft_mat3 plain = plain_scale(samples, n);
    for (int i = 0; i < n; i++) {
        weft_mat3 without = result.to_linear_srgb; /* a patch that was not used is held out as it is */
        if (samples[i].used)
            solve(samples, n, i, &without);
        result.before[i] = error_of(&samples[i], &plain);
        result.trained[i] = error_of(&samples[i], &result.to_linear_srgb);
        result.held_out[i] = error_of(&samples[i], &without);
    }
    summarise(samples, n, result.before, &result.before_mean, &result.before_max);
    summarise(samples, n, result.trained, &result.trained_mean, &result.trained_max);
    summarise(samples, n, result.held_out, &result.held_out_mean, &result.held_out_max);
    *fit = result;
    return WEFT_OK;
}
