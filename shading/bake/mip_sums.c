#include "shading/bake/mip_sums.h"

#include "core/clones.h"
#include "shading/bake/gloss.h"

#include <math.h>
#include <string.h>

weft_mip_extent weft_mip_extent_of(int i, int n, int n0)
{
    const double from = (double)i * n0 / n, to = (double)(i + 1) * n0 / n;
    weft_mip_extent e = {(int)floor(from), (int)ceil(to - 1e-9), 1, 1};
    e.first = fmin(e.begin + 1, to) - from;
    e.last = e.end - e.begin > 1 ? to - (e.end - 1) : e.first;
    return e;
}

/* First planes of the sums. */
enum { SUM_ALPHA = 3, SUM_ALPHA2 = 4, SUM_SHORTENED = 5 };

WEFT_CLONES
static void add_scaled(double *sum, const float *values, double weight, int n)
{
    WEFT_INDEPENDENT
    for (int u = 0; u < n; u++)
        sum[u] += weight * (double)values[u];
}

/* With anisotropy, the widths of both axes in one number; put apart again in store_lobe(). */
WEFT_CLONES
static void add_widths(double *sum, double *squares, const float *along, const float *anisotropy,
                       double weight, int n)
{
    WEFT_INDEPENDENT
    for (int u = 0; u < n; u++) {
        const double alpha = (double)along[u] * sqrt(1 - (double)anisotropy[u]);
        sum[u] += weight * alpha;
        squares[u] += weight * alpha * alpha;
    }
}

/* Normals as long as the mean of their GGX; neighbours are mostly of one alpha. */
static void add_shortened(double *sum, int n, const float *const normal[3], const float *along,
                          const float *anisotropy, double weight)
{
    double last = -1, length = 0;
    for (int u = 0; u < n; u++) {
        const double alpha = (double)along[u] * sqrt(1 - (double)anisotropy[u]);
        if (alpha != last)
            length = 1 - weft_ggx_missing_length(alpha);
        last = alpha;
        for (int c = 0; c < 3; c++)
            sum[(size_t)c * (size_t)n + (size_t)u] += weight * length * (double)normal[c][u];
    }
}

void weft_mip_sum_rows(const weft_baked *baked, const weft_mip_extent *rows, const float *anisotropy,
                       bool shortened, double *sums)
{
    const weft_baked_map *const maps = baked->maps;
    const int w = baked->width;
    const size_t n = (size_t)w;
    memset(sums, 0, WEFT_MIP_SUMS * n * sizeof *sums);
    for (int y = rows->begin; y < rows->end; y++) {
        const double weight = weft_mip_share(rows, y);
        const float *const along = weft_image_row(&maps[WEFT_BAKED_ROUGHNESS].mips[0], 0, y);
        const weft_baked_map *const s = &maps[WEFT_BAKED_ANISOTROPY];
        const float *const turned = s->n_mips > 0 ? weft_image_row(&s->mips[0], 0, y) : anisotropy;
        const float *normal[3];
        for (int c = 0; c < 3; c++) {
            normal[c] = weft_image_row(&maps[WEFT_BAKED_NORMAL].mips[0], c, y);
            add_scaled(sums + (size_t)c * n, normal[c], weight, w);
        }
        add_widths(sums + SUM_ALPHA * n, sums + SUM_ALPHA2 * n, along, turned, weight, w);
        if (shortened)
            add_shortened(sums + SUM_SHORTENED * n, w, normal, along, turned, weight);
    }
}

weft_mip_footprint weft_mip_sum_columns(const weft_mip_extent *rows, const weft_mip_extent *columns,
                                        bool shortened, int w0, const double *sums)
{
    const size_t n = (size_t)w0;
    weft_mip_footprint f = {0};
    double *const to[WEFT_MIP_SUMS] = {&f.mean[0], &f.mean[1],      &f.mean[2],      &f.alpha,
                                       &f.alpha2,  &f.shortened[0], &f.shortened[1], &f.shortened[2]};
    const int planes = shortened ? WEFT_MIP_SUMS : SUM_SHORTENED;
    for (int k = 0; k < planes; k++) {
        const double *const plane = sums + (size_t)k * n;
        double sum = columns->first * plane[columns->begin];
        for (int u = columns->begin + 1; u < columns->end - 1; u++)
            sum += plane[u];
        if (columns->end - columns->begin > 1)
            sum += columns->last * plane[columns->end - 1];
        *to[k] = sum;
    }
    f.weight = weft_mip_weight(rows) * weft_mip_weight(columns);
    return f;
}
