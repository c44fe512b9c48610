#include "host/solve/solve.h"

#include "core/log.h"
#include "core/mem_limit.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "host/solve/albedo_gamut.h"
#include "host/solve/cloth_gloss.h"
#include "host/solve/info.h"
#include "host/solve/light_plates.h"
#include "host/solve/rectify.h"
#include "host/solve/refuse.h"
#include "host/solve/seams.h"
#include "host/solve/site_albedo.h"
#include "host/solve/solve_mask.h"
#include "host/solve/solve_row.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

weft_err weft_solve_find_method(const char *name, const weft_solve_method **method, weft_error *err)
{
    char known[256] = "";
    for (int i = 0; weft_solve_methods[i]; i++) {
        const weft_solve_method *const m = weft_solve_methods[i];
        if (strcmp(m->name, name) == 0) {
            *method = m;
            return WEFT_OK;
        }
        const size_t used = strlen(known);
        snprintf(known + used, sizeof known - used, "%s%s", used ? ", " : "", m->name);
    }
    return weft_fail(err, WEFT_ERR_USAGE, "there is no method \"%s\" (there are: %s)", name, known);
}

static bool has_near_light(const weft_calibration *cal)
{
    for (int j = 0; j < cal->n_lights; j++)
        if (!cal->lights[j].distant)
            return true;
    return false;
}

/* What cannot be kept in files: the program, and what LibRaw and we make of one frame. */
static double bytes_needed(const weft_set *set)
{
    return WEFT_MEM_LEAST_LIMIT + 6.0 * set->width * set->height;
}

static weft_err require_memory(const weft_set *set, const weft_solve_options *options, weft_error *err)
{
    const double needed = bytes_needed(set);
    if (!(options->memory_bytes > 0) || needed <= options->memory_bytes)
        return WEFT_OK;
    return weft_fail(err, WEFT_ERR_NOMEM,
                     "%s: frames of %d x %d pixels need %.2f GiB, %.2f are allowed (give --memory %.2f)",
                     set->folder, set->width, set->height, needed / 1073741824.0,
                     options->memory_bytes / 1073741824.0, ceil(needed / 10737418.24) / 100);
}

static bool goes_to_plane(const weft_calibration *cal, const weft_solve_options *options)
{
    return cal->has_camera && cal->camera.has_pose && !options->sensor_geometry;
}

weft_err weft_solve_check(const weft_set *set, const weft_calibration *cal, const char *cal_folder,
                          const weft_solve_options *options, weft_error *err)
{
    const unsigned pose = WEFT_CALIBRATION_CAMERA | WEFT_CALIBRATION_POSE;
    WEFT_TRY(weft_set_require_lights(set, err));
    WEFT_TRY(weft_calibration_require(cal, WEFT_CALIBRATION_LIGHTS, cal_folder, err));
    if (options->plane_geometry || has_near_light(cal))
        WEFT_TRY(weft_calibration_require(cal, pose, cal_folder, err));
    const int n = weft_set_n_lights(set);
    if (n != cal->n_lights)
        return weft_fail(err, WEFT_ERR_MISMATCH,
                         "%s has %d lights but the calibration %s has %d (use the calibration of the scanner "
                         "that took the set)",
                         set->folder, n, cal_folder, cal->n_lights);
    if (cal->has_camera)
        WEFT_TRY(weft_calibration_require_size(cal, set->width, set->height, cal_folder, err));
    if (goes_to_plane(cal, options))
        WEFT_TRY(weft_plane_grid_choose(&(weft_plane_grid){0}, &cal->camera, weft_solve_pixel(options),
                                        options->mm_per_px, options->height_mm, err));
    WEFT_TRY(require_memory(set, options, err));
    return weft_refuse_cone(cal, cal_folder, options->height_mm, err);
}

/* ---- solving ---- */

typedef struct solve_job {
    const weft_solve_plan *plan;
    weft_light_plates *plates; /* freed once all is solved */
    const weft_mask *inside;   /* at solving size; data NULL: everywhere */
    const weft_calibration *cal;
    weft_maps *maps;
} solve_job;

static void solve_rows(void *context, int band, int row_begin, int row_end)
{
    const solve_job *const job = context;
    weft_maps *const m = job->maps;
    (void)band;
    for (int row = row_begin; row < row_end; row++) {
        const size_t at = (size_t)row * (size_t)m->width;
        weft_solve_row_in in[WEFT_LIGHTS_MAX];
        weft_solve_row_out out = {.residual = weft_image_row(&m->residual, 0, row),
                                  .confidence = weft_image_row(&m->confidence, 0, row),
                                  .angle = weft_image_row(&m->uncertainty, 0, row),
                                  .lights = m->lights.data + at,
                                  .quality = m->quality.data + at,
                                  .valid = m->mask.data + at};
        for (int c = 0; c < 3; c++) {
            out.normal[c] = weft_image_row(&m->normal, c, row);
            out.albedo[c] = weft_image_row(&m->albedo, c, row);
        }
        weft_light_plates_row(job->plates, row, in);
        weft_solve_row(job->plan, row, in, &out);
    }
}

static const float degrees = 57.2957795F;

/* Colour, and nothing where the set's mask or the solver has no answer: of `n` pixels of a row. */
static void finish_part(void *context, int row, int first, int n)
{
    const solve_job *const job = context;
    weft_maps *const m = job->maps;
    const size_t at = (size_t)row * (size_t)m->width + (size_t)first;
    uint8_t *const answered = m->mask.data + at;
    float *const rgb[3] = {weft_image_plane(&m->albedo, 0) + at, weft_image_plane(&m->albedo, 1) + at,
                           weft_image_plane(&m->albedo, 2) + at};
    if (job->cal->has_colour)
        weft_colour_model_apply_row(&job->cal->colour.model, rgb, n);
    for (int i = 0; job->inside->data && i < n; i++)
        answered[i] &= job->inside->data[at + (size_t)i] ? 255 : 0;
    for (int i = 0; i < n; i++)
        m->uncertainty.data[at + (size_t)i] *= degrees;
    const uint8_t *hole = memchr(answered, 0, (size_t)n);
    for (; hole; hole = memchr(hole + 1, 0, (size_t)(answered + n - hole - 1))) {
        const size_t i = (size_t)(hole - answered);
        for (int c = 0; c < 3; c++)
            weft_image_plane(&m->normal, c)[at + i] = rgb[c][i] = 0;
        m->residual.data[at + i] = m->confidence.data[at + i] = m->uncertainty.data[at + i] = 0;
        m->lights.data[at + i] = 0;
    }
}

static void finish_rows(void *context, int band, int row_begin, int row_end)
{
    const solve_job *const job = context;
    (void)band;
    for (int row = row_begin; row < row_end; row++)
        finish_part(context, row, 0, job->maps->width);
}

/* Light from yarn to yarn needs to know how large a pixel is: distant lights come without a camera. */
static weft_err take_off_bounce(solve_job *job, const weft_solve_options *options, weft_pixel_scale pixel,
                                weft_solve_run *run, weft_error *err)
{
    double mm_per_px;
    const double begun = weft_clock_s();
    if (!job->plan->method->takes_bounce || options->no_bounce || !job->cal->has_camera ||
        !job->cal->camera.has_pose)
        return WEFT_OK;
    WEFT_TRY(weft_plane_scale(&job->cal->camera, pixel, options->height_mm, &mm_per_px, err));
    WEFT_TRY(weft_bounce_take_off(job->maps, job->plan->cfa, mm_per_px, &run->bounce, err));
    run->seconds.bounce = weft_clock_s() - begun;
    if (run->bounce.done)
        weft_explain("bounce: relief %.3f mm rms, %.1f %% of the sky is open", run->bounce.relief_mm,
                     100 * run->bounce.openness);
    return WEFT_OK;
}

static weft_err solve_all_rows(solve_job *job, const weft_solve_options *options, weft_pixel_scale pixel,
                               weft_solve_run *run, weft_error *err)
{
    const int height = job->maps->height;
    WEFT_TRY(weft_parallel_rows_progress(height, solve_rows, job, "solving", err));
    weft_light_plates_fini(job->plates); /* most of the memory; what follows needs some */
    WEFT_TRY(take_off_bounce(job, options, pixel, run, err));
    if (job->plan->cfa != WEFT_CFA_NONE)
        WEFT_TRY(weft_site_albedo_finish(job->maps, job->plan->cfa, finish_part, job, err));
    else
        weft_parallel_rows(height, finish_rows, job);
    weft_seams_doubt(job->maps);
    job->maps->albedo_is_srgb = job->cal->has_colour;
    return WEFT_OK;
}

/* ---- maps ---- */

static weft_err make_maps(weft_maps *maps, int width, int height, weft_error *err)
{
    *maps = (weft_maps){.width = width, .height = height, .geometry = WEFT_GEOMETRY_SENSOR};
    WEFT_TRY(weft_image_init(&maps->normal, width, height, 3, err));
    WEFT_TRY(weft_image_init(&maps->albedo, width, height, 3, err));
    WEFT_TRY(weft_image_init(&maps->residual, width, height, 1, err));
    WEFT_TRY(weft_image_init(&maps->confidence, width, height, 1, err));
    WEFT_TRY(weft_image_init(&maps->uncertainty, width, height, 1, err));
    WEFT_TRY(weft_mask_init(&maps->lights, width, height, 0, err));
    WEFT_TRY(weft_mask_init(&maps->quality, width, height, 0, err));
    return weft_mask_init(&maps->mask, width, height, 0, err);
}

static void explain_gloss(const weft_gloss_report *report, const weft_gloss *gloss)
{
    if (report->n_pixels > 0)
        weft_explain("gloss: chi^2 of %d pixels %.3f matte, %.3f with a lobe%s", report->n_pixels,
                     report->matte, report->glossy, report->found ? "" : ": taken as matte");
    if (gloss)
        weft_explain(
            "gloss: strength %.4f, alpha %.3f along and %.3f across the fibres, which run %.1f degrees "
            "from +x or across that",
            (double)gloss->strength, (double)gloss->alpha_along, (double)gloss->alpha_across,
            57.29577951308232 * atan2((double)gloss->fibre[0][1], (double)gloss->fibre[0][0]));
}

/* Takes the lamps' drift since the calibration from the white strip, where the set has one. */
static weft_err follow_drift(const weft_set *set, const weft_light_plates *plates, weft_pixel_scale pixel,
                             weft_calibration *cal, weft_solve_run *run, weft_error *err)
{
    bool present;
    double least = 1, most = 1;
    WEFT_TRY(weft_strip_follow(set, plates, pixel, cal, &run->drift, &present, err));
    if (!present)
        return WEFT_OK;
    run->n_drift = plates->n;
    for (int j = 0; j < plates->n; j++) {
        least = fmin(least, run->drift.gain[j][1]);
        most = fmax(most, run->drift.gain[j][1]);
    }
    weft_explain("white strip: the lights give %.4f to %.4f of what they were calibrated with (+- %.4f)",
                 least, most, run->drift.sigma);
    return WEFT_OK;
}

static weft_err require_answers(const weft_maps *maps, const weft_mask *inside, const weft_set *set,
                                weft_error *err)
{
    const size_t n = (size_t)maps->width * (size_t)maps->height;
    for (size_t i = 0; i < n; i++)
        if (maps->mask.data[i])
            return weft_refuse_few_lights(set, &maps->lights, inside, err);
    return weft_fail(err, WEFT_ERR_NODATA,
                     "%s: no pixel has three usable lights (all clipped, black, or masked: look at the "
                     "exposure of its frames)",
                     set->folder);
}

/* All at sensor geometry. */
static weft_err solve_on_sensor(const weft_set *set, const weft_calibration *cal,
                                const weft_solve_options *options, weft_pixel_scale pixel, weft_maps *maps,
                                weft_solve_run *run, weft_error *err)
{
    weft_light_plates plates = {0};
    weft_mask inside = {0};
    weft_incidence incidence = {0};
    weft_calibration drifted = *cal; /* its numbers; what it points to stays cal's */
    double clock = weft_clock_s();
    weft_err status = weft_solve_load_mask(set, options->half, &inside, err);
    if (status == WEFT_OK)
        status = weft_light_plates_load(set,
                                        options->half     ? WEFT_READ_HALF
                                        : options->linear ? WEFT_READ_LINEAR
                                                          : WEFT_READ_SITES,
                                        &plates, err);
    run->seconds.read = weft_clock_s() - clock;
    clock = weft_clock_s();
    if (status == WEFT_OK) {
        weft_light_plates_know_noise(&plates, set, cal);
        status = follow_drift(set, &plates, pixel, &drifted, run, err);
    }
    if (status == WEFT_OK)
        status = weft_incidence_init(&incidence, &drifted, plates.width, plates.height, pixel,
                                     options->height_mm, err);
    if (status == WEFT_OK)
        status = make_maps(maps, plates.width, plates.height, err);
    if (status == WEFT_OK) {
        weft_solve_plan plan = {.incidence = &incidence,
                                .method = options->method ? options->method : weft_solve_methods[0],
                                .width = plates.width,
                                .cfa = plates.cfa,
                                .shadow = (float)options->shadow};
        status = weft_refuse_coded(set, &plan, &plates, &inside, err);
        if (status == WEFT_OK && plan.method->takes_gloss && !options->matte)
            status = weft_cloth_gloss(&plan, &plates, &inside, &run->gloss, &run->report, err);
        if (run->report.found)
            plan.gloss = &run->gloss;
        explain_gloss(&run->report, plan.gloss);
        solve_job job = {&plan, &plates, &inside, cal, maps};
        if (status == WEFT_OK)
            status = solve_all_rows(&job, options, pixel, run, err);
        if (status == WEFT_OK)
            status = require_answers(maps, &inside, set, err);
    }
    run->seconds.solve = weft_clock_s() - clock;
    weft_incidence_fini(&incidence);
    weft_mask_fini(&inside);
    weft_light_plates_fini(&plates);
    return status;
}

static weft_err put_on_plane(weft_maps *maps, const weft_calibration *cal, const weft_solve_options *options,
                             weft_pixel_scale pixel, weft_error *err)
{
    weft_plane_grid grid;
    weft_maps plane = {0};
    WEFT_TRY(weft_plane_grid_choose(&grid, &cal->camera, pixel, options->mm_per_px, options->height_mm, err));
    WEFT_TRY(weft_rectify(maps, &cal->camera, pixel, &grid, &plane, err));
    weft_maps_fini(maps);
    *maps = plane;
    return WEFT_OK;
}

weft_err weft_solve_set(const weft_set *set, const weft_calibration *cal, const char *cal_folder,
                        const weft_solve_options *options, weft_maps *maps, weft_error *err)
{
    const weft_pixel_scale pixel = weft_solve_pixel(options);
    weft_solve_run run = {0};
    weft_maps to = {0};
    WEFT_TRY(weft_solve_check(set, cal, cal_folder, options, err));
    const bool to_plane = goes_to_plane(cal, options);
    if (!to_plane && !options->sensor_geometry)
        weft_note("%s has no camera: the maps stay in sensor geometry", cal_folder);
    weft_err status = solve_on_sensor(set, cal, options, pixel, &to, &run, err);
    if (status == WEFT_OK && to_plane) {
        const double clock = weft_clock_s();
        status = put_on_plane(&to, cal, options, pixel, err);
        run.seconds.rectify = weft_clock_s() - clock;
    }
    if (status == WEFT_OK)
        status = weft_solve_describe(set, cal_folder, options, &run, &to, err);
    if (status == WEFT_OK)
        status = weft_albedo_gamut_note(cal, &to, err);
    if (status != WEFT_OK) {
        weft_maps_fini(&to);
        return status == WEFT_ERR_CANCELLED ? status : weft_prefix(err, status, "%s", set->name);
    }
    *maps = to;
    return WEFT_OK;
}
