#include "host/set/noise.h"

#include "core/mem.h"
#include "core/mem_limit.h"

#include <math.h>
#include <stdlib.h>

#define BLOCK      16
#define MAX_BLOCKS 8192
#define N_BINS     32  /* even in the root of the value: most of what tells read from shot noise is dark */
#define MIN_BIN    100 /* pixels that make a variance worth using: 14 % */
#define MIN_BINS   3
#define MAX_READ   0.01 /* as variance: a tenth of full scale; more is no noise */

typedef struct block {
    double mean, deviation;
} block;

static int by_mean(const void *a, const void *b)
{
    const double x = ((const block *)a)->mean, y = ((const block *)b)->mean;
    return (x > y) - (x < y);
}

static int by_deviation(const void *a, const void *b)
{
    const double x = ((const block *)a)->deviation, y = ((const block *)b)->deviation;
    return (x > y) - (x < y);
}

/* Second differences of white noise have six times its variance. */
static block measure_block(const weft_image *image, int step, int u0, int v0)
{
    double sum = 0, sum_squares = 0;
    int n = 0;
    for (int v = v0; v < v0 + BLOCK; v++) {
        const float *const row = weft_image_row(image, 0, v) + u0;
        for (int u = step; u < BLOCK - step; u++, n++) {
            const double d = (double)row[u - step] - 2 * (double)row[u] + (double)row[u + step];
            sum += (double)row[u];
            sum_squares += d * d;
        }
    }
    return (block){sum / n, sqrt(sum_squares / n / 6)};
}

double weft_noise_floor(const weft_image *image, int step)
{
    const size_t across = (size_t)(image->width / BLOCK), down = (size_t)(image->height / BLOCK);
    const size_t stride = across * down / MAX_BLOCKS + 1; /* more would only cost time */
    const size_t n = across * down / stride;
    if (n == 0)
        return 0;
    block *const blocks = weft_alloc(n, sizeof *blocks, NULL);
    if (!blocks)
        return 0;
    for (size_t i = 0; i < n; i++) {
        const size_t at = i * stride;
        blocks[i] = measure_block(image, step, (int)(at % across) * BLOCK, (int)(at / across) * BLOCK);
        if (i % 64 == 0)
            weft_mem_trim();
    }
    qsort(blocks, n, sizeof *blocks, by_mean);
    const size_t n_dark = (n + 9) / 10;
    qsort(blocks, n_dark, sizeof *blocks, by_deviation);
    const double floor = blocks[n_dark / 2].deviation;
    weft_free(blocks);
    return isfinite(floor) ? floor : 0;
}

typedef struct bin {
    double n, sum_x, sum_d, sum_dd;
} bin;

static double brightest(const weft_image *a, const weft_mask *bad_a, const weft_mask *bad_b)
{
    const size_t n = weft_image_plane_size(a);
    float most = 0;
    for (size_t i = 0; i < n; i++)
        if (!bad_a->data[i] && !bad_b->data[i] && a->data[i] > most)
            most = a->data[i];
    return (double)most;
}

/* Least squares of variance = read p + shot q x over the bins, each weighted by its own accuracy: the
 * variance of n samples is known to sqrt(2 / n). */
static bool solve(const bin *bins, double p, double q, weft_noise *noise)
{
    double a = 0, b = 0, c = 0, d = 0, e = 0;
    int used = 0;
    for (int i = 0; i < N_BINS; i++) {
        if (bins[i].n < MIN_BIN)
            continue;
        const double mean = bins[i].sum_d / bins[i].n;
        const double variance = bins[i].sum_dd / bins[i].n - mean * mean,
                     x = fmax(bins[i].sum_x / bins[i].n, 0);
        if (!(variance > 0))
            continue;
        const double w = bins[i].n / (variance * variance), qx = q * x;
        a += w * p * p;
        b += w * p * qx;
        c += w * qx * qx;
        d += w * p * variance;
        e += w * qx * variance;
        used++;
    }
    const double det = a * c - b * b;
    if (used < MIN_BINS || !(det > 1e-9 * a * c))
        return false;
    double read = (c * d - b * e) / det, shot = (a * e - b * d) / det;
    if (read < 0) { /* the better of the two edges of what is possible */
        read = 0;
        shot = e / c;
    } else if (shot < 0) {
        shot = 0;
        read = d / a;
    }
    if (!(read <= MAX_READ) || !(shot <= 1) || read + shot <= 0)
        return false;
    *noise = (weft_noise){read, shot};
    return true;
}

bool weft_noise_fit(const weft_image *a, double time_a, const weft_mask *bad_a, const weft_image *b,
                    double time_b, const weft_mask *bad_b, weft_noise *noise)
{
    const size_t n = weft_image_plane_size(a);
    const double most = brightest(a, bad_a, bad_b), sum_time = time_a + time_b;
    bin bins[N_BINS] = {{0}};
    if (!(most > 0))
        return false;
    for (size_t i = 0; i < n; i++) {
        if (bad_a->data[i] || bad_b->data[i])
            continue;
        const double xa = (double)a->data[i], xb = (double)b->data[i];
        const double x = (xa * time_a + xb * time_b) / sum_time, d = xa - xb;
        const int k = (int)fmin(sqrt(fmax(x / most, 0)) * N_BINS, N_BINS - 1);
        bins[k].n++;
        bins[k].sum_x += x;
        bins[k].sum_d += d;
        bins[k].sum_dd += d * d;
    }
    /* var(x) = (read + shot x time) / time^2, of a difference the sum of both. */
    return solve(bins, 1 / (time_a * time_a) + 1 / (time_b * time_b), 1 / time_a + 1 / time_b, noise);
}
