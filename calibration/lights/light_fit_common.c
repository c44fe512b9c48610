/* S, what all lights see alike: its polynomial, and which part of it is Phi's. */
#include "calibration/lights/light_fit_internal.h"
#include "core/mem.h"

#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N_UNKNOWNS = 3 + FIT_COMMON }; /* a constant for each channel */
#define ROUNDS 6
#define TUKEY  4.685

static void row_of(const fit_problem *f, int channel, int cell, double row[N_UNKNOWNS])
{
    memset(row, 0, N_UNKNOWNS * sizeof *row);
    row[channel] = 1;
    for (int k = 0; k < FIT_COMMON; k++) {
        double one[FIT_COMMON] = {0};
        one[k] = 1;
        row[3 + k] = fit_common_log(one, f->place[cell]);
    }
}

static bool is_there(const fit_problem *f, int channel, int cell)
{
    for (int l = 0; l < f->n_lights; l++)
        if (f->weight[fit_plane(f, l, channel) + (size_t)cell] > 0)
            return true;
    return false;
}

static double rest_of(const fit_problem *f, int channel, int cell, const double x[N_UNKNOWNS])
{
    return f->common[(size_t)channel * (size_t)f->n_cells + (size_t)cell] - x[channel] -
           fit_common_log(x + 3, f->place[cell]);
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double scatter(const fit_problem *f, const double x[N_UNKNOWNS], double *scratch)
{
    int n = 0;
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < f->n_cells; i++)
            if (is_there(f, c, i))
                scratch[n++] = fabs(rest_of(f, c, i, x));
    if (n == 0)
        return 1;
    qsort(scratch, (size_t)n, sizeof *scratch, compare_doubles);
    return fmax(1.4826 * scratch[n / 2], 1e-7);
}

static bool solve_round(const fit_problem *f, double width, double x[N_UNKNOWNS])
{
    double h[N_UNKNOWNS][N_UNKNOWNS] = {{0}}, g[N_UNKNOWNS] = {0}, row[N_UNKNOWNS];
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < f->n_cells; i++) {
            if (!is_there(f, c, i))
                continue;
            const double r = rest_of(f, c, i, x), t = r / width;
            if (t * t >= 1)
                continue;
            const double w = (1 - t * t) * (1 - t * t);
            row_of(f, c, i, row);
            for (int j = 0; j < N_UNKNOWNS; j++) {
                g[j] += w * r * row[j];
                for (int k = 0; k <= j; k++)
                    h[j][k] += w * row[j] * row[k];
            }
        }
    if (LAPACKE_dposv(LAPACK_ROW_MAJOR, 'L', N_UNKNOWNS, 1, h[0], N_UNKNOWNS, g, 1) != 0)
        return false;
    for (int k = 0; k < N_UNKNOWNS; k++)
        x[k] += g[k];
    return true;
}

weft_err fit_settle_common(fit_problem *f, weft_error *err)
{
    double x[N_UNKNOWNS] = {0};
    double *const scratch = weft_alloc(3 * (size_t)f->n_cells, sizeof *scratch, err);
    if (!scratch)
        return WEFT_ERR_NOMEM;
    bool solved = solve_round(f, 1e3, x); /* all alike at first */
    for (int round = 0; round < ROUNDS && solved; round++)
        solved = solve_round(f, TUKEY * scatter(f, x, scratch), x);
    weft_free(scratch);
    if (!solved)
        return weft_fail(err, WEFT_ERR_NODATA, "the vignetting of the camera cannot be told from the sheet");
    for (int c = 0; c < 3; c++) {
        for (int l = 0; l < f->n_lights; l++)
            f->lamps[l].log_phi[c] += x[c];
        for (int i = 0; i < f->n_cells; i++)
            f->common[(size_t)c * (size_t)f->n_cells + (size_t)i] -= x[c];
    }
    memcpy(f->v, x + 3, sizeof f->v);
    return WEFT_OK;
}
