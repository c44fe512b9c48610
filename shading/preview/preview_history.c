#include "shading/preview/preview_history.h"

#include "core/parallel.h"
#include "shading/brdf/half_vector.h"
#include "shading/preview/preview_visibility.h"

#include <string.h>

void weft_preview_history_fini(weft_preview_history *history)
{
    weft_image_fini(&history->lit);
    weft_image_fini(&history->depth);
    *history = (weft_preview_history){0};
}

/* Unit vector to a lamp from the middle of the sample, whose frame the lamps are in. */
static void aim_of(const weft_preview_light *light, double aim[3])
{
    double length2 = 0;
    for (int c = 0; c < 3; c++) {
        aim[c] = light->kind == WEFT_PREVIEW_DISTANT ? light->direction[c]
                 : light->kind == WEFT_PREVIEW_TUBE  ? 0.5 * (light->position_mm[c] + light->end_mm[c])
                                                     : light->position_mm[c];
        length2 += aim[c] * aim[c];
    }
    for (int c = 0; c < 3; c++)
        aim[c] /= sqrt(weft_max(length2, 1e-30));
}

/* Whether the past is of the same buffer under the same lamps. */
static bool fits(const weft_preview_history *history, const weft_preview_setup *setup,
                 const weft_preview_visibility *vis)
{
    if (history->n_frames == 0 || history->depth.width != vis->depth.width ||
        history->depth.height != vis->depth.height || history->lit.planes != vis->lit.planes)
        return false;
    for (int k = 0; k < setup->view->n_lights; k++) {
        double aim[3], apart2 = 0;
        aim_of(&setup->view->lights[k], aim);
        for (int c = 0; c < 3; c++)
            apart2 += (aim[c] - history->aim[k][c]) * (aim[c] - history->aim[k][c]);
        if (2 * asin(fmin(1, 0.5 * sqrt(apart2))) > WEFT_HISTORY_TURN * WEFT_PI / 180)
            return false;
    }
    return true;
}

/* Where the frame before had a place of the sample (map texels from its middle): pixels of the buffer, and
 * its depth there. */
static void project(const weft_preview_setup *setup, const weft_preview_history *before, int scale,
                    const double place[3], double at[2], double *depth)
{
    const bool plane = setup->view->shape == WEFT_PREVIEW_PLANE;
    const double c = before->turn_cos, s = before->turn_sin, d = setup->eye_distance;
    const double x = plane ? c * place[0] - s * place[1] : c * place[0] + s * place[2];
    const double y = plane ? s * place[0] + c * place[1] : place[1];
    const double z = plane ? place[2] : c * place[2] - s * place[0];
    double px_per_texel = 1 / setup->texels_per_px;
    if (!plane && d > 0) /* the ball's perspective: n.x/(d - n.z) over the tangent of its outline */
        px_per_texel *= sqrt(d * d - 1) / (d - z / setup->radius_texels);
    at[0] = (x * px_per_texel + setup->view->width / 2.0) * scale - 0.5;
    at[1] = (setup->view->height / 2.0 - y * px_per_texel) * scale - 0.5;
    *depth = z;
}

typedef struct blend_job {
    const weft_preview_setup *setup;
    const weft_preview_history *before;
    weft_preview_visibility *visibility;
    double share, deepest;
} blend_job;

static void blend_place(const blend_job *job, const weft_preview_samples *s, int i, int column, int row)
{
    weft_preview_visibility *const vis = job->visibility;
    const weft_preview_history *const before = job->before;
    double place[3], at[2], depth, now = 0;
    weft_preview_place(job->setup, s, i, place);
    project(job->setup, before, vis->scale, place, at, &depth);
    for (int c = 0; c < 3; c++)
        now += (double)s->eye[c][i] * place[c];
    /* the relief lifts a place as much as before: what it adds to the depth now is added there, too */
    const double wanted = depth + (double)weft_image_row(&vis->depth, 0, row)[column] - now;
    const double was = (double)weft_image_sample(&before->depth, 0, at[0], at[1]);
    if (at[0] < -0.5 || at[1] < -0.5 || at[0] > vis->depth.width - 0.5 || at[1] > vis->depth.height - 0.5 ||
        !(fabs(was - wanted) < job->deepest)) /* NaN: it was beside the sample, or is */
        return;
    for (int k = 0; k < vis->lit.planes; k++) {
        float *const lit = &weft_image_row(&vis->lit, k, row)[column];
        const double past = (double)weft_image_sample(&before->lit, k, at[0], at[1]);
        if (fabs(past - (double)*lit) < WEFT_HISTORY_LIGHT)
            *lit = (float)((double)*lit + job->share * (past - (double)*lit));
    }
}

static void blend_rows(void *context, int band, int row_begin, int row_end)
{
    const blend_job *const job = context;
    weft_preview_samples s = {0};
    (void)band;
    for (int row = row_begin; row < row_end; row++)
        for (int first = 0; first < job->visibility->depth.width; first += WEFT_PREVIEW_RUN) {
            weft_preview_visibility_hit(job->setup, job->visibility, first, row, &s);
            for (int i = 0; i < s.n; i++)
                if (s.hit[i] > 0)
                    blend_place(job, &s, i, first + i, row);
        }
}

static weft_err remember(weft_preview_history *history, const weft_preview_setup *setup,
                         const weft_preview_visibility *vis, weft_error *err)
{
    weft_image lit = {0}, depth = {0};
    weft_err status = weft_image_copy(&lit, &vis->lit, err);
    if (status == WEFT_OK)
        status = weft_image_copy(&depth, &vis->depth, err);
    if (status != WEFT_OK) {
        weft_image_fini(&lit);
        return status;
    }
    weft_image_fini(&history->lit);
    weft_image_fini(&history->depth);
    history->lit = lit;
    history->depth = depth;
    history->turn_cos = setup->turn_cos;
    history->turn_sin = setup->turn_sin;
    for (int k = 0; k < setup->view->n_lights; k++)
        aim_of(&setup->view->lights[k], history->aim[k]);
    history->n_frames++;
    return WEFT_OK;
}

weft_err weft_preview_history_add(weft_preview_history *history, const weft_preview_setup *setup,
                                  weft_preview_visibility *visibility, weft_error *err)
{
    if (!fits(history, setup, visibility))
        history->n_frames = 0;
    const double k = history->n_frames;
    const double distance =
        setup->view->shape == WEFT_PREVIEW_PLANE
            ? (setup->crop.width < setup->crop.height ? setup->crop.width : setup->crop.height)
            : 2 * setup->radius_texels;
    const blend_job job = {setup, history, visibility, fmin(WEFT_HISTORY_SHARE, k / (k + 1)),
                           WEFT_HISTORY_DEPTH * distance};
    if (k > 0)
        weft_parallel_rows(visibility->depth.height, blend_rows, (void *)&job);
    return remember(history, setup, visibility, err);
}
