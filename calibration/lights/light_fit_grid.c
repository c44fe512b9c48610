/* The grid of gains: what the lamps' model misses, smoothed. */
#include "calibration/lights/light_fit_internal.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>

#define DETAIL      0.05 /* beyond it a cell does not belong to a smooth field */
#define DETAIL_MOST 0.01 /* share of such cells */
#define GAIN_LEAST  0.4
#define GAIN_MOST   2.5

fit_place fit_place_at(const fit_problem *f, double u, double v)
{
    return (fit_place){(u - f->cx) / f->radius, (v - f->cy) / f->radius};
}

void fit_planes_fini(fit_planes *p)
{
    fit_smooth_fini(&p->smooth);
    weft_free(p->residual);
    weft_free(p->weight);
    weft_free(p->nodes);
    weft_free(p->colours);
}

weft_err fit_planes_init(fit_planes *p, const fit_problem *f, const weft_white_sheet *sheet, weft_error *err)
{
    const int columns = f->options->grid_columns, rows = f->options->grid_rows;
    *p = (fit_planes){0};
    if (!(p->residual = weft_alloc((size_t)f->n_cells, sizeof(float), err)) ||
        !(p->weight = weft_alloc((size_t)f->n_cells, sizeof(float), err)) ||
        !(p->nodes = weft_alloc((size_t)columns * (size_t)rows, sizeof(float), err)) ||
        !(p->colours = weft_alloc(3 * (size_t)columns * (size_t)rows, sizeof(float), err)))
        return WEFT_ERR_NOMEM;
    return fit_smooth_init(&p->smooth, sheet, columns, rows, err);
}

static double deviation(const fit_planes *p, int cell)
{
    const weft_white_sheet *const sheet = p->smooth.sheet;
    return (double)p->residual[cell] - fit_smooth_at(&p->smooth, p->nodes,
                                                     weft_white_sheet_centre(sheet, cell % sheet->columns),
                                                     weft_white_sheet_centre(sheet, cell / sheet->columns));
}

static int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Five standard deviations of the residual around its smooth self, by the median. */
static double speck_limit(const fit_problem *f, fit_planes *p)
{
    int n = 0;
    for (int i = 0; i < f->n_cells; i++)
        if (!isnan(p->residual[i]))
            p->weight[n++] = (float)fabs(deviation(p, i));
    if (n == 0)
        return 0;
    qsort(p->weight, (size_t)n, sizeof *p->weight, compare_floats);
    return 5 * 1.4826 * (double)p->weight[n / 2] + 1e-5;
}

double fit_smooth_robust(const fit_problem *f, fit_planes *p, int *first)
{
    int n = 0, there = 0;
    fit_smooth_plane(&p->smooth, p->residual, NULL, p->nodes);
    const double limit = speck_limit(f, p);
    *first = -1;
    for (int i = 0; i < f->n_cells; i++) {
        const double d = fabs(deviation(p, i));
        p->weight[i] = d <= limit;
        there += !isnan(d);
        if (d > DETAIL && n++ == 0)
            *first = i;
    }
    fit_smooth_plane(&p->smooth, p->residual, p->weight, p->nodes);
    return there ? (double)n / there : 1;
}

static weft_err check_nodes(const fit_planes *p, int light, weft_error *err)
{
    for (int i = 0; i < p->smooth.columns * p->smooth.rows; i++)
        if (!(exp((double)p->nodes[i]) > GAIN_LEAST && exp((double)p->nodes[i]) < GAIN_MOST))
            return weft_fail(
                err, WEFT_ERR_NODATA,
                "light %d: near pixel (%d, %d) the sheet gives %s of what the light's model says; does the "
                "sheet fill the frame, with nothing in the light's way?",
                light, i % p->smooth.columns * (p->smooth.sheet->width - 1) / (p->smooth.columns - 1),
                i / p->smooth.columns * (p->smooth.sheet->height - 1) / (p->smooth.rows - 1),
                isnan(p->nodes[i]) ? "nothing"
                : p->nodes[i] < 0  ? "less than half"
                                   : "more than twice");
    return WEFT_OK;
}

/* The gains of one light and channel, from the smoothed residual against lamp and polynomial. */
weft_err fit_grid(const fit_problem *f, fit_planes *p, int light, int channel, float *gain, double *left_out,
                  weft_error *err)
{
    int first;
    for (int i = 0; i < f->n_cells; i++)
        p->residual[i] =
            (float)(fit_ratio(f, light, channel, i) - fit_common_log(f->v, f->place[i])); /* NaN stays */
    const double detail = fit_smooth_robust(f, p, &first);
    WEFT_TRY(check_nodes(p, light, err));
    if (detail > DETAIL_MOST)
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "light %d: %.1f %% of the sheet is not smooth, first near pixel (%.0f, %.0f); does it fill "
            "the frame, without folds, print and dust?",
            light, 100 * detail, weft_white_sheet_centre(p->smooth.sheet, first % p->smooth.sheet->columns),
            weft_white_sheet_centre(p->smooth.sheet, first / p->smooth.sheet->columns));
    *left_out = fmax(*left_out, detail);
    const int columns = p->smooth.columns, rows = p->smooth.rows;
    for (int j = 0; j < rows; j++)
        for (int i = 0; i < columns; i++) {
            const fit_place place = fit_place_at(f, (double)i * (f->width - 1) / (columns - 1),
                                                 (double)j * (f->height - 1) / (rows - 1));
            const int node = j * columns + i;
            gain[node] = (float)exp((double)p->nodes[node] + fit_common_log(f->v, place));
        }
    return WEFT_OK;
}

/* Smoothed residuals of a light and channel, dust left out. */
static void smooth_residual(const fit_problem *f, fit_planes *p, int light, int channel, float *nodes)
{
    const double noise = f->noise[light][channel];
    const float *const w = f->weight + fit_plane(f, light, channel);
    for (int i = 0; i < f->n_cells; i++) {
        p->residual[i] = (float)fit_residual(f, light, channel, i);
        p->weight[i] = fabs((double)p->residual[i]) * sqrt((double)w[i]) < 5 * noise ? w[i] : 0;
    }
    fit_smooth_plane(&p->smooth, p->residual, p->weight, nodes);
}

double fit_model_error(const fit_problem *f, fit_planes *p)
{
    const int n = p->smooth.columns * p->smooth.rows;
    double sum = 0, n_products = 0;
    for (int l = 0; l < f->n_lights; l++) {
        for (int c = 0; c < 3; c++)
            smooth_residual(f, p, l, c, p->colours + (size_t)c * (size_t)n);
        for (int i = 0; i < n; i++)
            for (int c = 0; c < 3; c++) {
                const double product =
                    (double)p->colours[c * n + i] * (double)p->colours[(c + 1) % 3 * n + i];
                if (isnan(product))
                    continue;
                sum += product;
                n_products++;
            }
    }
    return n_products > 0 ? fmax(sum / n_products, 0) : 0;
}

/* rms of measured/(model grid) - 1, dust left out. */
double fit_grid_residual(const fit_problem *f, const fit_planes *p, int light, const float *gain)
{
    const size_t nodes = (size_t)p->smooth.columns * (size_t)p->smooth.rows;
    const weft_white_sheet *const sheet = p->smooth.sheet;
    double sum = 0;
    long n = 0;
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < f->n_cells; i++) {
            const double bare = fit_ratio(f, light, c, i);
            const double g = fit_smooth_at(&p->smooth, gain + (size_t)(light * 3 + c) * nodes,
                                           weft_white_sheet_centre(sheet, i % sheet->columns),
                                           weft_white_sheet_centre(sheet, i / sheet->columns));
            const double r = exp(bare) / g - 1;
            if (isnan(r) || fabs(r) > DETAIL)
                continue;
            sum += r * r;
            n++;
        }
    return n ? sqrt(sum / (double)n) : 0;
}
