#include "host/solve/refuse.h"

#include "calibration/lights/light_model.h"
#include "core/colour.h"
#include "core/linalg.h"
#include "core/mem.h"
#include "core/mem_limit.h"

#include <math.h>

/* ---- lights ---- */

static weft_vec3 direction(const weft_light *light, double height_mm)
{
    if (light->distant)
        return weft_normalise(light->direction);
    return weft_normalise(weft_sub(light->position, (weft_vec3){0, 0, height_mm}));
}

double weft_lights_gain(const weft_calibration *cal, double height_mm)
{
    weft_mat3 a = {{0}}, c;
    for (int j = 0; j < cal->n_lights; j++) {
        const weft_vec3 d = direction(&cal->lights[j], height_mm);
        const double l[3] = {d.x, d.y, d.z};
        for (int i = 0; i < 9; i++)
            a.m[i] += l[i / 3] * l[i % 3];
    }
    if (!weft_mat3_invert(&a, &c) || weft_mat3_determinant(&a) < 1e-12)
        return INFINITY;
    return sqrt(fmax(c.m[0] + c.m[4], 0));
}

weft_err weft_refuse_cone(const weft_calibration *cal, const char *cal_folder, double height_mm,
                          weft_error *err)
{
    const double gain = weft_lights_gain(cal, height_mm);
    double widest = 0;
    if (gain <= WEFT_REFUSE_GAIN)
        return WEFT_OK;
    for (int i = 0; i < cal->n_lights; i++)
        for (int j = 0; j < i; j++)
            widest = fmax(widest, weft_angle_between(direction(&cal->lights[i], height_mm),
                                                     direction(&cal->lights[j], height_mm)));
    return weft_fail(
        err, WEFT_ERR_RANGE,
        "%s: its %d lights lie within %.1f degrees of each other or in a plane: 1 %% of noise would turn "
        "a normal by %.1f degrees (spread the lights over the dome)",
        cal_folder, cal->n_lights, widest * 57.29577951308232, fmin(gain * 0.5729577951308232, 90));
}

/* ---- gamma-coded pictures ---- */

enum { COLUMNS = 12, ROWS = 12 };

typedef struct decoding {
    const weft_solve_plan *plan;
    const weft_light_plates *plates;
    const weft_mask *inside;
    float *rows; /* [3 n_lights][width] */
    weft_solve_samples *samples;
} decoding;

static void decode_row(const decoding *d, weft_solve_row_in in[WEFT_LIGHTS_MAX])
{
    const int width = d->plates->width;
    for (int j = 0; j < d->plates->n; j++) {
        const double time = d->plates->time[j];
        for (int c = 0; c < 3; c++) {
            float *const to = d->rows + (size_t)(3 * j + c) * (size_t)width;
            for (int u = 0; u < width; u++)
                to[u] = (float)(weft_srgb_decode((double)in[j].rgb[c][u] * time) / time);
            in[j].rgb[c] = to;
        }
        in[j].least = in[j].most = 0;
    }
}

/* Median misfit of blocks all over the picture, relative to the brightest fit. */
static int by_value(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static double misfit(const decoding *d, bool decoded)
{
    float found[COLUMNS * ROWS * WEFT_SOLVE_LANES];
    const int n_blocks = d->plates->width / WEFT_SOLVE_LANES;
    int n = 0;
    for (int j = 0; j < ROWS && n_blocks > 0; j++) {
        const int row = weft_spread_over(d->plates->height, j, ROWS);
        weft_solve_row_in in[WEFT_LIGHTS_MAX];
        weft_mem_trim();
        weft_light_plates_row(d->plates, row, in);
        if (decoded)
            decode_row(d, in);
        for (int i = 0; i < COLUMNS; i++) {
            weft_solve_answers a;
            const int block = weft_spread_over(n_blocks, i, COLUMNS);
            const size_t at = (size_t)row * (size_t)d->plates->width + (size_t)block * WEFT_SOLVE_LANES;
            weft_solve_gather(d->plan, row, block, in, d->samples);
            weft_method_lsq.solve(d->samples, &a);
            for (int k = 0; k < WEFT_SOLVE_LANES; k++)
                if (!(d->inside->data && !d->inside->data[at + (size_t)k]) && a.valid[k] > 0 &&
                    a.n_used[k] > 3.5F && a.albedo[0][k] > 0.02F && a.residual[k] > 0)
                    found[n++] = a.residual[k];
        }
    }
    if (n < 50)
        return 0;
    qsort(found, (size_t)n, sizeof *found, by_value);
    return (double)found[n / 2];
}

weft_err weft_refuse_coded(const weft_set *set, const weft_solve_plan *plan, const weft_light_plates *plates,
                           const weft_mask *inside, weft_error *err)
{
    decoding d = {plan, plates, inside, NULL, NULL};
    weft_err status = WEFT_OK;
    if (plates->cfa != WEFT_CFA_NONE || set->cfa != WEFT_CFA_NONE || plates->n < 4)
        return WEFT_OK;
    d.rows = weft_alloc((size_t)3 * (size_t)plates->n * (size_t)plates->width, sizeof *d.rows, err);
    d.samples = weft_alloc(1, sizeof *d.samples, err);
    if (!d.rows || !d.samples)
        status = WEFT_ERR_NOMEM;
    if (status == WEFT_OK) {
        const double linear = misfit(&d, false), coded = misfit(&d, true);
        if (linear > 0.02 && coded < 0.5 * linear)
            status = weft_fail(
                err, WEFT_ERR_FORMAT,
                "%s: its pictures are called linear but look gamma-coded: they miss a matte surface by "
                "%.1f %%, decoded as sRGB by %.1f %% (import them again with --transfer srgb)",
                set->folder, 100 * linear, 100 * coded);
    }
    weft_free(d.rows);
    weft_free(d.samples);
    return status;
}

/* ---- too few lights ---- */

weft_err weft_refuse_few_lights(const weft_set *set, const weft_mask *lights, const weft_mask *inside,
                                weft_error *err)
{
    const size_t all = (size_t)lights->width * (size_t)lights->height;
    size_t n = 0, few = 0;
    for (size_t i = 0; i < all; i++) {
        if (inside->data && !inside->data[i])
            continue;
        n++;
        few += lights->data[i] < 4;
    }
    if (2 * few <= n)
        return WEFT_OK;
    return weft_fail(
        err, WEFT_ERR_NODATA,
        "%s: %.0f %% of the sample has fewer than four usable lights, so nothing tells a wrong normal "
        "from a right one (look at the exposure of its frames, take more lights, or mask the sample)",
        set->folder, 100.0 * (double)few / (double)(n ? n : 1));
}
