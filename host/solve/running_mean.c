#include "host/solve/running_mean.h"

#include "core/mem.h"

/* Sums over 2 reach + 1 neighbours along a row of `n`; beyond the ends there is nothing. */
static void sum_row(const float *from, int n, int reach, float *to)
{
    double sum = 0;
    for (int i = 0; i < reach && i < n; i++)
        sum += (double)from[i];
    for (int i = 0; i < n; i++) {
        if (i + reach < n)
            sum += (double)from[i + reach];
        if (i - reach - 1 >= 0)
            sum -= (double)from[i - reach - 1];
        to[i] = (float)(sum / (2 * reach + 1));
    }
}

/* The same along the columns, all of them at once. */
static void sum_columns(const weft_image *from, int reach, double *sums, weft_image *to, int plane)
{
    const int w = from->width, h = from->height;
    for (int u = 0; u < w; u++)
        sums[u] = 0;
    for (int v = -reach; v < h; v++) {
        const float *const in = v + reach < h ? weft_image_row(from, 0, v + reach) : NULL;
        const float *const out = v - reach - 1 >= 0 ? weft_image_row(from, 0, v - reach - 1) : NULL;
        for (int u = 0; in && u < w; u++)
            sums[u] += (double)in[u];
        for (int u = 0; out && u < w; u++)
            sums[u] -= (double)out[u];
        for (int u = 0; v >= 0 && u < w; u++)
            weft_image_row(to, plane, v)[u] = (float)(sums[u] / (2 * reach + 1));
    }
}

weft_err weft_running_mean(weft_image *image, int reach, int rounds, weft_error *err)
{
    weft_image rows = {0};
    double *const sums = weft_alloc((size_t)image->width, sizeof *sums, err);
    weft_err status = sums ? weft_image_init(&rows, image->width, image->height, 1, err) : WEFT_ERR_NOMEM;
    for (int i = 0; i < rounds && status == WEFT_OK; i++)
        for (int p = 0; p < image->planes; p++) {
            for (int v = 0; v < image->height; v++)
                sum_row(weft_image_row(image, p, v), image->width, reach, weft_image_row(&rows, 0, v));
            sum_columns(&rows, reach, sums, image, p);
        }
    weft_image_fini(&rows);
    weft_free(sums);
    return status;
}
