#include "host/solve/rematch.h"

#include "calibration/lens/lens_model.h"
#include "calibration/lights/light_model.h"
#include "core/colour.h"
#include "core/parallel.h"
#include "host/solve/strip.h"
#include "shading/preview/sheet.h"

#include <math.h>
#include <string.h>

#define PI       3.14159265358979323846
#define SMALLEST 1e-20 /* mean square of pictures that are the same */
enum { RUN = 128 };

/* Where a pixel of the maps lies: in the world and on the sensor. */
typedef struct place {
    weft_vec3 world;
    double u, v;
} place;

typedef struct match_job {
    const weft_rematch *match;
    const weft_plate *rgb;
    int light;
    double pixel_scale; /* maps in sensor geometry: photosites a pixel */
    weft_image *photograph, *rendering;
    weft_mask *used;
} match_job;

static bool has_pose(const weft_rematch *match)
{
    return match->cal.has_camera && match->cal.camera.has_pose;
}

/* False where the camera does not see it. */
static bool find_place(const match_job *job, int i, int j, place *at)
{
    const weft_rematch *const m = job->match;
    at->world = (weft_vec3){0, 0, m->height_mm};
    if (m->maps->geometry == WEFT_GEOMETRY_PLANE) {
        at->world.x = m->maps->origin_mm[0] + i * m->maps->mm_per_px;
        at->world.y = m->maps->origin_mm[1] - j * m->maps->mm_per_px;
        return weft_camera_project(&m->cal.camera, at->world, &at->u, &at->v) && at->u >= 0 && at->v >= 0 &&
               at->u <= m->set->width - 1 && at->v <= m->set->height - 1;
    }
    at->u = job->pixel_scale * i + (job->pixel_scale - 1) / 2;
    at->v = job->pixel_scale * j + (job->pixel_scale - 1) / 2;
    return !has_pose(m) || weft_camera_to_plane(&m->cal.camera, at->u, at->v, m->height_mm, &at->world);
}

/* The linear picture of a white sheet's equal, and the lamp's strength there (green). */
static bool photograph_at(const match_job *job, const place *at, double value[3], double *strength)
{
    const weft_calibration *const cal = &job->match->cal;
    const weft_plate *const p = job->rgb;
    const int u = (int)(at->u + 0.5), v = (int)(at->v + 0.5);
    const double limit = job->match->plates.most[job->light];
    weft_vec3 to_light;
    double camera[3];
    if (p->clipped.data && p->clipped.data[(size_t)v * (size_t)p->clipped.width + (size_t)u])
        return false;
    const double fall = weft_light_at(&cal->lights[job->light], at->world, &to_light);
    for (int c = 0; c < 3; c++) {
        const double lamp = cal->lights[job->light].intensity[c] * fall *
                            weft_light_grid_gain(cal, job->light, c, at->u, at->v);
        const double seen = (double)weft_image_sample(&p->image, p->image.planes == 3 ? c : 0, at->u, at->v);
        if (!(lamp > 0) || (limit > 0 && seen > limit))
            return false;
        camera[c] = seen / lamp;
        if (c == 1)
            *strength = lamp;
    }
    if (cal->has_colour)
        weft_colour_model_apply(&cal->colour.model, camera, value);
    else
        memcpy(value, camera, sizeof camera);
    return true;
}

/* World direction in the frame of the shading normal, whose tangent lies in the plane of map X. */
static void to_local(const double n[3], weft_vec3 d, double local[3])
{
    const double inverse = 1 / sqrt(fmax(1 - n[0] * n[0], 1e-12));
    const double t[3] = {(1 - n[0] * n[0]) * inverse, -n[0] * n[1] * inverse, -n[0] * n[2] * inverse};
    const double b[3] = {n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2], n[0] * t[1] - n[1] * t[0]};
    local[0] = d.x * t[0] + d.y * t[1] + d.z * t[2];
    local[1] = d.x * b[0] + d.y * b[1] + d.z * b[2];
    local[2] = d.x * n[0] + d.y * n[1] + d.z * n[2];
}

static bool normal_at(const weft_preview_surface *surface, size_t at, double n[3])
{
    const size_t plane = (size_t)surface->width * (size_t)surface->height;
    n[0] = n[1] = 0;
    n[2] = 1;
    if (!surface->normal)
        return true;
    for (int c = 0; c < 3; c++)
        n[c] = (double)surface->normal->data[(size_t)c * plane + at];
    const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int c = 0; c < 3 && length > 1e-6; c++)
        n[c] /= length;
    return length > 1e-6;
}

/* pi f (n.l) at one pixel. */
static void render_at(const match_job *job, size_t at, const double n[3], const place *p, double value[3])
{
    const weft_preview_surface *const s = job->match->surface;
    double params[WEFT_BRDF_MAX_PLANES], light[3], view[3];
    int plane = 0;
    weft_vec3 to_light, to_eye = {0, 0, 1};
    weft_light_at(&job->match->cal.lights[job->light], p->world, &to_light);
    if (has_pose(job->match))
        to_eye = weft_normalise(weft_sub(weft_camera_centre(&job->match->cal.camera), p->world));
    for (const weft_brdf_param *row = s->brdf->params; row->name; row++)
        for (int c = 0; c < row->components; c++, plane++) {
            const weft_preview_map map = s->maps[plane];
            const double given =
                map.image ? (double)weft_image_plane(map.image, map.plane)[at] : s->params[plane];
            params[plane] = fmin(fmax(given, row->min), row->max);
        }
    to_local(n, weft_normalise(to_light), light);
    to_local(n, to_eye, view);
    weft_brdf_eval_one(s->brdf, params, light, view, value);
    for (int c = 0; c < 3; c++)
        value[c] *= PI * fmax(light[2], 0);
}

static void match_rows(void *context, int band, int row_begin, int row_end)
{
    const match_job *const job = context;
    const weft_rematch *const m = job->match;
    (void)band;
    for (int j = row_begin; j < row_end; j++)
        for (int i = 0; i < m->maps->width; i++) {
            const size_t at = (size_t)j * (size_t)m->maps->width + (size_t)i;
            place p;
            double n[3], seen[3], made[3], strength = 0;
            if ((m->maps->mask.data && !m->maps->mask.data[at]) || !find_place(job, i, j, &p) ||
                !normal_at(m->surface, at, n) || !photograph_at(job, &p, seen, &strength))
                continue;
            render_at(job, at, n, &p, made);
            for (int c = 0; c < 3; c++) {
                weft_image_row(job->photograph, c, j)[i] = (float)(m->exposure * strength * seen[c]);
                weft_image_row(job->rendering, c, j)[i] = (float)(m->exposure * strength * made[c]);
            }
            job->used->data[at] = 255;
        }
}

/* Sums in row order: the same figures with any number of threads. */
static weft_err compare(const match_job *job, weft_rematch_figures *f, weft_error *err)
{
    double coded = 0, linear = 0, sum[2] = {0};
    const size_t n = weft_image_plane_size(job->photograph);
    *f = (weft_rematch_figures){.light = job->light};
    for (size_t i = 0; i < n; i++) {
        if (!job->used->data[i])
            continue;
        f->n_pixels++;
        for (int c = 0; c < 3; c++) {
            const double a = fmin(fmax((double)weft_image_plane(job->photograph, c)[i], 0), 1);
            const double b = fmin(fmax((double)weft_image_plane(job->rendering, c)[i], 0), 1);
            const double d = weft_srgb_encode(a) - weft_srgb_encode(b);
            coded += d * d;
            linear += (a - b) * (a - b);
        }
        sum[0] += (double)weft_image_plane(job->photograph, 1)[i];
        sum[1] += (double)weft_image_plane(job->rendering, 1)[i];
    }
    if (f->n_pixels == 0)
        return weft_fail(err, WEFT_ERR_NODATA,
                         "no pixel of the maps is seen unclipped under light %d (are these the maps of this "
                         "set?)",
                         job->light);
    const double count = 3 * (double)f->n_pixels;
    f->psnr_db = -10 * log10(fmax(coded / count, SMALLEST));
    f->psnr_linear_db = -10 * log10(fmax(linear / count, SMALLEST));
    f->ratio = sum[0] > 0 ? sum[1] / sum[0] : 0;
    return WEFT_OK;
}

static weft_err make_pictures(const weft_rematch *match, int light, weft_image pictures[2], weft_mask *used,
                              weft_rematch_figures *figures, weft_error *err)
{
    const int width = match->maps->width, height = match->maps->height;
    weft_plate rgb = {0};
    match_job job = {.match = match,
                     .rgb = &rgb,
                     .light = light,
                     .pixel_scale = (double)match->set->width / width,
                     .photograph = &pictures[0],
                     .rendering = &pictures[1],
                     .used = used};
    WEFT_TRY(weft_image_init(&pictures[0], width, height, 3, err));
    WEFT_TRY(weft_image_init(&pictures[1], width, height, 3, err));
    WEFT_TRY(weft_mask_init(used, width, height, 0, err));
    WEFT_TRY(weft_plate_demosaic(&match->plates.plate[light], WEFT_DEMOSAIC_LINEAR, &rgb, err));
    weft_parallel_rows(height, match_rows, &job);
    weft_plate_fini(&rgb);
    return figures ? compare(&job, figures, err) : WEFT_OK;
}

weft_err weft_rematch_light(const weft_rematch *match, int light, weft_rematch_figures *figures,
                            weft_image pictures[2], weft_error *err)
{
    weft_image made[2] = {0};
    weft_mask used = {0};
    const weft_err status = make_pictures(match, light, made, &used, figures, err);
    weft_mask_fini(&used);
    for (int i = 0; i < 2; i++) {
        if (status != WEFT_OK)
            weft_image_fini(&made[i]);
        else
            pictures[i] = made[i];
    }
    return status;
}

/* 1 over the brightest of the lights' 99.9 % quantiles. */
static weft_err find_exposure(weft_rematch *match, weft_error *err)
{
    double brightest = 0;
    match->exposure = 1;
    for (int light = 0; light < match->plates.n; light++) {
        weft_image pictures[2] = {0};
        weft_mask used = {0};
        double high = 0;
        weft_err status = make_pictures(match, light, pictures, &used, NULL, err);
        if (status == WEFT_OK)
            status = weft_image_quantile(&pictures[0], 1, &used, 0.999, &high, err);
        for (int i = 0; i < 2; i++)
            weft_image_fini(&pictures[i]);
        weft_mask_fini(&used);
        WEFT_TRY(status);
        brightest = fmax(brightest, high);
    }
    if (!(brightest > 0))
        return weft_fail(err, WEFT_ERR_NODATA, "the photographs are black where the maps have an answer");
    match->exposure = 1 / brightest;
    return WEFT_OK;
}

static weft_err check(const weft_rematch *match, const char *cal_folder, weft_error *err)
{
    const weft_maps *const maps = match->maps;
    const bool plane = maps->geometry == WEFT_GEOMETRY_PLANE;
    WEFT_TRY(weft_calibration_require(&match->cal, WEFT_CALIBRATION_LIGHTS, cal_folder, err));
    WEFT_TRY(weft_set_require_lights(match->set, err));
    if (plane)
        WEFT_TRY(weft_calibration_require(&match->cal, WEFT_CALIBRATION_CAMERA | WEFT_CALIBRATION_POSE,
                                          cal_folder, err));
    if (weft_set_n_lights(match->set) != match->cal.n_lights)
        return weft_fail(err, WEFT_ERR_MISMATCH, "%s has %d lights but the calibration %s has %d",
                         match->set->folder, weft_set_n_lights(match->set), cal_folder, match->cal.n_lights);
    const bool full = maps->width == match->set->width && maps->height == match->set->height;
    const bool half = maps->width == match->set->width / 2 && maps->height == match->set->height / 2;
    if (!plane && !full && !half)
        return weft_fail(err, WEFT_ERR_MISMATCH,
                         "the maps have %d x %d pixels, the photographs of %s %d x %d: they do not belong "
                         "together",
                         maps->width, maps->height, match->set->folder, match->set->width,
                         match->set->height);
    if (maps->albedo.planes && maps->albedo_is_srgb != match->cal.has_colour)
        return weft_fail(err, WEFT_ERR_MISMATCH,
                         "the maps' albedo %s but the calibration %s %s (solve again with this calibration)",
                         maps->albedo_is_srgb ? "has true colours" : "is in the camera's colours", cal_folder,
                         match->cal.has_colour ? "has them" : "has none");
    return WEFT_OK;
}

static weft_err follow_strip(weft_rematch *match, weft_error *err)
{
    weft_strip strip;
    weft_strip_drift drift;
    bool present;
    WEFT_TRY(weft_strip_of_set(match->set, &strip, &present, err));
    if (!present)
        return WEFT_OK;
    WEFT_TRY(weft_strip_measure(&match->plates, (weft_pixel_scale){1, 0}, &match->cal, &strip, &drift, err));
    for (int j = 0; j < match->plates.n; j++)
        for (int c = 0; c < 3; c++)
            match->cal.lights[j].intensity[c] *= drift.gain[j][c];
    return WEFT_OK;
}

weft_err weft_rematch_init(weft_rematch *match, const weft_preview_surface *surface, const weft_maps *maps,
                           const weft_set *set, const weft_calibration *cal, const char *cal_folder,
                           double height_mm, weft_error *err)
{
    *match = (weft_rematch){
        .surface = surface, .maps = maps, .set = set, .cal = *cal, .height_mm = height_mm, .exposure = 1};
    WEFT_TRY(check(match, cal_folder, err));
    WEFT_TRY(weft_light_plates_load(set, WEFT_READ_SITES, &match->plates, err));
    weft_err status = follow_strip(match, err);
    if (status == WEFT_OK)
        status = find_exposure(match, err);
    if (status != WEFT_OK)
        weft_rematch_fini(match);
    return status;
}

void weft_rematch_fini(weft_rematch *match)
{
    weft_light_plates_fini(&match->plates);
}
