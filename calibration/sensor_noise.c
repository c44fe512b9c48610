#include "calibration/sensor_noise.h"

#include "core/linalg.h"
#include "core/mem.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define BLOCK        32   /* photosites a side: 16 x 16 of each class */
#define BLOCKS_MOST  4000 /* of a level; more add nothing */
#define BLOCKS_LEAST 12
#define LEVELS_LEAST 6
#define SPAN_LEAST   8
#define PILE         50 /* sites at the highest value, and ten times as many as below it: saturation */

/* The blocks of one class and level. */
typedef struct level {
    int n;
    float mean[BLOCKS_MOST], variance[BLOCKS_MOST];
} level;

struct weft_sensor_frames {
    double white;
    level levels[WEFT_SENSOR_CLASSES][WEFT_SENSOR_LEVELS];
    uint32_t histogram[WEFT_SENSOR_CLASSES][65536];
};

weft_err weft_sensor_frames_create(const weft_mosaic *first, weft_sensor_frames **frames, weft_error *err)
{
    weft_sensor_frames *const f = weft_alloc(1, sizeof *f, err);
    if (!f)
        return WEFT_ERR_NOMEM;
    f->white = first->white;
    *frames = f;
    return WEFT_OK;
}

void weft_sensor_frames_destroy(weft_sensor_frames *frames)
{
    weft_free(frames);
}

/* Mean and variance of one class in a block; false when a site of it is saturated. */
static bool measure_block(const weft_mosaic *m, int u0, int v0, double white, double *mean, double *variance)
{
    double sum = 0, squares = 0;
    int n = 0, n_differences = 0;
    for (int v = v0; v < v0 + BLOCK; v += 2) {
        const uint16_t *const row = m->data + (size_t)v * (size_t)m->width;
        for (int u = u0; u < u0 + BLOCK; u += 2) {
            if (row[u] >= white)
                return false;
            sum += row[u];
            n++;
            if (u < u0 + 2 || u + 2 >= u0 + BLOCK)
                continue;
            const double d = (double)row[u - 2] - 2.0 * row[u] + (double)row[u + 2];
            squares += d * d;
            n_differences++;
        }
    }
    *mean = sum / n;
    *variance = squares / n_differences / 6; /* of white noise, six times its variance */
    return true;
}

weft_err weft_sensor_frames_add(weft_sensor_frames *frames, const weft_mosaic *mosaic,
                                const double black_dn[WEFT_SENSOR_CLASSES], weft_error *err)
{
    (void)err;
    for (int v = 0; v < mosaic->height; v++)
        for (int u = 0; u < mosaic->width; u++)
            frames->histogram[2 * (v & 1) + (u & 1)]
                             [mosaic->data[(size_t)v * (size_t)mosaic->width + (size_t)u]]++;
    for (int v = 0; v + BLOCK <= mosaic->height; v += BLOCK)
        for (int u = 0; u + BLOCK <= mosaic->width; u += BLOCK)
            for (int site = 0; site < WEFT_SENSOR_CLASSES; site++) {
                double mean, variance;
                if (!measure_block(mosaic, u + (site & 1), v + (site >> 1), frames->white, &mean, &variance))
                    continue;
                const double s = fmax(mean - black_dn[site], 0), range = frames->white - black_dn[site];
                const int at = (int)(sqrt(fmin(s / range, 0.999)) * WEFT_SENSOR_LEVELS);
                level *const l = &frames->levels[site][at];
                if (l->n == BLOCKS_MOST)
                    continue;
                l->mean[l->n] = (float)s;
                l->variance[l->n++] = (float)variance;
            }
    return WEFT_OK;
}

static int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Mean level and variance of the even blocks; @return how many there are. */
static int settle_level(const level *l, double *mean, double *variance)
{
    float sorted[BLOCKS_MOST];
    if (l->n < BLOCKS_LEAST)
        return 0;
    memcpy(sorted, l->variance, (size_t)l->n * sizeof *sorted);
    qsort(sorted, (size_t)l->n, sizeof *sorted, compare_floats);
    /* The lower part is not touched by texture; from there the even blocks' own spread (13 %) is closed in
     * on. */
    double centre = (double)sorted[l->n / 4] * 1.09, sum = 0, sum_variance = 0;
    int n = 0;
    for (int round = 0; round < 4; round++) {
        sum = sum_variance = n = 0;
        for (int i = 0; i < l->n; i++)
            if (fabs((double)l->variance[i] / centre - 1) < 0.3) {
                sum += (double)l->mean[i];
                sum_variance += (double)l->variance[i];
                n++;
            }
        if (n == 0)
            return 0;
        centre = sum_variance / n;
    }
    *mean = sum / n;
    *variance = centre;
    return n;
}

/* The highest value that many sites stop at; 0 when none does. */
static double find_saturation(const uint32_t *histogram)
{
    int top = 65535;
    while (top > 0 && !histogram[top])
        top--;
    double below = 0;
    for (int k = 1; k <= 16 && top - k >= 0; k++)
        below += histogram[top - k] / 16.0;
    return histogram[top] >= PILE && histogram[top] > 10 * below ? top : 0;
}

/* Weighted least squares of var = x0 + x1 s + x2 s^2, x2 held at 0 where `square` says so. */
static bool solve(const weft_sensor_class *c, const int *counts, bool square, double x[3], double *sigma1)
{
    weft_mat3 h = {{0}}, inverse;
    weft_vec3 g = {0, 0, 0};
    for (int i = 0; i < c->n_levels; i++) {
        const double s = c->level_dn[i], t[3] = {1, s, square ? s * s : 0};
        const double w = counts[i] / (c->variance_dn2[i] * c->variance_dn2[i]);
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                h.m[3 * j + k] += w * t[j] * t[k];
        g.x += w * t[0] * c->variance_dn2[i];
        g.y += w * t[1] * c->variance_dn2[i];
        g.z += w * t[2] * c->variance_dn2[i];
    }
    if (!square)
        h.m[8] = 1;
    if (!weft_mat3_invert(&h, &inverse))
        return false;
    const weft_vec3 found = weft_mat3_apply(&inverse, g);
    x[0] = found.x, x[1] = found.y, x[2] = found.z;
    /* A block of 16 x 14 differences, each of which shares sites with its neighbours, is worth about 115
     * samples. */
    *sigma1 = sqrt(inverse.m[4] * 2 / 115);
    return true;
}

weft_err weft_sensor_fit(const weft_sensor_frames *frames, int site, weft_sensor_class *result,
                         weft_error *err)
{
    weft_sensor_class c = {0};
    int counts[WEFT_SENSOR_LEVELS];
    double x[3], sigma;
    for (int i = 0; i < WEFT_SENSOR_LEVELS; i++) {
        double mean, variance;
        const int n = settle_level(&frames->levels[site][i], &mean, &variance);
        if (n < BLOCKS_LEAST || !(variance > 0))
            continue;
        c.level_dn[c.n_levels] = mean;
        c.variance_dn2[c.n_levels] = variance;
        counts[c.n_levels++] = n;
    }
    if (c.n_levels < LEVELS_LEAST || c.level_dn[c.n_levels - 1] < SPAN_LEAST * fmax(c.level_dn[0], 1))
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "%d levels of light are too few to tell read noise from shot noise; take a series of exposures",
            c.n_levels);
    if (!solve(&c, counts, true, x, &sigma) || (x[2] < 0 && !solve(&c, counts, false, x, &sigma)) ||
        !(x[1] > 0))
        return weft_fail(err, WEFT_ERR_NODATA,
                         "the noise does not grow with the light: are these raw frames?");
    c.gain_e_per_dn = 1 / x[1];
    c.gain_sigma = sigma / (x[1] * x[1]);
    c.read_noise_e = sqrt(fmax(x[0] - 1 / 12.0, 0)) / x[1]; /* less the rounding to whole DN */
    c.prnu = sqrt(fmax(x[2], 0));
    c.saturation_dn = find_saturation(frames->histogram[site]);
    *result = c;
    return WEFT_OK;
}
