#include "host/solve/site_demosaic.h"

#include "core/parallel.h"

#include <math.h>
#include <string.h>

/* Pixels around the picture, mirrored so that parity and colour are kept. */
enum { PAD = 8, REACH = 4, AROUND = 2, LEAST = PAD + 2 };

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
    weft_image green; /* 1 plane: green everywhere */
    weft_image *rgb;
} demosaic_job;

static int mirror(int i, int n)
{
    return i < 0 ? -i : i >= n ? 2 * (n - 1) - i : i;
}

static void pad_rows(void *context, int band, int row_begin, int row_end)
{
    demosaic_job *const job = context;
    const weft_image *const m = job->mosaic;
    (void)band;
    for (int v = row_begin; v < row_end; v++) {
        const float *const from = weft_image_row(m, 0, mirror(v - PAD, m->height));
        float *const to = weft_image_row(&job->padded, 0, v);
        memcpy(to + PAD, from, (size_t)m->width * sizeof *to);
        for (int i = 0; i < PAD; i++) {
            to[i] = from[mirror(i - PAD, m->width)];
            to[PAD + m->width + i] = from[mirror(m->width + i, m->width)];
        }
    }
}

/* Colour of a padded pixel: PAD is even, so the phase is the mosaic's. */
static bool is_green(const demosaic_job *job, int u, int v)
{
    return weft_cfa_colour(job->cfa, u, v) == 1;
}

static void difference_rows(void *context, int band, int row_begin, int row_end)
{
    demosaic_job *const job = context;
    const weft_image *const p = &job->padded;
    const size_t w = (size_t)p->width;
    (void)band;
    for (int v = row_begin; v < row_end; v++) {
        if (v < 2 || v >= p->height - 2)
            continue;
        const float *const m = weft_image_row(p, 0, v);
        float *const across = weft_image_row(&job->along, 0, v), *const down =
                                                                     weft_image_row(&job->along, 1, v);
        for (int u = 2; u < p->width - 2; u++) {
            const float *const c = m + u;
            const float sign = is_green(job, u, v) ? 1.0F : -1.0F;
            const float h = 0.5F * (c[-1] + c[1]) + 0.25F * (2 * c[0] - c[-2] - c[2]);
            const float t = 0.5F * (*(c - w) + *(c + w)) + 0.25F * (2 * c[0] - *(c - 2 * w) - *(c + 2 * w));
            across[u] = sign * (c[0] - h);
            down[u] = sign * (c[0] - t);
        }
    }
}

static void turn_rows(void *context, int band, int row_begin, int row_end)
{
    demosaic_job *const job = context;
    const size_t w = (size_t)job->along.width;
    (void)band;
    for (int v = row_begin; v < row_end; v++) {
        if (v < 3 || v >= job->along.height - 3)
            continue;
        const float *const across = weft_image_row(&job->along, 0, v);
        const float *const down = weft_image_row(&job->along, 1, v);
        float *const turn_across = weft_image_row(&job->turn, 0, v);
        float *const turn_down = weft_image_row(&job->turn, 1, v);
        for (int u = 3; u < job->along.width - 3; u++) {
            turn_across[u] = fabsf(across[u + 1] - across[u - 1]);
            turn_down[u] = fabsf(*(down + u + w) - *(down + u - w));
        }
    }
}

/* Mean of the difference over a direction's five pixels, and the inverse square of its change there. */
static void look(const weft_image *along, const weft_image *turn, int plane, int u, int v, int du, int dv,
                 float *sum, float *sum_weight)
{
    float mean = 0, change = 1e-6F;
    for (int i = 0; i <= REACH; i++)
        mean += 0.2F * weft_image_row(along, plane, v + i * dv)[u + i * du];
    const int side_u = dv ? 1 : 0, side_v = du ? 1 : 0; /* the window is five wide across the direction */
    for (int i = 0; i <= REACH; i++)
        for (int j = -2; j <= 2; j++)
            change += weft_image_row(turn, plane, v + i * dv + j * side_v)[u + i * du + j * side_u];
    const float weight = 1 / (change * change);
    *sum += weight * mean;
    *sum_weight += weight;
}

static void green_rows(void *context, int band, int row_begin, int row_end)
{
    demosaic_job *const job = context;
    const weft_image *const m = job->mosaic;
    (void)band;
    for (int v = row_begin; v < row_end; v++)
        for (int u = 0; u < m->width; u++) {
            const float own = weft_image_row(m, 0, v)[u];
            float sum = 0, weight = 0;
            if (!is_green(job, u, v)) {
                look(&job->along, &job->turn, 0, u + PAD, v + PAD, 1, 0, &sum, &weight);
                look(&job->along, &job->turn, 0, u + PAD, v + PAD, -1, 0, &sum, &weight);
                look(&job->along, &job->turn, 1, u + PAD, v + PAD, 0, 1, &sum, &weight);
                look(&job->along, &job->turn, 1, u + PAD, v + PAD, 0, -1, &sum, &weight);
            }
            weft_image_row(&job->green, 0, v)[u] = weight > 0 ? own + sum / weight : own;
        }
}

/* Green minus a colour at (u, v): mean over the sites of that colour near by, those of like green first. */
static float difference_of(const demosaic_job *job, int colour, int u, int v)
{
    const weft_image *const m = job->mosaic;
    const float here = weft_image_row(&job->green, 0, v)[u];
    float sum = 0, sum_weight = 0;
    for (int dv = -AROUND; dv <= AROUND; dv++)
        for (int du = -AROUND; du <= AROUND; du++) {
            const int x = mirror(u + du, m->width), y = mirror(v + dv, m->height);
            if (weft_cfa_colour(job->cfa, x, y) != colour)
                continue;
            const float green = weft_image_row(&job->green, 0, y)[x];
            const float apart = green - here, near = alike * (fabsf(green) + fabsf(here)) + 1e-3F;
            const float weight = 1 / ((apart * apart + near * near) * (float)(1 + du * du + dv * dv));
            sum += weight * (green - weft_image_row(m, 0, y)[x]);
            sum_weight += weight;
        }
    return sum / sum_weight;
}

static void colour_rows(void *context, int band, int row_begin, int row_end)
{
    demosaic_job *const job = context;
    const weft_image *const m = job->mosaic;
    (void)band;
    for (int v = row_begin; v < row_end; v++)
        for (int u = 0; u < m->width; u++) {
            const int own = weft_cfa_colour(job->cfa, u, v);
            const float value = weft_image_row(m, 0, v)[u], green = weft_image_row(&job->green, 0, v)[u];
            for (int c = 0; c < 3; c += 2)
                weft_image_row(job->rgb, c, v)[u] = c == own ? value : green - difference_of(job, c, u, v);
            weft_image_row(job->rgb, 1, v)[u] = green;
        }
}

weft_err weft_site_demosaic(const weft_image *mosaic, weft_cfa cfa, weft_image *rgb, weft_error *err)
{
    const int width = mosaic->width + 2 * PAD, height = mosaic->height + 2 * PAD;
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
        status = weft_image_init(&job.green, mosaic->width, mosaic->height, 1, err);
    if (status == WEFT_OK)
        status = weft_image_init(&made, mosaic->width, mosaic->height, 3, err);
    if (status == WEFT_OK) {
        weft_parallel_rows(height, pad_rows, &job);
        weft_parallel_rows(height, difference_rows, &job);
        weft_parallel_rows(height, turn_rows, &job);
        weft_parallel_rows(mosaic->height, green_rows, &job);
        weft_parallel_rows(mosaic->height, colour_rows, &job);
        *rgb = made;
    }
    weft_image_fini(&job.padded);
    weft_image_fini(&job.along);
    weft_image_fini(&job.turn);
    weft_image_fini(&job.green);
    return status;
}
