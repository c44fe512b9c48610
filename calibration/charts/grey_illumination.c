#include "calibration/charts/grey_illumination.h"

#include <lapacke.h>
#include <math.h>

enum { TERMS = 5, ROWS = WEFT_CHART_MAX_PATCHES + 4 };

/* Ridge on gradient and quadratic terms, in units of the weighted residuals; positions in units of scale_mm.
 */
static const double gradient_price = 2, quadratic_price = 0.3, scale_mm = 50;

/* Mean over the classes of the logarithm of a reading; false when it tells nothing. */
static bool log_reading(const weft_patch_reading *reading, double *value)
{
    *value = 0;
    for (int s = 0; s < WEFT_SITES; s++) {
        if (!(reading->mean[s] > 0) || reading->clipped > 0)
            return false;
        *value += log(reading->mean[s]) / WEFT_SITES;
    }
    return true;
}

static void terms_at(const weft_chart *chart, int patch, double t[TERMS])
{
    double x, y;
    weft_chart_patch_centre(chart, patch, &x, &y);
    x /= scale_mm;
    y /= scale_mm;
    t[0] = 1;
    t[1] = x;
    t[2] = y;
    t[3] = x * x + y * y;
    t[4] = x * y;
}

/* Level of each lamp: the mean over the patches that all lamps show, so that no patch weighs on one lamp
 * only. */
static void find_levels(const weft_chart *chart, const weft_patch_reading *const *readings, int n_lights,
                        double *level)
{
    for (int l = 0; l < n_lights; l++)
        level[l] = 0;
    int shared = 0;
    for (int p = 0; p < chart->columns * chart->rows; p++) {
        double value;
        bool all = true;
        for (int l = 0; l < n_lights && all; l++)
            all = log_reading(&readings[l][p], &value);
        for (int l = 0; l < n_lights && all; l++) {
            log_reading(&readings[l][p], &value);
            level[l] += value;
        }
        shared += all;
    }
    for (int l = 0; l < n_lights && shared; l++)
        level[l] /= shared;
}

/* Geometric mean over the lamps of what a patch shows, levels taken out; false when none shows it. */
static bool common_reading(const weft_patch_reading *const *readings, int n_lights, const double *level,
                           int patch, double *common)
{
    int n = 0;
    *common = 0;
    for (int l = 0; l < n_lights; l++) {
        double value;
        if (!log_reading(&readings[l][patch], &value))
            continue;
        *common += value - level[l];
        n++;
    }
    *common /= n ? n : 1;
    return n > 0;
}

/* The smooth common light: coefficients of terms_at(). */
static void fit_common(const weft_chart *chart, const weft_patch_reading *const *readings, int n_lights,
                       const double *level, double coefficients[TERMS])
{
    double a[ROWS][TERMS] = {{0}}, b[ROWS] = {0}, common;
    int rows = 0;
    for (int p = 0; p < chart->columns * chart->rows; p++) {
        const double rho = weft_munsell_reflectance(chart->patches[p].munsell_value), w = sqrt(rho);
        if (!(rho > 0) || !common_reading(readings, n_lights, level, p, &common))
            continue;
        terms_at(chart, p, a[rows]);
        for (int k = 0; k < TERMS; k++)
            a[rows][k] *= w;
        b[rows++] = w * (common - log(rho));
    }
    for (int k = 1; k < TERMS; k++)
        a[rows++][k] = k < 3 ? gradient_price : quadratic_price;
    for (int k = 0; k < TERMS; k++)
        coefficients[k] = 0;
    lapack_int pivots[TERMS] = {0}, rank = 0;
    if (rows >= TERMS + 4 &&
        LAPACKE_dgelsy(LAPACK_ROW_MAJOR, rows, TERMS, 1, a[0], TERMS, b, 1, pivots, 1e-10, &rank) == 0)
        for (int k = 0; k < TERMS; k++)
            coefficients[k] = b[k];
}

void weft_grey_illumination(const weft_chart *chart, const weft_patch_reading *const *readings, int n_lights,
                            weft_grey_irradiance *irradiance)
{
    double level[WEFT_LIGHTS_MAX], coefficients[TERMS], t[TERMS], common, value;
    find_levels(chart, readings, n_lights, level);
    fit_common(chart, readings, n_lights, level, coefficients);
    for (int p = 0; p < chart->columns * chart->rows; p++) {
        const bool shown = common_reading(readings, n_lights, level, p, &common);
        double smooth = 0;
        terms_at(chart, p, t);
        for (int k = 1; k < TERMS; k++)
            smooth += coefficients[k] * t[k];
        for (int l = 0; l < n_lights; l++) {
            const bool seen = shown && log_reading(&readings[l][p], &value);
            const double e = seen ? exp(smooth + value - level[l] - common) : 1;
            for (int c = 0; c < 3; c++)
                irradiance[l][p][c] = e;
        }
    }
}
