#include "calibration/charts/colour_sequence.h"

#include "calibration/charts/colour_lsq.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static void begin(weft_colour_lsq *s, int n, int n_sides)
{
    assert(n <= WEFT_CHART_MAX_PATCHES);
    *s = (weft_colour_lsq){.n_rows = n, .n_terms = 4, .n_sides = n_sides};
    for (int r = 0; r < n; r++)
        s->weight[r] = 1;
}

int weft_colour_affine_fit(int n, const double (*x)[3], const double (*y)[3], double m[3][4],
                           double *condition)
{
    weft_colour_lsq s;
    double solution[WEFT_LSQ_SIDES_MAX][WEFT_LSQ_TERMS_MAX] = {{0}};
    begin(&s, n, 3);
    for (int r = 0; r < n; r++) {
        memcpy(s.a[r], x[r], sizeof x[r]);
        s.a[r][3] = 1;
        memcpy(s.b[r], y[r], sizeof y[r]);
    }
    const int rank = weft_colour_lsq_solve(&s, solution, condition);
    for (int c = 0; c < 3; c++)
        memcpy(m[c], solution[c], sizeof m[c]);
    return rank;
}

int weft_colour_cubic_fit(int n, const double (*x)[3], const double (*y)[3], double m[3][4])
{
    int least = 4;
    for (int c = 0; c < 3; c++) {
        weft_colour_lsq s;
        double solution[WEFT_LSQ_SIDES_MAX][WEFT_LSQ_TERMS_MAX] = {{0}};
        begin(&s, n, 1);
        for (int r = 0; r < n; r++) {
            s.a[r][0] = 1;
            for (int k = 1; k < 4; k++)
                s.a[r][k] = s.a[r][k - 1] * x[r][c];
            s.b[r][0] = y[r][c];
        }
        const int rank = weft_colour_lsq_solve(&s, solution, NULL);
        least = rank < least ? rank : least;
        memcpy(m[c], solution[0], sizeof m[c]);
    }
    return least;
}

/* Whether the slope is above 0 on the whole range: at its ends and at its own extreme. */
static bool monotone(const double a[4], const double range[2])
{
    const double extreme = a[3] != 0 ? -a[2] / (3 * a[3]) : range[0];
    const double at[3] = {range[0], range[1], fmin(fmax(extreme, range[0]), range[1])};
    for (int i = 0; i < 3; i++)
        if (!(a[1] + at[i] * (2 * a[2] + at[i] * 3 * a[3]) > 0))
            return false;
    return true;
}

static void find_range(int n, const double (*x)[3], double range[3][2])
{
    for (int c = 0; c < 3; c++) {
        range[c][0] = (double)INFINITY;
        range[c][1] = -(double)INFINITY;
        for (int r = 0; r < n; r++) {
            range[c][0] = fmin(range[c][0], x[r][c]);
            range[c][1] = fmax(range[c][1], x[r][c]);
        }
    }
}

/* What the steps so far make of the inputs; the last step is still the identity. */
static void advance(int n, const double (*x)[3], const weft_colour_sequence *sequence, double (*out)[3])
{
    for (int r = 0; r < n; r++)
        weft_colour_sequence_apply(sequence, x[r], out[r]);
}

int weft_colour_sequence_fit(int n, const double (*x)[3], const double (*y)[3], bool guarded,
                             weft_colour_sequence *sequence, double *condition)
{
    weft_colour_sequence s = {.second = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
    double stage[WEFT_CHART_MAX_PATCHES][3];
    int rank = weft_colour_affine_fit(n, x, y, s.first, condition);
    if (rank < 4)
        return rank;
    advance(n, x, &s, stage);
    find_range(n, (const double(*)[3])stage, s.range);
    rank = weft_colour_cubic_fit(n, (const double(*)[3])stage, y, s.cubic);
    if (rank < 4)
        return rank;
    s.has_cubic = true;
    for (int c = 0; c < 3 && guarded; c++)
        s.has_cubic &= monotone(s.cubic[c], s.range[c]);
    advance(n, x, &s, stage);
    rank = weft_colour_affine_fit(n, (const double(*)[3])stage, y, s.second, NULL);
    if (rank == 4)
        *sequence = s;
    return rank;
}
