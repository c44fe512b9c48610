/* Lint: what is darker or brighter than the cloth and too thin for a yarn. */
#include "core/parallel.h"
#include "core/progress.h"
#include "host/solve/flaw_search.h"
#include "host/solve/running_mean.h"

#include <math.h>
#include <string.h>

/* Thinner than this is lint, thicker a yarn. */
static const double lint_mm = 0.5;
/* Least contrast, relative to the cloth around, and in units of what the cloth itself has. */
static const float lint_contrast = 0.12F, lint_usual = 3;

/* Least (sign 1) or greatest (-1) of the neighbours: along the rows from `from` to `between`, then across
 * them to `to`; whole rows at a time, so that memory is read in order. */
typedef struct reach_job {
    const weft_image *from;
    weft_image *to;
    int reach;
    float sign;
} reach_job;

static void lower(float *restrict to, const float *restrict from, float sign, int n)
{
    for (int i = 0; i < n; i++) {
        const float x = sign * from[i], now = sign * to[i];
        to[i] = sign * (x < now ? x : now);
    }
}

static void reach_along(void *context, int band, int row_begin, int row_end)
{
    const reach_job *const job = context;
    const int w = job->from->width;
    (void)band;
    for (int v = row_begin; v < row_end; v++) {
        const float *const from = weft_image_row(job->from, 0, v);
        float *const to = weft_image_row(job->to, 0, v);
        memcpy(to, from, (size_t)w * sizeof *to);
        for (int k = 1; k <= job->reach && k < w; k++) {
            lower(to, from + k, job->sign, w - k);
            lower(to + k, from, job->sign, w - k);
        }
    }
}

static void reach_across(void *context, int band, int row_begin, int row_end)
{
    const reach_job *const job = context;
    const int w = job->from->width, h = job->from->height;
    (void)band;
    for (int v = row_begin; v < row_end; v++) {
        float *const to = weft_image_row(job->to, 0, v);
        memcpy(to, weft_image_row(job->from, 0, v), (size_t)w * sizeof *to);
        for (int k = v - job->reach < 0 ? 0 : v - job->reach; k <= v + job->reach && k < h; k++)
            lower(to, weft_image_row(job->from, 0, k), job->sign, w);
    }
}

static void reach_square(const weft_image *from, int reach, float sign, weft_image *between, weft_image *to)
{
    reach_job along = {from, between, reach, sign}, across = {between, to, reach, sign};
    weft_parallel_rows(from->height, reach_along, &along);
    weft_parallel_rows(from->height, reach_across, &across);
}

/* One colour, and how much of the surroundings is cloth. */
static void fill_colour(const weft_flaw_search *s, int c, weft_image *colour, weft_image *around)
{
    const size_t n = weft_image_plane_size(colour);
    const float *const from = weft_image_plane(&s->maps->albedo, c);
    for (size_t i = 0; i < n; i++) {
        const bool use = s->cloth->data[i];
        colour->data[i] = around->data[i] = use ? from[i] : 0;
        around->data[n + i] = use ? 1 : 0;
    }
}

typedef struct lint_images {
    weft_image colour, around, between, opened;
} lint_images;

static weft_err make_lint_images(lint_images *to, int width, int height, weft_error *err)
{
    WEFT_TRY(weft_image_init(&to->colour, width, height, 1, err));
    WEFT_TRY(weft_image_init(&to->around, width, height, 2, err));
    WEFT_TRY(weft_image_init(&to->between, width, height, 1, err));
    return weft_image_init(&to->opened, width, height, 1, err);
}

/* Brighter than what a square of lint_mm fits into (sign 1: opening), or darker (-1: closing), relative to
 * the mean around; of the three colours the most. */
static weft_err find_contrast(const weft_flaw_search *s, float sign, lint_images *im, weft_image *contrast,
                              weft_error *err)
{
    const int reach = (int)fmax(2, round(lint_mm / 2 / s->maps->mm_per_px));
    const size_t n = weft_image_plane_size(contrast);
    for (int c = 0; c < 3; c++) {
        if (weft_cancelled())
            return weft_fail(err, WEFT_ERR_CANCELLED, "cancelled");
        fill_colour(s, c, &im->colour, &im->around);
        WEFT_TRY(weft_running_mean(&im->around, 4 * reach, 1, err));
        reach_square(&im->colour, reach, sign, &im->between, &im->opened);
        reach_square(&im->opened, reach, -sign, &im->between, &im->opened);
        for (size_t i = 0; i < n; i++) {
            const float weight = im->around.data[n + i];
            if (!s->cloth->data[i] || weight < 0.9F)
                continue;
            const float mean = fmaxf(im->around.data[i] / weight, 0.02F);
            contrast->data[i] =
                fmaxf(contrast->data[i], sign * (im->colour.data[i] - im->opened.data[i]) / mean);
        }
    }
    return WEFT_OK;
}

weft_err weft_flaw_find_lint(weft_flaw_search *s, float sign, weft_error *err)
{
    lint_images images = {0};
    weft_image contrast;
    float usual = 0;
    WEFT_TRY(weft_image_init(&contrast, s->maps->width, s->maps->height, 1, err));
    weft_err status = make_lint_images(&images, s->maps->width, s->maps->height, err);
    if (status == WEFT_OK)
        status = find_contrast(s, sign, &images, &contrast, err);
    weft_image_fini(&images.colour);
    weft_image_fini(&images.around);
    weft_image_fini(&images.between);
    weft_image_fini(&images.opened);
    if (status == WEFT_OK)
        status = weft_flaw_quantile(&contrast, s->cloth, 0.98, &usual, err);
    if (status == WEFT_OK) {
        const float strong = fmaxf(lint_contrast, lint_usual * usual);
        weft_flaw_mark(&contrast, strong, strong / 2, &s->marks);
        s->least_mm = 2;
        s->widest_mm = lint_mm;
        status = weft_components_keep(&s->marks, weft_flaw_keep, s, err);
    }
    weft_image_fini(&contrast);
    return status;
}
