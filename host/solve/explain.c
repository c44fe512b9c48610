#include "host/solve/explain.h"

#include "calibration/lens/lens_model.h"
#include "core/mem.h"
#include "host/solve/cloth_gloss.h"
#include "host/solve/light_plates.h"
#include "host/solve/rectify.h"
#include "host/solve/solve_mask.h"
#include "host/solve/strip.h"

#include <math.h>
#include <string.h>

enum { LANES = WEFT_SOLVE_LANES };

/* Of the brightest sample: far above rounding, far below a sigma. */
static const double nudge = 2e-4;
static const double degrees = 57.29577951308232;

const char *weft_explain_why_name(weft_explain_why why)
{
    static const char *const names[] = {"used",    "saturated", "black: below the noise",
                                        "not lit", "shadow",    "contradicts the others"};
    return names[why];
}

/* ---- which photosite ---- */

static weft_err outside(int width, int height, const weft_explanation *e, weft_error *err)
{
    return weft_fail(err, WEFT_ERR_RANGE, "pixel %d,%d is outside: the maps are %d x %d (%s)", e->x, e->y,
                     width, height,
                     e->plane ? "of the plane; --geometry sensor counts the sensor's pixels" : "sensor");
}

static weft_err find_on_plane(const weft_calibration *cal, const weft_solve_options *options,
                              weft_pixel_scale pixel, weft_explanation *e, weft_error *err)
{
    weft_plane_grid grid;
    double u, v;
    WEFT_TRY(weft_plane_grid_choose(&grid, &cal->camera, pixel, options->mm_per_px, options->height_mm, err));
    e->mm_per_px = grid.mm_per_px;
    if (e->x < 0 || e->y < 0 || e->x >= grid.width || e->y >= grid.height)
        return outside(grid.width, grid.height, e, err);
    const weft_vec3 world = {(e->x - (grid.width - 1) / 2.0) * grid.mm_per_px,
                             ((grid.height - 1) / 2.0 - e->y) * grid.mm_per_px, options->height_mm};
    if (!weft_camera_project(&cal->camera, world, &u, &v))
        return weft_fail(err, WEFT_ERR_RANGE, "pixel %d,%d of the plane is not seen by the camera", e->x,
                         e->y);
    e->column = (int)lround((u - pixel.offset) / pixel.scale);
    e->row = (int)lround((v - pixel.offset) / pixel.scale);
    return WEFT_OK;
}

static weft_err find_pixel(const weft_set *set, const weft_calibration *cal,
                           const weft_solve_options *options, weft_pixel_scale pixel, weft_explanation *e,
                           weft_error *err)
{
    const int width = options->half ? set->width / 2 : set->width;
    const int height = options->half ? set->height / 2 : set->height;
    weft_vec3 world;
    e->plane = cal->has_camera && cal->camera.has_pose && !options->sensor_geometry;
    e->column = e->x;
    e->row = e->y;
    if (e->plane)
        WEFT_TRY(find_on_plane(cal, options, pixel, e, err));
    if (e->column < 0 || e->row < 0 || e->column >= width || e->row >= height)
        return e->plane ? weft_fail(err, WEFT_ERR_RANGE,
                                    "pixel %d,%d of the plane is not in the camera's picture", e->x, e->y)
                        : outside(width, height, e, err);
    e->has_world = cal->has_camera && cal->camera.has_pose &&
                   weft_camera_to_plane(&cal->camera, e->column * pixel.scale + pixel.offset,
                                        e->row * pixel.scale + pixel.offset, options->height_mm, &world);
    if (e->has_world) {
        e->world_mm[0] = world.x;
        e->world_mm[1] = world.y;
    }
    return WEFT_OK;
}

/* ---- what the method makes of it ---- */

/* One pixel in all lanes. */
static void spread_lane(const weft_solve_samples *from, int k, weft_solve_samples *to)
{
    to->n_lights = from->n_lights;
    to->n_channels = from->n_channels;
    to->gloss = from->gloss;
    for (int q = 0; q < LANES; q++) {
        for (int c = 0; c < 3; c++)
            to->view[c][q] = from->view[c][k];
        to->clipped[q] = from->clipped[k];
        to->dark[q] = from->dark[k];
        for (int j = 0; j < from->n_lights; j++) {
            for (int c = 0; c < 3; c++) {
                to->at[j].light[c][q] = from->at[j].light[c][k];
                to->at[j].value[c][q] = c < from->n_channels ? from->at[j].value[c][k] : 0;
            }
            to->at[j].grey[q] = from->at[j].grey[k];
            to->at[j].weight[q] = from->at[j].weight[k];
            to->at[j].variance[q] = from->at[j].variance[k];
        }
    }
}

static double grey_albedo(const weft_solve_samples *s, const weft_solve_answers *a, int q)
{
    return s->n_channels == 1 ? (double)a->albedo[0][q]
                              : 0.2126 * (double)a->albedo[0][q] + 0.7152 * (double)a->albedo[1][q] +
                                    0.0722 * (double)a->albedo[2][q];
}

static void answer(const weft_solve_method *method, bool search, const weft_solve_samples *s,
                   weft_solve_answers *a)
{
    if (search)
        method->search(s, a);
    else
        method->solve(s, a);
}

/* Length of the change of k n, and the angle of the change of n. */
static void compare_lanes(const weft_solve_samples *s, const weft_solve_answers *base,
                          const weft_solve_answers *moved, int q, double *change, double *turn_rad)
{
    double squares = 0, chord = 0;
    for (int c = 0; c < 3; c++) {
        const double a = (double)base->normal[c][0], b = (double)moved->normal[c][q];
        squares += pow(grey_albedo(s, moved, q) * b - grey_albedo(s, base, 0) * a, 2);
        chord += (b - a) * (b - a);
    }
    *change = sqrt(squares);
    *turn_rad = sqrt(chord);
}

/* Moves one sample after the other, sixteen at a time. */
static void measure_influence(const weft_solve_method *method, bool search, const weft_solve_samples *base,
                              const weft_solve_answers *answers, double peak, weft_solve_samples *scratch,
                              weft_explanation *e, double change[WEFT_LIGHTS_MAX])
{
    const float step = (float)(nudge * peak);
    for (int first = 0; first < base->n_lights; first += LANES) {
        weft_solve_answers moved;
        spread_lane(base, 0, scratch);
        for (int j = first; j < base->n_lights && j < first + LANES; j++) {
            if (!(base->at[j].weight[0] > 0))
                continue;
            scratch->at[j].grey[j - first] += step;
            for (int c = 0; c < base->n_channels; c++)
                scratch->at[j].value[c][j - first] += step;
        }
        answer(method, search, scratch, &moved);
        for (int j = first; j < base->n_lights && j < first + LANES; j++) {
            double turn;
            compare_lanes(base, answers, &moved, j - first, &change[j], &turn);
            if (!(base->at[j].weight[0] > 0))
                change[j] = turn = 0;
            e->lights[j].influence_deg = turn * degrees * 0.01 / nudge;
        }
    }
}

/* The n_used samples that move the answer most are those that it rests on. */
static void mark_used(const double change[WEFT_LIGHTS_MAX], weft_explanation *e)
{
    for (int n = 0; n < e->n_used; n++) {
        int most = -1;
        for (int j = 0; j < e->n_lights; j++)
            if (e->lights[j].why != WEFT_EXPLAIN_USED && change[j] > 0 &&
                (most < 0 || change[j] > change[most]))
                most = j;
        if (most < 0)
            return;
        e->lights[most].why = WEFT_EXPLAIN_USED;
    }
}

/* ---- why a sample is left out ---- */

static weft_explain_why why_left_out(const weft_solve_row_in *in, int column, const weft_solve_samples *s,
                                     int j, double peak, const weft_solve_plan *plan)
{
    const float most = fmaxf(in->rgb[0][column], fmaxf(in->rgb[1][column], in->rgb[2][column]));
    if (!(s->at[j].weight[0] > 0)) {
        if ((in->clipped && in->clipped[column]) || (in->most > 0 && most > in->most))
            return WEFT_EXPLAIN_CLIPPED;
        if (most < in->least)
            return WEFT_EXPLAIN_BLACK;
        return plan->shadow > 0 && isfinite(most) ? WEFT_EXPLAIN_SHADOW : WEFT_EXPLAIN_UNLIT;
    }
    return (double)s->at[j].grey[0] < (double)WEFT_SOLVE_SHADOW * peak ? WEFT_EXPLAIN_SHADOW
                                                                       : WEFT_EXPLAIN_CONTRADICTS;
}

static double peak_of(const weft_solve_samples *s)
{
    double peak = 0;
    for (int j = 0; j < s->n_lights; j++)
        peak = fmax(peak, (double)s->at[j].grey[0]);
    return peak;
}

static void fill_light(const weft_light_plates *plates, const weft_solve_samples *s,
                       const weft_solve_samples *matte, const weft_solve_row_in *in, double peak, int j,
                       weft_explanation *e, double k)
{
    weft_explained_light *const l = &e->lights[j];
    const float raw = fmaxf(in->rgb[0][e->column], fmaxf(in->rgb[1][e->column], in->rgb[2][e->column]));
    const double tolerance = (double)WEFT_SOLVE_MISFIT * peak;
    double cosine = 0;
    for (int c = 0; c < 3; c++) {
        l->direction[c] = (double)s->at[j].light[c][0];
        cosine += l->direction[c] * e->normal[c];
    }
    l->full_scale = plates->most[j] > 0 ? WEFT_SATURATION_SHARE * (double)raw / plates->most[j] : 0;
    l->value = (double)s->at[j].grey[0];
    l->mirror = matte ? l->value - (double)matte->at[j].grey[0] : 0;
    l->fit = k * cosine;
    l->sigma = sqrt((double)s->at[j].variance[0] + tolerance * tolerance);
}

static void fill_answer(const weft_solve_samples *s, const weft_solve_answers *a, weft_explanation *e)
{
    e->valid = a->valid[0] > 0;
    for (int c = 0; c < 3; c++) {
        e->normal[c] = (double)a->normal[c][0];
        e->albedo[c] = c < s->n_channels ? (double)a->albedo[c][0] : 0;
    }
    e->residual = (double)a->residual[0];
    e->confidence = (double)a->confidence[0];
    e->uncertainty_deg = degrees * (double)a->angle[0];
    e->n_used = e->valid ? (int)lroundf(a->n_used[0]) : 0;
    e->quality = a->quality[0];
}

typedef struct workspace {
    weft_solve_samples block, base, scratch;
} workspace;

static void explain_samples(const weft_solve_plan *plan, const weft_light_plates *plates, workspace *w,
                            weft_explanation *e)
{
    weft_solve_row_in in[WEFT_LIGHTS_MAX];
    weft_solve_answers a;
    double change[WEFT_LIGHTS_MAX] = {0};
    weft_light_plates_row(plates, e->row, in);
    weft_solve_gather(plan, e->row, e->column / LANES, in, &w->block);
    spread_lane(&w->block, e->column % LANES, &w->base);
    const double peak = peak_of(&w->base);
    answer(plan->method, false, &w->base, &a);
    e->searched = plan->method->search && a.search[0] > 0;
    if (e->searched)
        answer(plan->method, true, &w->base, &a);
    fill_answer(&w->base, &a, e);
    e->n_lights = w->base.n_lights;
    for (int j = 0; j < e->n_lights; j++)
        e->lights[j].why = why_left_out(&in[j], e->column, &w->base, j, peak, plan);
    if (e->valid)
        measure_influence(plan->method, e->searched, &w->base, &a, peak, &w->scratch, e, change);
    mark_used(change, e);
    if (e->glossy) { /* the method takes the same off */
        weft_lane_weights kept[WEFT_LIGHTS_MAX];
        float cost[LANES];
        weft_gloss_solve(&w->base, &w->scratch, kept, cost);
    }
    for (int j = 0; j < e->n_lights; j++)
        fill_light(plates, &w->base, e->glossy ? &w->scratch : NULL, &in[j], peak, j, e,
                   grey_albedo(&w->base, &a, 0));
}

/* ---- the set around it ---- */

static weft_err explain_with(const weft_set *set, const weft_calibration *cal,
                             const weft_solve_options *options, weft_pixel_scale pixel,
                             const weft_light_plates *plates, const weft_mask *inside, workspace *w,
                             weft_explanation *e, weft_error *err)
{
    weft_calibration drifted = *cal;
    weft_strip_drift drift;
    bool has_strip;
    weft_incidence incidence;
    weft_gloss_report report = {0};
    WEFT_TRY(weft_strip_follow(set, plates, pixel, &drifted, &drift, &has_strip, err));
    WEFT_TRY(weft_incidence_init(&incidence, &drifted, plates->width, plates->height, pixel,
                                 options->height_mm, err));
    weft_solve_plan plan = {.incidence = &incidence,
                            .method = options->method ? options->method : weft_solve_methods[0],
                            .width = plates->width,
                            .cfa = plates->cfa,
                            .shadow = (float)options->shadow};
    weft_err status = WEFT_OK;
    if (plan.method->takes_gloss && !options->matte)
        status = weft_cloth_gloss(&plan, plates, inside, &e->gloss, &report, err);
    if (status == WEFT_OK) {
        e->method = plan.method->name;
        e->glossy = report.found;
        plan.gloss = e->glossy ? &e->gloss : NULL;
        e->colour = plates->cfa == WEFT_CFA_NONE ? -1 : weft_cfa_colour(plates->cfa, e->column, e->row);
        explain_samples(&plan, plates, w, e);
    }
    weft_incidence_fini(&incidence);
    return status;
}

weft_err weft_solve_explain(const weft_set *set, const weft_calibration *cal, const char *cal_folder,
                            const weft_solve_options *options, int x, int y, weft_explanation *explanation,
                            weft_error *err)
{
    const weft_pixel_scale pixel = weft_solve_pixel(options);
    weft_light_plates plates = {0};
    weft_explanation e = {.x = x, .y = y};
    WEFT_TRY(weft_solve_check(set, cal, cal_folder, options, err));
    WEFT_TRY(find_pixel(set, cal, options, pixel, &e, err));
    weft_mask inside = {0};
    weft_err status = weft_solve_load_mask(set, options->half, &inside, err);
    if (status != WEFT_OK) {
        weft_mask_fini(&inside);
        return status;
    }
    e.inside = !inside.data || inside.data[(size_t)e.row * (size_t)inside.width + (size_t)e.column];
    workspace *const w = weft_alloc(1, sizeof *w, err);
    const weft_light_reading reading = options->half     ? WEFT_READ_HALF
                                       : options->linear ? WEFT_READ_LINEAR
                                                         : WEFT_READ_SITES;
    status = w ? weft_light_plates_load(set, reading, &plates, err) : WEFT_ERR_NOMEM;
    if (status == WEFT_OK) {
        weft_light_plates_know_noise(&plates, set, cal);
        status = explain_with(set, cal, options, pixel, &plates, &inside, w, &e, err);
    }
    weft_light_plates_fini(&plates);
    weft_mask_fini(&inside);
    weft_free(w);
    if (status == WEFT_OK)
        *explanation = e;
    return status;
}
