#include "calibration/lights/light_fit_internal.h"
#include "core/mem.h"

#include <math.h>

#define WINDOW_SHARE 0.05 /* sigma, of the frame's width (S-ORD-18) */
#define REACH        3.0  /* of the window, in sigmas */
#define LEAST_SHARE  0.2  /* of the window's cells that must be there */

enum { SUM_W, SUM_WX, SUM_WXX, SUM_WL, SUM_WLX, N_SUMS };

weft_err fit_smooth_init(fit_smooth *s, const weft_white_sheet *sheet, int columns, int rows, weft_error *err)
{
    *s = (fit_smooth){
        .sheet = sheet, .columns = columns, .rows = rows, .sigma_px = WINDOW_SHARE * sheet->width};
    s->row_sums =
        weft_alloc((size_t)N_SUMS * (size_t)sheet->rows * (size_t)columns, sizeof *s->row_sums, err);
    return s->row_sums ? WEFT_OK : WEFT_ERR_NOMEM;
}

void fit_smooth_fini(fit_smooth *s)
{
    weft_free(s->row_sums);
    s->row_sums = NULL;
}

/* First and last cell whose middle is within the window's reach of pixel coordinate `at`. */
static int window(const fit_smooth *s, double at, int n_cells, int *last)
{
    const double cell = s->sheet->cell_px, reach = REACH * s->sigma_px;
    const double low = ceil((at - reach + 0.5) / cell - 0.5), high = floor((at + reach + 0.5) / cell - 0.5);
    *last = high > n_cells - 1 ? n_cells - 1 : (int)high;
    return low < 0 ? 0 : (int)low;
}

static double node_at(int i, int n_nodes, int pixels)
{
    return (double)i * (pixels - 1) / (n_nodes - 1);
}

/* The window is a product of two Gaussians, so its sums are taken along the rows first. */
static void sum_rows(const fit_smooth *s, const float *values, const float *weights)
{
    const int nr = s->sheet->rows, nc = s->sheet->columns;
    const size_t plane = (size_t)nr * (size_t)s->columns;
    for (int i = 0; i < s->columns; i++) {
        const double at = node_at(i, s->columns, s->sheet->width);
        int last;
        const int first = window(s, at, nc, &last);
        for (int j = 0; j < nr; j++) {
            double sum[N_SUMS] = {0};
            for (int k = first; k <= last; k++) {
                const double value = (double)values[j * nc + k];
                if (isnan(value))
                    continue;
                const double dx = (weft_white_sheet_centre(s->sheet, k) - at) / s->sigma_px;
                const double w = exp(-0.5 * dx * dx) * (weights ? (double)weights[j * nc + k] : 1);
                sum[SUM_W] += w;
                sum[SUM_WX] += w * dx;
                sum[SUM_WXX] += w * dx * dx;
                sum[SUM_WL] += w * value;
                sum[SUM_WLX] += w * value * dx;
            }
            for (int q = 0; q < N_SUMS; q++)
                s->row_sums[(size_t)q * plane + (size_t)(j * s->columns + i)] = sum[q];
        }
    }
}

/* The regression at one node: value of the plane a + b dx + c dy at dx = dy = 0. */
static double solve_node(const fit_smooth *s, int i, int j)
{
    const size_t plane = (size_t)s->sheet->rows * (size_t)s->columns;
    const double at = node_at(j, s->rows, s->sheet->height), cells = s->sigma_px / s->sheet->cell_px;
    weft_mat3 m = {{0}}, inverse;
    double l[3] = {0};
    int last;
    for (int k = window(s, at, s->sheet->rows, &last); k <= last; k++) {
        const double *const q = s->row_sums + (size_t)(k * s->columns + i);
        const double dy = (weft_white_sheet_centre(s->sheet, k) - at) / s->sigma_px, g = exp(-0.5 * dy * dy);
        const double w = g * q[0], wx = g * q[SUM_WX * plane], wl = g * q[SUM_WL * plane];
        m.m[0] += w;
        m.m[1] += wx;
        m.m[2] += w * dy;
        m.m[4] += g * q[SUM_WXX * plane];
        m.m[5] += wx * dy;
        m.m[8] += w * dy * dy;
        l[0] += wl;
        l[1] += g * q[SUM_WLX * plane];
        l[2] += wl * dy;
    }
    m.m[3] = m.m[1];
    m.m[6] = m.m[2];
    m.m[7] = m.m[5];
    /* A corner node sees a quarter of the window, 2 pi sigma^2 cells. */
    if (!(m.m[0] > LEAST_SHARE * 0.25 * 6.28 * cells * cells) || !weft_mat3_invert(&m, &inverse))
        return NAN;
    return inverse.m[0] * l[0] + inverse.m[1] * l[1] + inverse.m[2] * l[2];
}

void fit_smooth_plane(const fit_smooth *s, const float *values, const float *weights, float *nodes)
{
    sum_rows(s, values, weights);
    for (int j = 0; j < s->rows; j++)
        for (int i = 0; i < s->columns; i++)
            nodes[j * s->columns + i] = (float)solve_node(s, i, j);
}

double fit_smooth_at(const fit_smooth *s, const float *nodes, double u, double v)
{
    const double a = fmin(fmax(u / (s->sheet->width - 1), 0), 1) * (s->columns - 1);
    const double b = fmin(fmax(v / (s->sheet->height - 1), 0), 1) * (s->rows - 1);
    const int i = a < s->columns - 2 ? (int)a : s->columns - 2, j = b < s->rows - 2 ? (int)b : s->rows - 2;
    const float *const p = nodes + (size_t)j * (size_t)s->columns + i, *const q = p + s->columns;
    const double x = a - i, y = b - j;
    return (1 - y) * ((1 - x) * (double)p[0] + x * (double)p[1]) +
           y * ((1 - x) * (double)q[0] + x * (double)q[1]);
}
