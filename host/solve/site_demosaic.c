#include "host/solve/site_demosaic.h"

#include "core/clones.h"
#include "core/parallel.h"

#include <math.h>
#include <string.h>

/* Pixels around the picture, mirrored so that parity and colour are kept; to the right there are LANES more,
 * so that whole vectors can be read. */
enum { PAD = 8, REACH = 4, AROUND = 2, LEAST = PAD + 2, LANES = 16, MOST_SITES = 6 };

/* Greens that differ by less than this part of their sum count as alike: a few times the noise. */
static const float alike = 0.05F;

typedef struct demosaic_job {
    const weft_image *mosaic;
    weft_cfa cfa;
    weft_image padded; /* 1 plane */
    /* Green minus the other colour of the row, and of the column, estimated at every pixel: green's own site
     * takes the other colour from its neighbours, the other's site green. */
    weft_image along; /* 2 planes: rows, columns */
    weft_image turn;  /* 2 planes: how much `along` changes from the neighbour before to the one after */
    weft_image green; /* 1 plane, padded too: green everywhere */
    weft_image *rgb;
} demosaic_job;

static int mirror(int i, int n)
{
    return i < 0 ? -i : i >= n ? 2 * (n - 1) - i : i;
}

/* Mirrors the margins of a padded row from what stands in its middle. */
static void mirror_row(float *row, int width)
{
    for (int i = 0; i < PAD; i++) {
        row[i] = row[PAD + mirror(i - PAD, width)];
        row[PAD + width + i] = row[PAD + mirror(width + i, width)];
    }
}

static void pad_rows(void *context, int band, int row_begin, int row_end)
{
    demosaic_job *const job = context;
    const weft_image *const m = job->mosaic;
    (void)band;
    for (int v = row_begin; v < row_end; v++) {
        float *const to = weft_image_row(&job->padded, 0, v);
        memcpy(to + PAD, weft_image_row(m, 0, mirror(v - PAD, m->height)), (size_t)m->width * sizeof *to);
        mirror_row(to, m->width);
    }
}

/* Colour of a padded pixel: PAD is even, so the phase is the mosaic's. */
static bool is_green(const demosaic_job *job, int u, int v)
{
    return weft_cfa_colour(job->cfa, u, v) == 1;
}

WEFT_CLONES static void difference_rows(void *context, int band, int row_begin, int row_end)
{
    demosaic_job *const job = context;
    const weft_image *const p = &job->padded;
    const int width = p->width;
    (void)band;
    for (int v = row_begin; v < row_end; v++) {
        if (v < 2 || v >= p->height - 2)
            continue;
        const float *const c = weft_image_row(p, 0, v);
        const float *const up = c - width, *const up2 = up - width, *const down = c + width,
                           *const down2 = down + width;
        float *const across = weft_image_row(&job->along, 0, v), *const along =
                                                                     weft_image_row(&job->along, 1, v);
        const float even = is_green(job, 0, v) ? 1.0F : -1.0F;
        WEFT_INDEPENDENT
        for (int u = 2; u < width - 2; u++) {
            const float sign = u & 1 ? -even : even;
            const float h = 0.5F * (c[u - 1] + c[u + 1]) + 0.25F * (2 * c[u] - c[u - 2] - c[u + 2]);
            const float t = 0.5F * (up[u] + down[u]) + 0.25F * (2 * c[u] - up2[u] - down2[u]);
            across[u] = sign * (c[u] - h);
            along[u] = sign * (c[u] - t);
        }
    }
}

WEFT_CLONES static void turn_rows(void *context, int band, int row_begin, int row_end)
{
    demosaic_job *const job = context;
    const int width = job->along.width;
    (void)band;
    for (int v = row_begin; v < row_end; v++) {
        if (v < 3 || v >= job->along.height - 3)
            continue;
        const float *const across = weft_image_row(&job->along, 0, v);
        const float *const above = weft_image_row(&job->along, 1, v - 1);
        const float *const below = weft_image_row(&job->along, 1, v + 1);
        float *const turn_across = weft_image_row(&job->turn, 0, v);
        float *const turn_down = weft_image_row(&job->turn, 1, v);
        WEFT_INDEPENDENT
        for (int u = 3; u < width - 3; u++) {
            turn_across[u] = fabsf(across[u + 1] - across[u - 1]);
            turn_down[u] = fabsf(below[u] - above[u]);
        }
    }
}

/* Mean of the difference over a direction's five pixels, and the inverse square of its change there, of LANES
 * pixels from padded (u, v) on.  The window is five wide across the direction. */
WEFT_INLINE void look(const demosaic_job *job, int plane, int u, int v, int du, int dv, float sum[LANES],
                      float sum_weight[LANES])
{
    const int side_u = dv ? 1 : 0, side_v = du ? 1 : 0;
    float mean[LANES] = {0}, change[LANES];
    for (int k = 0; k < LANES; k++)
        change[k] = 1e-6F;
    for (int i = 0; i <= REACH; i++) {
        const int at_u = u + i * du, at_v = v + i * dv;
        const float *const a = weft_image_row(&job->along, plane, at_v) + at_u;
#pragma omp simd
        for (int k = 0; k < LANES; k++)
            mean[k] += 0.2F * a[k];
        for (int j = -2; j <= 2; j++) {
            const int side = at_u + j * side_u;
            const float *const t = weft_image_row(&job->turn, plane, at_v + j * side_v) + side;
#pragma omp simd
            for (int k = 0; k < LANES; k++)
                change[k] += t[k];
        }
    }
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const float weight = 1 / (change[k] * change[k]);
        sum[k] += weight * mean[k];
        sum_weight[k] += weight;
    }
}

WEFT_CLONES static void green_rows(void *context, int band, int row_begin, int row_end)
{
    demosaic_job *const job = context;
    const int width = job->mosaic->width;
    (void)band;
    for (int v = row_begin + PAD; v < row_end + PAD; v++) {
        const float *const own = weft_image_row(&job->padded, 0, v);
        float *const to = weft_image_row(&job->green, 0, v);
        const int odd_is_green = is_green(job, 1, v);
        for (int u = PAD; u < PAD + width; u += LANES) {
            float sum[LANES] = {0}, weight[LANES] = {0};
            look(job, 0, u, v, 1, 0, sum, weight);
            look(job, 0, u, v, -1, 0, sum, weight);
            look(job, 1, u, v, 0, 1, sum, weight);
            look(job, 1, u, v, 0, -1, sum, weight);
#pragma omp simd
            for (int k = 0; k < LANES; k++)
                to[u + k] = (k & 1) == odd_is_green ? own[u + k] : own[u + k] + sum[k] / weight[k];
        }
        mirror_row(to, width);
    }
}

/* The rows above and below the picture, as in the mosaic. */
static void mirror_green(demosaic_job *job)
{
    const int height = job->mosaic->height;
    const size_t bytes = (size_t)job->green.width * sizeof(float);
    for (int i = 1; i <= AROUND; i++) {
        memcpy(weft_image_row(&job->green, 0, PAD - i), weft_image_row(&job->green, 0, PAD + i), bytes);
        memcpy(weft_image_row(&job->green, 0, PAD + height - 1 + i),
               weft_image_row(&job->green, 0, PAD + height - 1 - i), bytes);
    }
}

/* Where a colour's sites lie around pixels of one parity. */
typedef struct site_list {
    bool own; /* the pixels themselves are of the colour */
    int n, du[MOST_SITES], dv[MOST_SITES];
} site_list;

static site_list sites_around(weft_cfa cfa, int colour, int u, int v)
{
    site_list s = {.own = weft_cfa_colour(cfa, u, v) == colour};
    for (int dv = -AROUND; dv <= AROUND && !s.own; dv++)
        for (int du = -AROUND; du <= AROUND; du++)
            if (weft_cfa_colour(cfa, u + du + 2, v + dv + 2) == colour) {
                s.du[s.n] = du;
                s.dv[s.n++] = dv;
            }
    return s;
}

/* A colour of LANES pixels from padded (u, v) on, for those of parity `odd`: green less the mean difference
 * of the sites near by, those of like green first. */
WEFT_INLINE void colour_lanes(const demosaic_job *job, const site_list *s, int odd, int u, int v,
                              float to[LANES])
{
    const float *const here = weft_image_row(&job->green, 0, v) + u, *const own =
                                                                         weft_image_row(&job->padded, 0, v) +
                                                                         u;
    float sum[LANES] = {0}, sum_weight[LANES];
    for (int k = 0; k < LANES; k++)
        sum_weight[k] = s->own ? 1.0F : 0.0F;
    for (int i = 0; i < s->n; i++) {
        const float *const green = weft_image_row(&job->green, 0, v + s->dv[i]) + u + s->du[i];
        const float *const value = weft_image_row(&job->padded, 0, v + s->dv[i]) + u + s->du[i];
        const float away = (float)(1 + s->du[i] * s->du[i] + s->dv[i] * s->dv[i]);
#pragma omp simd
        for (int k = 0; k < LANES; k++) {
            const float apart = green[k] - here[k], near = alike * (fabsf(green[k]) + fabsf(here[k])) + 1e-3F;
            const float weight = 1 / ((apart * apart + near * near) * away);
            sum[k] += weight * (green[k] - value[k]);
            sum_weight[k] += weight;
        }
    }
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const float found = s->own ? own[k] : here[k] - sum[k] / sum_weight[k];
        to[k] = (k & 1) == odd ? found : to[k];
    }
}

WEFT_CLONES static void colour_rows(void *context, int band, int row_begin, int row_end)
{
    demosaic_job *const job = context;
    const int width = job->mosaic->width;
    (void)band;
    for (int v = row_begin; v < row_end; v++) {
        memcpy(weft_image_row(job->rgb, 1, v), weft_image_row(&job->green, 0, v + PAD) + PAD,
               (size_t)width * sizeof(float));
        for (int c = 0; c < 3; c += 2) {
            const site_list even = sites_around(job->cfa, c, 0, v), odd = sites_around(job->cfa, c, 1, v);
            for (int u = 0; u < width; u += LANES) {
                float lanes[LANES] = {0};
                const int n = width - u < LANES ? width - u : LANES;
                colour_lanes(job, &even, 0, u + PAD, v + PAD, lanes);
                colour_lanes(job, &odd, 1, u + PAD, v + PAD, lanes);
                memcpy(weft_image_row(job->rgb, c, v) + u, lanes, (size_t)n * sizeof(float));
            }
        }
    }
}

weft_err weft_site_demosaic(const weft_image *mosaic, weft_cfa cfa, weft_image *rgb, weft_error *err)
{
    const int width = mosaic->width + 2 * PAD + LANES, height = mosaic->height + 2 * PAD;
    weft_image made = {0};
    demosaic_job job = {.mosaic = mosaic, .cfa = cfa, .rgb = &made};
    if (mosaic->width < LEAST || mosaic->height < LEAST)
        return weft_fail(err, WEFT_ERR_RANGE, "a mosaic of %d x %d pixels is too small (at least %d a side)",
                         mosaic->width, mosaic->height, LEAST);
    weft_err status = weft_image_init(&job.padded, width, height, 1, err);
    if (status == WEFT_OK)
        status = weft_image_init(&job.along, width, height, 2, err);
    if (status == WEFT_OK)
        status = weft_image_init(&job.turn, width, height, 2, err);
    if (status == WEFT_OK)
        status = weft_image_init(&job.green, width, height, 1, err);
    if (status == WEFT_OK) {
        weft_parallel_rows(height, pad_rows, &job);
        weft_parallel_rows(height, difference_rows, &job);
        weft_parallel_rows(height, turn_rows, &job);
        weft_parallel_rows(mosaic->height, green_rows, &job);
        mirror_green(&job);
    }
    weft_image_fini(&job.along);
    weft_image_fini(&job.turn);
    if (status == WEFT_OK)
        status = weft_image_init(&made, mosaic->width, mosaic->height, 3, err);
    if (status == WEFT_OK) {
        weft_parallel_rows(mosaic->height, colour_rows, &job);
        *rgb = made;
    }
    weft_image_fini(&job.padded);
    weft_image_fini(&job.green);
    return status;
}
