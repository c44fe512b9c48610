#include "calibration/charts/colour_lsq.h"

#include <assert.h>
#include <lapacke.h>
#include <math.h>
#include <string.h>

/* Columns that agree to this are one column: the fits here have conditions of 7 to some 1e5. */
static const double rcond = 1e-8;

enum { A_STRIDE = WEFT_LSQ_TERMS_MAX, B_STRIDE = WEFT_LSQ_SIDES_MAX };

static void weigh_and_scale(const weft_colour_lsq *s, double a[][A_STRIDE], double b[][B_STRIDE],
                            double scale[A_STRIDE])
{
    for (int k = 0; k < s->n_terms; k++) {
        double square = 0;
        for (int r = 0; r < s->n_rows; r++) {
            a[r][k] = s->weight[r] * s->a[r][k];
            square += a[r][k] * a[r][k];
        }
        scale[k] = square > 0 ? 1 / sqrt(square) : 1;
        for (int r = 0; r < s->n_rows; r++)
            a[r][k] *= scale[k];
    }
    for (int r = 0; r < s->n_rows; r++)
        for (int i = 0; i < s->n_sides; i++)
            b[r][i] = s->weight[r] * s->b[r][i];
}

static double condition_of(const weft_colour_lsq *s, const double scaled[][A_STRIDE])
{
    double a[WEFT_CHART_MAX_PATCHES][A_STRIDE], singular[A_STRIDE], superb[A_STRIDE];
    memcpy(a, scaled, sizeof a);
    if (LAPACKE_dgesvd(LAPACK_ROW_MAJOR, 'N', 'N', s->n_rows, s->n_terms, a[0], A_STRIDE, singular, NULL, 1,
                       NULL, s->n_terms, superb) != 0 ||
        !(singular[s->n_terms - 1] > 0))
        return (double)INFINITY;
    return singular[0] / singular[s->n_terms - 1];
}

int weft_colour_lsq_solve(const weft_colour_lsq *system, double x[WEFT_LSQ_SIDES_MAX][WEFT_LSQ_TERMS_MAX],
                          double *condition)
{
    const weft_colour_lsq *const s = system;
    double a[WEFT_CHART_MAX_PATCHES][A_STRIDE] = {{0}}, b[WEFT_CHART_MAX_PATCHES][B_STRIDE] = {{0}};
    double scale[A_STRIDE];
    lapack_int pivots[A_STRIDE] = {0}, rank = 0;
    assert(s->n_rows <= WEFT_CHART_MAX_PATCHES && s->n_terms <= A_STRIDE && s->n_sides <= B_STRIDE);
    if (s->n_rows < s->n_terms)
        return -1;
    weigh_and_scale(s, a, b, scale);
    if (condition)
        *condition = condition_of(s, (const double(*)[A_STRIDE])a);
    if (LAPACKE_dgelsy(LAPACK_ROW_MAJOR, s->n_rows, s->n_terms, s->n_sides, a[0], A_STRIDE, b[0], B_STRIDE,
                       pivots, rcond, &rank) != 0)
        return -1;
    for (int i = 0; i < s->n_sides; i++)
        for (int k = 0; k < s->n_terms; k++)
            x[i][k] = b[k][i] * scale[k];
    return rank;
}
