#include "host/solve/bounce.h"

#include "core/clones.h"
#include "core/mem_limit.h"
#include "core/parallel.h"
#include "shading/bake/height_poisson.h"

#include <math.h>
#include <string.h>

enum { DIRECTIONS = 8, STEPS = 9 };

/* Finer relief than this hides no sky that the coarser one does not, and costs the square of it. */
static const double finest_mm = 0.12;
/* Of a cloth that sees nothing but itself, and is white. */
static const float most_bounce = 0.6F;

typedef struct bounce_job {
    weft_maps *maps;
    weft_cfa cfa;
    int reduce;        /* pixels of the maps to a side of a cell */
    weft_image normal; /* [3] of the cells */
    weft_image height; /* mm */
    weft_image open;   /* share of the sky that a cell sees */
    float cell_mm;
    float mean[3]; /* reflectance of the cloth in the camera's colours */
} bounce_job;

static void mean_normal(const bounce_job *job, int column, int row, float n[3])
{
    const weft_maps *const m = job->maps;
    float sum[3] = {0};
    for (int j = 0; j < job->reduce; j++)
        for (int i = 0; i < job->reduce; i++) {
            const int u = column * job->reduce + i, v = row * job->reduce + j;
            for (int c = 0; c < 3; c++)
                sum[c] += weft_image_row(&m->normal, c, v)[u];
        }
    const bool known = sum[2] > 0;
    for (int c = 0; c < 3; c++)
        n[c] = known ? sum[c] : c == 2 ? 1.0F : 0.0F;
}

static void cell_rows(void *context, int band, int row_begin, int row_end)
{
    bounce_job *const job = context;
    (void)band;
    for (int row = row_begin; row < row_end; row++)
        for (int column = 0; column < job->normal.width; column++) {
            float n[3];
            mean_normal(job, column, row, n);
            for (int c = 0; c < 3; c++)
                weft_image_row(&job->normal, c, row)[column] = n[c];
        }
}

/* The whole cloth's reflectance per colour: answered sites, in bands added in order. */
static void find_means(bounce_job *job)
{
    const weft_maps *const m = job->maps;
    double sum[3] = {0}, n[3] = {0};
    for (int v = 0; v < m->height; v++, weft_mem_trim())
        for (int u = 0; u < m->width; u++) {
            if (!m->mask.data[(size_t)v * (size_t)m->width + (size_t)u])
                continue;
            for (int c = 0; c < 3; c++) {
                if (job->cfa != WEFT_CFA_NONE && weft_cfa_colour(job->cfa, u, v) != c)
                    continue;
                sum[c] += (double)weft_image_row(&m->albedo, job->cfa == WEFT_CFA_NONE ? c : 0, v)[u];
                n[c]++;
            }
        }
    for (int c = 0; c < 3; c++)
        job->mean[c] = n[c] > 0 ? (float)fmin(fmax(sum[c] / n[c], 0), 1) : 0;
}

/* ---- how much of the sky is open ---- */

/* Cells to look at along a direction: distances grow, as the steepest view is to what is near. */
static void plan_steps(int du[DIRECTIONS][STEPS], int dv[DIRECTIONS][STEPS])
{
    static const int reach[STEPS] = {1, 2, 3, 4, 6, 8, 12, 16, 24};
    for (int d = 0; d < DIRECTIONS; d++)
        for (int s = 0; s < STEPS; s++) {
            const double angle = 6.283185307179586 * d / DIRECTIONS;
            du[d][s] = (int)lround(reach[s] * cos(angle));
            dv[d][s] = (int)lround(reach[s] * sin(angle));
        }
}

/* Raises the horizon of a row of cells by what stands (du, dv) away. */
WEFT_INLINE void look(const float *here, const float *there, int first, int last, int du, float per_mm,
                      float *horizon)
{
    WEFT_INDEPENDENT
    for (int u = first; u < last; u++) {
        const float rise = (there[u + du] - here[u]) * per_mm;
        horizon[u] = rise > horizon[u] ? rise : horizon[u];
    }
}

/* A sky of even brightness over a level patch, cosine-weighted: what a direction's horizon leaves of it is
 * cos^2 of its elevation. */
WEFT_CLONES static void open_rows(void *context, int band, int row_begin, int row_end)
{
    bounce_job *const job = context;
    const int width = job->height.width, height = job->height.height;
    int du[DIRECTIONS][STEPS], dv[DIRECTIONS][STEPS];
    (void)band;
    plan_steps(du, dv);
    for (int row = row_begin; row < row_end; row++) {
        const float *const here = weft_image_row(&job->height, 0, row);
        float *const open = weft_image_row(&job->open, 0, row);
        float *const horizon = weft_image_row(&job->normal, 0, row); /* the cells' normals are used up */
        memset(open, 0, (size_t)width * sizeof *open);
        for (int d = 0; d < DIRECTIONS; d++) {
            memset(horizon, 0, (size_t)width * sizeof *horizon);
            for (int s = 0; s < STEPS; s++) {
                const int v = row + dv[d][s], u = du[d][s];
                const float per_mm = 1 / (job->cell_mm * hypotf((float)u, (float)dv[d][s]));
                if (v < 0 || v >= height)
                    break;
                look(here, weft_image_row(&job->height, 0, v), u < 0 ? -u : 0, u > 0 ? width - u : width, u,
                     per_mm, horizon);
            }
            WEFT_INDEPENDENT
            for (int u = 0; u < width; u++)
                open[u] += 1.0F / DIRECTIONS / (1 + horizon[u] * horizon[u]);
        }
    }
}

/* ---- the correction ---- */

/* Bilinear between the middles of the cells. */
static float openness_at(const bounce_job *job, int u, int v)
{
    if (job->reduce == 1)
        return weft_image_row(
            &job->open, 0,
            v < job->open.height ? v : job->open.height - 1)[u < job->open.width ? u : job->open.width - 1];
    return weft_image_sample(&job->open, 0, (u + 0.5) / job->reduce - 0.5, (v + 0.5) / job->reduce - 0.5);
}

/* n + q z, scaled by `length`, split into n and the factor of its length: |length (n + q z)| = k |n + q z|.
 */
static float split(float n[3], float q)
{
    /* n_measured = (n + q z) / |n + q z|; |n| = 1 gives the positive root of s^2 - 2 s q n_z + q^2 = 1. */
    const float b = q * n[2], inner = b * b - q * q + 1;
    const float s = b + sqrtf(inner > 0 ? inner : 0.0F);
    n[0] *= s;
    n[1] *= s;
    n[2] = n[2] * s - q;
    return s;
}

static void correct_rows(void *context, int band, int row_begin, int row_end)
{
    bounce_job *const job = context;
    weft_maps *const m = job->maps;
    (void)band;
    for (int v = row_begin; v < row_end; v++)
        for (int u = 0; u < m->width; u++) {
            if (!m->mask.data[(size_t)v * (size_t)m->width + (size_t)u])
                continue;
            const float closed = 1 - openness_at(job, u, v);
            float n[3], q = 0;
            for (int c = 0; c < 3; c++)
                n[c] = weft_image_row(&m->normal, c, v)[u];
            if (job->cfa != WEFT_CFA_NONE) {
                q = fminf(closed * job->mean[weft_cfa_colour(job->cfa, u, v)], most_bounce);
                weft_image_row(&m->albedo, 0, v)[u] /= split(n, q);
            } else {
                static const float grey[3] = {0.2126F, 0.7152F, 0.0722F};
                float a[3], sum = 1e-9F;
                for (int c = 0; c < 3; c++) {
                    a[c] = weft_image_row(&m->albedo, c, v)[u];
                    sum += grey[c] * fmaxf(a[c], 0);
                    q += grey[c] * fmaxf(a[c], 0) * fminf(closed * job->mean[c], most_bounce);
                }
                split(n, q / sum);
                for (int c = 0; c < 3; c++) {
                    const float qc = fminf(closed * job->mean[c], most_bounce);
                    weft_image_row(&m->albedo, c, v)[u] = a[c] / sqrtf(1 + 2 * qc * n[2] + qc * qc);
                }
            }
            const float length = sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
            for (int c = 0; c < 3 && length > 0; c++)
                weft_image_row(&m->normal, c, v)[u] = n[c] / length;
        }
}

static double mean_of(const weft_image *image)
{
    double sum = 0;
    const size_t n = weft_image_plane_size(image);
    for (size_t i = 0; i < n; i++)
        sum += (double)image->data[i];
    return sum / (double)n;
}

weft_err weft_bounce_take_off(weft_maps *maps, weft_cfa cfa, double mm_per_px, weft_bounce_report *report,
                              weft_error *err)
{
    bounce_job job = {.maps = maps, .cfa = cfa};
    weft_height_info info;
    job.reduce = (int)fmax(1, floor(finest_mm / mm_per_px));
    const int width = maps->width / job.reduce, height = maps->height / job.reduce;
    job.cell_mm = (float)(mm_per_px * job.reduce);
    if (width < 8 || height < 8)
        return WEFT_OK;
    weft_err status = weft_image_init(&job.normal, width, height, 3, err);
    if (status == WEFT_OK)
        status = weft_image_init(&job.open, width, height, 1, err);
    if (status == WEFT_OK) {
        weft_parallel_rows(height, cell_rows, &job);
        status =
            weft_height_integrate(&job.normal, NULL, (double)job.cell_mm, false, &job.height, &info, err);
    }
    if (status == WEFT_OK) {
        find_means(&job);
        weft_parallel_rows(height, open_rows, &job);
        weft_parallel_rows(maps->height, correct_rows, &job);
        *report = (weft_bounce_report){true, info.relief_mm, mean_of(&job.open)};
    }
    weft_image_fini(&job.normal);
    weft_image_fini(&job.height);
    weft_image_fini(&job.open);
    return status;
}
