#include "calibration/charts/chart_measure.h"

#include "calibration/charts/homography.h"
#include "calibration/charts/robust.h"
#include "core/mem.h"

#include <math.h>
#include <string.h>

enum { SITES_MIN = 16 };
static const double window = 0.5; /* of the patch's side */

const char *const weft_site_names[WEFT_SITES] = {"R", "G1", "G2", "B"};
const int weft_site_colour[WEFT_SITES] = {0, 1, 1, 2};

/* Pixels that may lie in the window. */
typedef struct box {
    int u0, v0, u1, v1; /* inclusive */
} box;

static bool window_box(const weft_chart_pose *pose, double x, double y, double half, const weft_image *image,
                       box *b)
{
    double lo[2] = {INFINITY, INFINITY}, hi[2] = {-INFINITY, -INFINITY};
    for (int k = 0; k < 4; k++) {
        double u, v;
        if (!weft_homography_apply(&pose->to_pixel, x + (k & 1 ? half : -half), y + (k & 2 ? half : -half),
                                   &u, &v))
            return false;
        lo[0] = fmin(lo[0], u);
        lo[1] = fmin(lo[1], v);
        hi[0] = fmax(hi[0], u);
        hi[1] = fmax(hi[1], v);
    }
    if (!(lo[0] >= 0 && lo[1] >= 0 && hi[0] <= image->width - 1 && hi[1] <= image->height - 1))
        return false;
    *b = (box){(int)ceil(lo[0]), (int)ceil(lo[1]), (int)floor(hi[0]), (int)floor(hi[1])};
    return true;
}

static weft_site site_of(weft_cfa cfa, int u, int v)
{
    const int colour = weft_cfa_colour(cfa, u, v);
    if (colour != 1)
        return colour == 0 ? WEFT_SITE_R : WEFT_SITE_B;
    return weft_cfa_colour(cfa, u + 1, v) == 0 ? WEFT_SITE_G1 : WEFT_SITE_G2;
}

/* The window in blocks: what a stain covers differs from the rest. */
enum { BLOCKS = 4, N_BLOCKS = BLOCKS * BLOCKS };

/* Values of the window by class; the classes share one buffer of `room` each. */
typedef struct collector {
    double *values[WEFT_SITES];
    uint8_t *blocks[WEFT_SITES]; /* in which each value lies */
    int n[WEFT_SITES];
    int clipped, total;
} collector;

static void collect_pixel(const weft_chart_picture *picture, int u, int v, int block, collector *c)
{
    const weft_image *const image = picture->image;
    c->total++;
    if (picture->clipped && picture->clipped->data[(size_t)v * (size_t)image->width + (size_t)u]) {
        c->clipped++;
        return;
    }
    for (int s = 0; s < WEFT_SITES; s++) {
        if (picture->cfa != WEFT_CFA_NONE && site_of(picture->cfa, u, v) != (weft_site)s)
            continue;
        const float value = weft_image_row(image, image->planes == 3 ? weft_site_colour[s] : 0, v)[u];
        if (!isfinite(value))
            continue;
        c->blocks[s][c->n[s]] = (uint8_t)block;
        c->values[s][c->n[s]++] = (double)value;
    }
}

/* Which quarter of the window, 0..BLOCKS - 1; `at` is -half..half. */
static int block_of(double at, double half)
{
    const int k = (int)((at + half) / (2 * half) * BLOCKS);
    return k < 0 ? 0 : k >= BLOCKS ? BLOCKS - 1 : k;
}

static void collect(const weft_chart_picture *picture, const weft_mat3 *to_chart, double x, double y,
                    double half, const box *b, collector *c)
{
    c->clipped = c->total = 0;
    for (int s = 0; s < WEFT_SITES; s++)
        c->n[s] = 0;
    for (int v = b->v0; v <= b->v1; v++)
        for (int u = b->u0; u <= b->u1; u++) {
            double px, py;
            if (weft_homography_apply(to_chart, u, v, &px, &py) && fabs(px - x) <= half &&
                fabs(py - y) <= half)
                collect_pixel(picture, u, v, BLOCKS * block_of(py - y, half) + block_of(px - x, half), c);
        }
}

/* Sums over the blocks of one class; those of half the usual number of values or less are left out. */
typedef struct block_means {
    double mean[N_BLOCKS], n[N_BLOCKS];
} block_means;

static void average_blocks(const double *values, const uint8_t *blocks, int n, const weft_robust_mean *m,
                           block_means *b)
{
    *b = (block_means){0};
    for (int i = 0; i < n; i++)
        if (fabs(values[i] - m->mean) <= 4 * m->std_dev) {
            b->mean[blocks[i]] += values[i];
            b->n[blocks[i]]++;
        }
    for (int k = 0; k < N_BLOCKS; k++) {
        const bool enough = b->n[k] > 0 && 2 * N_BLOCKS * b->n[k] > n;
        b->mean[k] = enough ? b->mean[k] / b->n[k] : (double)NAN;
    }
}

/* Rms of the block means off a plane (the light has a gradient), less what noise alone would give. */
static double unevenness_of(const block_means *b, const weft_robust_mean *m)
{
    double sx = 0, sy = 0, s0 = 0, xx = 0, noise = 0, square = 0;
    int n = 0;
    for (int k = 0; k < N_BLOCKS; k++) {
        if (isnan(b->mean[k]))
            continue;
        const int column = k % BLOCKS, row = k / BLOCKS;
        const double x = column - 1.5, y = row - 1.5, d = b->mean[k] - m->mean;
        s0 += d;
        sx += x * d;
        sy += y * d;
        xx += x * x;
        noise += m->std_dev * m->std_dev / b->n[k];
        n++;
    }
    if (n < N_BLOCKS || !(m->mean > 0)) /* too small a patch to say */
        return 0;
    for (int k = 0; k < N_BLOCKS; k++) {
        const int column = k % BLOCKS, row = k / BLOCKS;
        const double x = column - 1.5, y = row - 1.5;
        const double d = b->mean[k] - m->mean - s0 / n - (sx * x + sy * y) / xx;
        square += d * d;
    }
    return sqrt(fmax(square / (n - 3) - 2 * noise / n, 0)) / m->mean; /* twice: its own scatter */
}

/* @param scratch  room for twice the values of a class */
static void summarise(collector *c, double *scratch, weft_patch_reading *reading)
{
    int kept = 0, all = 0;
    reading->unevenness = 0;
    for (int s = 0; s < WEFT_SITES; s++) {
        double *const copy = scratch + c->n[s]; /* the order of the values tells their places */
        memcpy(copy, c->values[s], (size_t)c->n[s] * sizeof *copy);
        const weft_robust_mean m = weft_mean_robust(copy, c->n[s], scratch);
        block_means b;
        average_blocks(c->values[s], c->blocks[s], c->n[s], &m, &b);
        reading->unevenness = fmax(reading->unevenness, unevenness_of(&b, &m));
        reading->mean[s] = m.mean;
        reading->std_dev[s] = m.std_dev;
        reading->n[s] = m.kept;
        kept += m.kept;
        all += m.n;
    }
    reading->clipped = c->total ? (double)c->clipped / c->total : 0;
    reading->outliers = all ? 1 - (double)kept / all : 0;
}

static weft_err measure_patch(const weft_chart *chart, const weft_chart_picture *picture,
                              const weft_chart_pose *pose, const weft_mat3 *to_chart, int patch,
                              weft_patch_reading *reading, weft_error *err)
{
    double x, y;
    const double half = 0.5 * window * chart->patch_mm;
    box b;
    weft_chart_patch_centre(chart, patch, &x, &y);
    if (!window_box(pose, x, y, half, picture->image, &b) ||
        !weft_homography_apply(&pose->to_pixel, x, y, &reading->u, &reading->v))
        return weft_fail(err, WEFT_ERR_NODATA, "patch \"%s\" lies outside the picture: move the chart",
                         chart->patches[patch].name);
    const size_t room = (size_t)(b.u1 - b.u0 + 1) * (size_t)(b.v1 - b.v0 + 1);
    double *const buffer = weft_alloc(room * (WEFT_SITES + 2), sizeof *buffer, err);
    uint8_t *const blocks = buffer ? weft_alloc(room * WEFT_SITES, 1, err) : NULL;
    if (!blocks) {
        weft_free(buffer);
        return WEFT_ERR_NOMEM;
    }
    collector c;
    for (int s = 0; s < WEFT_SITES; s++) {
        c.values[s] = buffer + room * (size_t)s;
        c.blocks[s] = blocks + room * (size_t)s;
    }
    collect(picture, to_chart, x, y, half, &b, &c);
    weft_err status = WEFT_OK;
    const int wanted = (picture->cfa == WEFT_CFA_NONE ? 1 : 4) * SITES_MIN;
    if (c.total < wanted)
        status = weft_fail(
            err, WEFT_ERR_NODATA,
            "patch \"%s\" has only %d pixels in its middle (%d wanted): fill more of the picture with "
            "the chart",
            chart->patches[patch].name, c.total, wanted);
    else
        summarise(&c, buffer + room * WEFT_SITES, reading);
    weft_free(buffer);
    weft_free(blocks);
    return status;
}

weft_err weft_chart_measure(const weft_chart *chart, const weft_chart_picture *picture,
                            const weft_chart_pose *pose, weft_patch_reading *readings, weft_error *err)
{
    weft_mat3 to_chart;
    if (!weft_mat3_invert(&pose->to_pixel, &to_chart))
        return weft_fail(err, WEFT_ERR_NODATA, "the chart's position is degenerate: give other corners");
    for (int p = 0; p < chart->columns * chart->rows; p++)
        WEFT_TRY(measure_patch(chart, picture, pose, &to_chart, p, &readings[p], err));
    return WEFT_OK;
}
