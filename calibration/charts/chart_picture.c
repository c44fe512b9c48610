#include "calibration/charts/chart_picture.h"

#include "calibration/charts/robust.h"
#include "core/mem.h"
#include "core/parallel.h"

#include <assert.h>
#include <math.h>

enum { SAMPLES = 20000 }; /* for the percentiles: 0.2 % accurate */

typedef struct reduction {
    const weft_chart_picture *picture;
    int side;
    weft_image *cells;
} reduction;

static void reduce_cell(const reduction *r, int i, int j, double sum[3])
{
    const weft_image *const image = r->picture->image;
    int n[3] = {0};
    sum[0] = sum[1] = sum[2] = 0;
    for (int v = j * r->side; v < (j + 1) * r->side; v++)
        for (int u = i * r->side; u < (i + 1) * r->side; u++)
            if (image->planes == 3) {
                for (int c = 0; c < 3; c++, n[c - 1]++)
                    sum[c] += (double)weft_image_row(image, c, v)[u];
            } else {
                const int c = r->picture->cfa == WEFT_CFA_NONE ? 0 : weft_cfa_colour(r->picture->cfa, u, v);
                sum[c] += (double)weft_image_row(image, 0, v)[u];
                n[c]++;
            }
    for (int c = 0; c < 3; c++)
        sum[c] = n[c] ? sum[c] / n[c] : sum[0];
}

static void reduce_rows(void *context, int band, int begin, int end)
{
    (void)band;
    const reduction *const r = context;
    for (int j = begin; j < end; j++)
        for (int i = 0; i < r->cells->width; i++) {
            double mean[3];
            reduce_cell(r, i, j, mean);
            for (int c = 0; c < 3; c++)
                weft_image_row(r->cells, c, j)[i] = (float)mean[c];
        }
}

/* Moves a row or column of `n` values by a quarter step or less: at(i) = old(i +- part), linear. */
static void shift_line(float *values, size_t stride, int n, float part)
{
    if (part > 0)
        for (int i = 0; i + 1 < n; i++)
            values[(size_t)i * stride] +=
                part * (values[(size_t)(i + 1) * stride] - values[(size_t)i * stride]);
    else
        for (int i = n - 1; i > 0; i--)
            values[(size_t)i * stride] -=
                part * (values[(size_t)(i - 1) * stride] - values[(size_t)i * stride]);
}

/* Red and blue sites lie off the middle of their cells by half a pixel, in opposite directions: unaligned, a
 * bright patch would seem to grow where the channels are combined. */
static void align_channels(weft_image *cells, weft_cfa cfa, int side)
{
    for (int c = 0; c < 3; c += 2) {
        int at = 0;
        while (weft_cfa_colour(cfa, at % 2, at / 2) != c)
            at++;
        const float part = 0.5F / (float)side, du = at % 2 ? -part : part, dv = at / 2 ? -part : part;
        for (int j = 0; j < cells->height; j++)
            shift_line(weft_image_row(cells, c, j), 1, cells->width, du);
        for (int i = 0; i < cells->width; i++)
            shift_line(weft_image_plane(cells, c) + i, (size_t)cells->width, cells->height, dv);
    }
}

weft_err weft_chart_picture_reduce(const weft_chart_picture *picture, int side, weft_image *cells,
                                   weft_error *err)
{
    const weft_image *const image = picture->image;
    assert(side >= 1 && (picture->cfa == WEFT_CFA_NONE || side % 2 == 0));
    if (image->planes != 1 && image->planes != 3)
        return weft_fail(err, WEFT_ERR_RANGE, "a picture of %d planes is no photograph (1 or 3)",
                         image->planes);
    WEFT_TRY(weft_image_init(cells, image->width / side, image->height / side, 3, err));
    reduction r = {picture, side, cells};
    weft_parallel_rows(cells->height, reduce_rows, &r);
    if (picture->cfa != WEFT_CFA_NONE)
        align_channels(cells, picture->cfa, side);
    return WEFT_OK;
}

/* The share `part` of a plane's values lies below the result; from a regular sample. */
static double percentile(const float *values, size_t n, double part, double *scratch)
{
    const size_t stride = n / SAMPLES + 1;
    int k = 0;
    for (size_t i = 0; i < n; i += stride)
        if (isfinite(values[i]))
            scratch[k++] = (double)values[i];
    return k ? weft_select(scratch, k, (int)(part * (k - 1))) : 0;
}

static void add_channel(float *restrict to, const float *restrict from, size_t n, float scale,
                        weft_contrast how)
{
    for (size_t i = 0; i < n; i++) {
        const float value = isfinite(from[i]) ? from[i] * scale : 0;
        if (how == WEFT_CONTRAST_MEAN)
            to[i] += value / 3;
        else
            to[i] = value > to[i] ? value : to[i];
    }
}

weft_err weft_chart_picture_contrast(const weft_image *cells, weft_contrast how, weft_image *contrast,
                                     weft_error *err)
{
    const size_t n = weft_image_plane_size(cells);
    double *const scratch = weft_alloc(SAMPLES + 1, sizeof *scratch, err);
    if (!scratch)
        return WEFT_ERR_NOMEM;
    const weft_err status = weft_image_init(contrast, cells->width, cells->height, 1, err);
    for (int c = 0; status == WEFT_OK && c < cells->planes; c++) {
        const double bright = percentile(weft_image_plane(cells, c), n, 0.95, scratch);
        add_channel(contrast->data, weft_image_plane(cells, c), n, bright > 0 ? (float)(1 / bright) : 0, how);
    }
    weft_free(scratch);
    return status;
}
