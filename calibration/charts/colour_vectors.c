#include "calibration/charts/colour_vectors.h"

#include "calibration/charts/colour_sequence.h"

#include <math.h>

/* One problem: rows that follow each other with the same number.  Each fit is applied to its own patches. */
static void solve_problem(int n, int at, const double *const *in, double *const *out)
{
    double x[WEFT_CHART_MAX_PATCHES][3], y[WEFT_CHART_MAX_PATCHES][3];
    double affine[3][4] = {{0}}, cubic[3][4] = {{0}};
    weft_colour_sequence sequence = {.first = {{0}}};
    for (int r = 0; r < n; r++)
        for (int c = 0; c < 3; c++) {
            x[r][c] = in[1 + c][at + r];
            y[r][c] = in[4 + c][at + r];
        }
    const double(*const px)[3] = (const double(*)[3])x, (*const py)[3] = (const double(*)[3])y;
    const bool solved = weft_colour_affine_fit(n, px, py, affine, NULL) == 4 &&
                        weft_colour_cubic_fit(n, px, py, cubic) == 4 &&
                        weft_colour_sequence_fit(n, px, py, false, &sequence, NULL) == 4;
    for (int r = 0; r < n; r++) {
        double mapped[3] = {0};
        weft_colour_sequence_apply(&sequence, x[r], mapped);
        for (int c = 0; c < 3; c++) {
            const double *const a = affine[c], *const k = cubic[c], v = x[r][c];
            out[c][at + r] = solved ? a[0] * x[r][0] + a[1] * x[r][1] + a[2] * x[r][2] + a[3] : (double)NAN;
            out[3 + c][at + r] = k[0] + v * (k[1] + v * (k[2] + v * k[3]));
            out[6 + c][at + r] = mapped[c];
        }
    }
}

static void colour_correction(int n, const double *const *in, double *const *out)
{
    for (int begin = 0, end; begin < n; begin = end) {
        for (end = begin; end < n && in[0][end] == in[0][begin] && end - begin < WEFT_CHART_MAX_PATCHES;)
            end++;
        solve_problem(end - begin, begin, in, out);
    }
}

const weft_vectors_model weft_calibration_vectors[] = {
    {"colour_correction", "S-FC3-01 S-FC3-02", "problem xr xg xb yr yg yb",
     "affine_r affine_g affine_b cubic_r cubic_g cubic_b aca_r aca_g aca_b", 1e-8, colour_correction},
    {0},
};
