/* weft_plate_demosaic(), declared in plate.h: Malvar, He, Cutler, "High-quality linear interpolation for
 * demosaicing of Bayer-patterned color images", ICASSP 2004, and 2 x 2 cells. */
#include "core/clones.h"
#include "core/parallel.h"
#include "host/set/plate.h"

#include <math.h>
#include <string.h>

#define REACH 2 /* of the filters, in pixels */

/* Index inside 0..n-1 by mirroring at the first and last sample, which keeps its parity and so its colour. */
static int mirror(int i, int n)
{
    while (i < 0 || i >= n)
        i = i < 0 ? -i : 2 * (n - 1) - i;
    return i;
}

/* The four filters of the paper's figure 2, from the sums that they share; `c` is the site itself, n1 the
 * two sites above and below, w1 left and right, d the four diagonal ones, n2 and w2 those two away. */
static inline float green_at_colour(float c, float n1, float w1, float n2, float w2)
{
    return 0.5f * c + 0.25f * (n1 + w1) - 0.125f * (n2 + w2);
}

static inline float colour_at_green(float c, float near, float d, float along, float across)
{
    return 0.625f * c + 0.5f * near - 0.125f * (along + d) + 0.0625f * across;
}

static inline float colour_at_other(float c, float d, float n2, float w2)
{
    return 0.75f * c + 0.25f * d - 0.1875f * (n2 + w2);
}

/* One pixel at the border, with mirrored indices. */
static void demosaic_pixel(const weft_image *mosaic, weft_cfa cfa, int u, int v, float rgb[3])
{
    float s[5][5];
    for (int j = -REACH; j <= REACH; j++)
        for (int i = -REACH; i <= REACH; i++)
            s[j + REACH][i + REACH] =
                weft_image_row(mosaic, 0, mirror(v + j, mosaic->height))[mirror(u + i, mosaic->width)];
    const float c = s[2][2], n1 = s[1][2] + s[3][2], w1 = s[2][1] + s[2][3];
    const float d = s[1][1] + s[1][3] + s[3][1] + s[3][3], n2 = s[0][2] + s[4][2], w2 = s[2][0] + s[2][4];
    const int own = weft_cfa_colour(cfa, u, v), beside = weft_cfa_colour(cfa, u + 1, v);
    rgb[own] = c;
    if (own == 1) {
        rgb[beside] = colour_at_green(c, w1, d, w2, n2);
        rgb[2 - beside] = colour_at_green(c, n1, d, n2, w2);
    } else {
        rgb[1] = green_at_colour(c, n1, w1, n2, w2);
        rgb[2 - own] = colour_at_other(c, d, n2, w2);
    }
}

/* The inside of a row: every filter at every site, then the choice by parity, so that all loads are in
 * order.  `first` is the parity of the columns with green; `own` is the row's red or blue, `other` the rest.
 */
WEFT_CLONES static void demosaic_row(const float *const s[5], int width, int green_parity, float *own,
                                     float *green, float *other)
{
    const float *const a = s[0], *const b = s[1], *const m = s[2], *const e = s[3], *const f = s[4];
    for (int u = REACH; u < width - REACH; u++) {
        const float c = m[u], n1 = b[u] + e[u], w1 = m[u - 1] + m[u + 1];
        const float d = b[u - 1] + b[u + 1] + e[u - 1] + e[u + 1];
        const float n2 = a[u] + f[u], w2 = m[u - 2] + m[u + 2];
        const int is_green = (u & 1) == green_parity;
        const float g = green_at_colour(c, n1, w1, n2, w2), x = colour_at_other(c, d, n2, w2);
        const float row = colour_at_green(c, w1, d, w2, n2), column = colour_at_green(c, n1, d, n2, w2);
        own[u] = is_green ? row : c;
        green[u] = is_green ? c : g;
        other[u] = is_green ? column : x;
    }
}

typedef struct job {
    const weft_plate *mosaic;
    weft_plate *rgb;
} job;

static void linear_rows(void *context, int band, int row_begin, int row_end)
{
    const job *const j = context;
    const weft_image *const in = &j->mosaic->image;
    weft_image *const out = &j->rgb->image;
    const weft_cfa cfa = j->mosaic->cfa;
    (void)band;
    for (int v = row_begin; v < row_end; v++) {
        const float *rows[5];
        for (int i = 0; i < 5; i++)
            rows[i] = weft_image_row(in, 0, mirror(v + i - REACH, in->height));
        const int green_parity = weft_cfa_colour(cfa, 0, v) == 1 ? 0 : 1;
        const int own = weft_cfa_colour(cfa, 1 - green_parity, v);
        demosaic_row(rows, in->width, green_parity, weft_image_row(out, own, v), weft_image_row(out, 1, v),
                     weft_image_row(out, 2 - own, v));
        for (int u = 0; u < in->width; u++) {
            float rgb[3];
            if (u == REACH && in->width > 2 * REACH)
                u = in->width - REACH;
            demosaic_pixel(in, cfa, u, v, rgb);
            for (int p = 0; p < 3; p++)
                weft_image_row(out, p, v)[u] = rgb[p];
        }
    }
}

/* Every pixel whose filters touched a clipped site: the 3 x 3 around it and the four sites two away. */
static void spread_rows(void *context, int band, int row_begin, int row_end)
{
    const job *const j = context;
    const weft_mask *const in = &j->mosaic->clipped;
    const int w = in->width, h = in->height;
    (void)band;
    for (int v = row_begin; v < row_end; v++) {
        uint8_t *const out = j->rgb->clipped.data + (size_t)v * (size_t)w;
        for (int dv = -REACH; dv <= REACH; dv++) {
            if (v + dv < 0 || v + dv >= h)
                continue;
            const uint8_t *const row = in->data + (size_t)(v + dv) * (size_t)w;
            const int reach = dv == 0 ? 2 : dv == 2 || dv == -2 ? 0 : 1;
            for (int du = -reach; du <= reach; du++)
                for (int u = du < 0 ? -du : 0; u < w - (du > 0 ? du : 0); u++)
                    out[u] |= row[u + du];
        }
    }
}

static void half_rows(void *context, int band, int row_begin, int row_end)
{
    const job *const j = context;
    const weft_image *const in = &j->mosaic->image;
    weft_image *const out = &j->rgb->image;
    const weft_cfa cfa = j->mosaic->cfa;
    (void)band;
    for (int v = row_begin; v < row_end; v++)
        for (int u = 0; u < out->width; u++) {
            float sum[3] = {0, 0, 0};
            uint8_t clipped = 0;
            for (int k = 0; k < 4; k++) {
                const int x = 2 * u + (k & 1), y = 2 * v + (k >> 1);
                const int colour = weft_cfa_colour(cfa, x, y);
                sum[colour] += weft_image_row(in, 0, y)[x] * (colour == 1 ? 0.5f : 1);
                clipped |= j->mosaic->clipped.data[(size_t)y * (size_t)in->width + (size_t)x];
            }
            for (int p = 0; p < 3; p++)
                weft_image_row(out, p, v)[u] = sum[p];
            j->rgb->clipped.data[(size_t)v * (size_t)out->width + (size_t)u] = clipped;
        }
}

/* Pictures: grey fills three planes; HALF is the mean of 2 x 2 pixels. */
static void picture_rows(void *context, int band, int row_begin, int row_end)
{
    const job *const j = context;
    const weft_image *const in = &j->mosaic->image;
    weft_image *const out = &j->rgb->image;
    const int step = out->width == in->width && out->height == in->height ? 1 : 2;
    const float share = 1.0f / (float)(step * step);
    (void)band;
    for (int v = row_begin; v < row_end; v++)
        for (int u = 0; u < out->width; u++) {
            uint8_t clipped = 0;
            for (int p = 0; p < 3; p++) {
                float sum = 0;
                for (int k = 0; k < step * step; k++) {
                    const int x = step * u + k % step, y = step * v + k / step;
                    sum += weft_image_row(in, in->planes == 3 ? p : 0, y)[x];
                    clipped |= j->mosaic->clipped.data[(size_t)y * (size_t)in->width + (size_t)x];
                }
                weft_image_row(out, p, v)[u] = sum * share;
            }
            j->rgb->clipped.data[(size_t)v * (size_t)out->width + (size_t)u] = clipped;
        }
}

weft_err weft_plate_demosaic(const weft_plate *mosaic, weft_demosaic how, weft_plate *rgb, weft_error *err)
{
    const weft_image *const in = &mosaic->image;
    if (in->width < 2 || in->height < 2)
        return weft_fail(err, WEFT_ERR_RANGE, "a plate of %d x %d pixels is too small to make colours of",
                         in->width, in->height);
    const int step = how == WEFT_DEMOSAIC_HALF ? 2 : 1;
    weft_plate made = {.cfa = WEFT_CFA_NONE, .noise_floor = mosaic->noise_floor};
    weft_err status = weft_image_init(&made.image, in->width / step, in->height / step, 3, err);
    if (status == WEFT_OK)
        status = weft_mask_init(&made.clipped, in->width / step, in->height / step, 0, err);
    if (status != WEFT_OK) {
        weft_plate_fini(&made);
        return status;
    }
    job j = {mosaic, &made};
    if (mosaic->cfa == WEFT_CFA_NONE)
        weft_parallel_rows(made.image.height, picture_rows, &j);
    else if (how == WEFT_DEMOSAIC_HALF)
        weft_parallel_rows(made.image.height, half_rows, &j);
    else {
        weft_parallel_rows(in->height, linear_rows, &j);
        weft_parallel_rows(in->height, spread_rows, &j);
    }
    *rgb = made;
    return WEFT_OK;
}
