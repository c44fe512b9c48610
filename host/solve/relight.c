#include "host/solve/relight.h"

#include "core/mem.h"
#include "core/parallel.h"
#include "host/solve/light_plates.h"

#include <math.h>
#include <string.h>

enum { LANES = WEFT_SOLVE_LANES };

/* Sums of one light over a band of rows. */
typedef struct light_sums {
    double n, difference, squares, measured, measured_squares;
} light_sums;

typedef struct relight_job {
    const weft_solve_plan *plan;
    const weft_light_plates *plates;
    const weft_mask *inside;
    light_sums (*sums)[WEFT_LIGHTS_MAX]; /* [bands] */
    weft_solve_samples *scratch;         /* [2 bands] of blocks */
    weft_image *map;
} relight_job;

static void solve_without(const weft_solve_plan *plan, int light, const weft_solve_samples *all,
                          weft_solve_samples *others, weft_solve_answers *answers)
{
    weft_solve_answers searched;
    memcpy(others, all, offsetof(weft_solve_samples, at) + (size_t)all->n_lights * sizeof all->at[0]);
    memset(others->at[light].weight, 0, sizeof others->at[light].weight);
    memset(others->at[light].grey, 0, sizeof others->at[light].grey);
    memset(others->at[light].value, 0, sizeof others->at[light].value);
    plan->method->solve(others, answers);
    if (!plan->method->search)
        return;
    bool any = false;
    for (int k = 0; k < LANES; k++)
        any |= answers->search[k] > 0;
    if (!any)
        return;
    plan->method->search(others, &searched);
    for (int k = 0; k < LANES; k++) {
        if (!(answers->search[k] > 0))
            continue;
        for (int c = 0; c < 3; c++) {
            answers->normal[c][k] = searched.normal[c][k];
            answers->albedo[c][k] = searched.albedo[c][k];
        }
        answers->valid[k] = searched.valid[k];
    }
}

/* The albedo that the grey samples have. */
static float grey_albedo(const weft_solve_samples *s, const weft_solve_answers *a, int k)
{
    if (s->n_channels == 1)
        return a->albedo[0][k];
    return 0.2126F * a->albedo[0][k] + 0.7152F * a->albedo[1][k] + 0.0722F * a->albedo[2][k];
}

/* One light of one block.  `raw` is the light's row: what a part of full scale is to the samples. */
static void judge_block(const relight_job *job, int light, int row, int first, int n,
                        const weft_solve_row_in *raw, const weft_solve_samples *s,
                        const weft_solve_answers *a, float squares[LANES], float counts[LANES],
                        light_sums *sums)
{
    const double time = job->plates->time[light];
    for (int k = 0; k < n; k++) {
        const int u = first + k;
        const size_t at = (size_t)row * (size_t)job->plates->width + (size_t)u;
        const float grey = s->at[light].grey[k];
        if (!(s->at[light].weight[k] > 0) || !(a->valid[k] > 0) ||
            (job->inside->data && !job->inside->data[at]))
            continue;
        const float cosine = a->normal[0][k] * s->at[light].light[0][k] +
                             a->normal[1][k] * s->at[light].light[1][k] +
                             a->normal[2][k] * s->at[light].light[2][k];
        const float predicted = grey_albedo(s, a, k) * (cosine > 0 ? cosine : 0), d = predicted - grey;
        squares[k] += d * d;
        counts[k] += 1;
        /* back to what the sensor would show: the ratio is the same for both */
        const double raw_value = s->n_channels == 1
                                     ? (double)raw->rgb[0][u]
                                     : 0.2126 * (double)raw->rgb[0][u] + 0.7152 * (double)raw->rgb[1][u] +
                                           0.0722 * (double)raw->rgb[2][u];
        const double scale = grey > 0 ? raw_value * time / (double)grey : 0;
        sums->n++;
        sums->difference += (double)d * scale;
        sums->squares += (double)d * (double)d * scale * scale;
        sums->measured += raw_value * time;
        sums->measured_squares += raw_value * time * raw_value * time;
    }
}

static void relight_rows(void *context, int band, int row_begin, int row_end)
{
    const relight_job *const job = context;
    weft_solve_samples *const all = &job->scratch[2 * (size_t)band], *const others = all + 1;
    for (int row = row_begin; row < row_end; row++) {
        weft_solve_row_in in[WEFT_LIGHTS_MAX];
        weft_light_plates_row(job->plates, row, in);
        for (int first = 0; first < job->plates->width; first += LANES) {
            const int left = job->plates->width - first, n = left < LANES ? left : LANES;
            float squares[LANES] = {0}, counts[LANES] = {0}, peak[LANES] = {0};
            weft_solve_gather(job->plan, row, first / LANES, in, all);
            for (int j = 0; j < all->n_lights; j++) {
                weft_solve_answers a;
                solve_without(job->plan, j, all, others, &a);
                judge_block(job, j, row, first, n, &in[j], all, &a, squares, counts, &job->sums[band][j]);
                for (int k = 0; k < n; k++)
                    peak[k] = fmaxf(peak[k], all->at[j].grey[k]);
            }
            for (int k = 0; k < n; k++)
                weft_image_row(job->map, 0, row)[first + k] =
                    counts[k] > 0 && peak[k] > 0 ? sqrtf(squares[k] / counts[k]) / peak[k] : 0;
        }
    }
}

static weft_err add_bands(const relight_job *job, int n_bands, weft_relight *to, weft_error *err)
{
    light_sums total = {0};
    for (int j = 0; j < to->n; j++) {
        light_sums s = {0};
        for (int b = 0; b < n_bands; b++) {
            const light_sums *const x = &job->sums[b][j];
            s.n += x->n;
            s.difference += x->difference;
            s.squares += x->squares;
            s.measured += x->measured;
            s.measured_squares += x->measured_squares;
        }
        if (!(s.n > 0) || !(s.measured > 0))
            return weft_fail(err, WEFT_ERR_NODATA,
                             "light %d cannot be judged: without it no pixel has three usable lights", j);
        to->rms[j] = sqrt(s.squares / s.n);
        to->relative[j] = sqrt(s.squares / s.measured_squares);
        to->bias[j] = s.difference / s.measured;
        total.n += s.n;
        total.squares += s.squares;
        total.measured_squares += s.measured_squares;
    }
    to->pixels = (size_t)(total.n / to->n);
    to->rms_all = sqrt(total.squares / total.n);
    to->relative_all = sqrt(total.squares / total.measured_squares);
    return WEFT_OK;
}

static weft_err judge_all(const weft_solve_plan *plan, const weft_light_plates *plates,
                          const weft_mask *inside, weft_relight *to, weft_error *err)
{
    const int n_bands = weft_parallel_n_bands(plates->height);
    relight_job job = {plan, plates, inside, NULL, NULL, &to->map};
    job.sums = weft_alloc((size_t)n_bands, sizeof *job.sums, err);
    job.scratch = weft_alloc((size_t)n_bands * 2, sizeof *job.scratch, err);
    weft_err status = job.sums && job.scratch ? WEFT_OK : WEFT_ERR_NOMEM;
    if (status == WEFT_OK)
        status = weft_parallel_rows_progress(plates->height, relight_rows, &job, "relighting", err);
    if (status == WEFT_OK)
        status = add_bands(&job, n_bands, to, err);
    weft_free(job.sums);
    weft_free(job.scratch);
    return status;
}

void weft_relight_fini(weft_relight *relight)
{
    weft_image_fini(&relight->map);
    *relight = (weft_relight){0};
}

weft_err weft_relight_set(const weft_set *set, const weft_calibration *cal, const char *cal_folder,
                          const weft_solve_options *options, weft_relight *relight, weft_error *err)
{
    const weft_pixel_scale pixel = weft_solve_pixel(options);
    weft_light_plates plates = {0};
    weft_incidence incidence = {0};
    weft_mask inside = {0};
    weft_relight to = {0};
    WEFT_TRY(weft_solve_check(set, cal, cal_folder, options, err));
    weft_err status =
        weft_light_plates_load(set, options->half ? WEFT_READ_HALF : WEFT_READ_SITES, &plates, err);
    if (status == WEFT_OK)
        weft_light_plates_know_noise(&plates, set, cal);
    if (status == WEFT_OK && set->mask_file && !options->half)
        status = weft_set_load_mask(set, &inside, err);
    if (status == WEFT_OK)
        status =
            weft_incidence_init(&incidence, cal, plates.width, plates.height, pixel, options->height_mm, err);
    if (status == WEFT_OK)
        status = weft_image_init(&to.map, plates.width, plates.height, 1, err);
    if (status == WEFT_OK) {
        const weft_solve_plan plan = {.incidence = &incidence,
                                      .method = options->method ? options->method : weft_solve_methods[0],
                                      .width = plates.width,
                                      .cfa = plates.cfa,
                                      .shadow = (float)options->shadow};
        to.n = plates.n;
        status = judge_all(&plan, &plates, &inside, &to, err);
    }
    weft_incidence_fini(&incidence);
    weft_mask_fini(&inside);
    weft_light_plates_fini(&plates);
    if (status != WEFT_OK) {
        weft_relight_fini(&to);
        return status == WEFT_ERR_CANCELLED ? status : weft_prefix(err, status, "%s", set->name);
    }
    *relight = to;
    return WEFT_OK;
}
