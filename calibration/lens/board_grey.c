#include "calibration/lens/lens_fit.h"

#include <math.h>
#include <string.h>

#define N_BINS 4096

/* Light at a pixel: the mean of its planes, or green, at other sites of a mosaic from the neighbours. */
static float light_at(const weft_image *image, weft_cfa cfa, int u, int v)
{
    const int w = image->width, h = image->height;
    if (cfa == WEFT_CFA_NONE) {
        float sum = 0;
        for (int p = 0; p < image->planes; p++)
            sum += weft_image_row(image, p, v)[u];
        return sum / (float)image->planes;
    }
    const float *const row = weft_image_row(image, 0, v);
    if (weft_cfa_colour(cfa, u, v) == 1)
        return row[u];
    float sum = 0;
    int n = 0;
    if (u > 0)
        sum += row[u - 1], n++;
    if (u + 1 < w)
        sum += row[u + 1], n++;
    if (v > 0)
        sum += row[u - w], n++;
    if (v + 1 < h)
        sum += row[u + w], n++;
    return sum / (float)n;
}

static void range_of(const weft_image *image, weft_cfa cfa, float *low, float *high)
{
    *low = INFINITY;
    *high = -INFINITY;
    for (int v = 0; v < image->height; v++)
        for (int u = 0; u < image->width; u++) {
            const float x = light_at(image, cfa, u, v);
            if (isfinite(x)) {
                *low = fminf(*low, x);
                *high = fmaxf(*high, x);
            }
        }
}

/* Narrows low..high to the bins that hold the percentiles.  @return whether much was cut off, so that the
 * bins were coarse and another round is worth it */
static bool narrow_to_percentiles(const weft_image *image, weft_cfa cfa, float *low, float *high)
{
    long bins[N_BINS] = {0}, total = 0;
    const float from = *low, scale = (N_BINS - 1) / (*high - *low);
    for (int v = 0; v < image->height; v++)
        for (int u = 0; u < image->width; u++) {
            const float x = (light_at(image, cfa, u, v) - from) * scale;
            if (isnan(x))
                continue;
            bins[x > 0 ? (int)fminf(x, N_BINS - 1) : 0]++;
            total++;
        }
    int first = 0, last = N_BINS - 1;
    long below = bins[0], above = bins[N_BINS - 1];
    while (first < N_BINS - 1 && below < total / 100)
        below += bins[++first];
    while (last > first + 1 && above < total / 200)
        above += bins[--last];
    *low = from + (float)first / scale;
    *high = from + (float)(last + 1) / scale;
    return last - first < N_BINS / 8;
}

void weft_board_grey(const weft_image *image, weft_cfa cfa, uint8_t *grey)
{
    float low, high;
    range_of(image, cfa, &low, &high);
    if (!(high > low)) {
        memset(grey, 0, weft_image_plane_size(image));
        return;
    }
    /* So that a glint or a hot pixel does not eat the contrast. */
    for (int round = 0; round < 4 && narrow_to_percentiles(image, cfa, &low, &high); round++)
        ;
    if (!(high > low))
        high = low + fmaxf(fabsf(low), 1);
    for (int v = 0; v < image->height; v++)
        for (int u = 0; u < image->width; u++) {
            const float x = (light_at(image, cfa, u, v) - low) / (high - low);
            grey[(size_t)v * (size_t)image->width + (size_t)u] =
                (uint8_t)(x > 0 ? fminf(255, 255 * x + 0.5F) : 0);
        }
}
