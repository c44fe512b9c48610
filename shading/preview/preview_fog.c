#include "shading/preview/preview_fog.h"

#include "core/parallel.h"
#include "shading/brdf/half_vector.h"
#include "shading/lighting/volume_light.h"
#include "shading/preview/bayer.h"
#include "shading/preview/bilateral.h"
#include "shading/preview/preview_visibility.h"

#define SLOPE       10           /* of the weights, per half width: a tenth of it is another surface */
#define FAR_VOXELS  128          /* of the drape's shadows, along its width */
#define ROLL_LENGTH (0.92 / 0.7) /* half of the roll's, in radii */

typedef struct fog_job {
    const weft_preview_setup *setup;
    const weft_voxels *voxels; /* NULL but for the drape */
    int step;                  /* pixels from place to place: 2, or 1 */
    double half;               /* map texels in a half width */
    double sigma;              /* a half width */
    weft_image *light;         /* 3 planes: L; 1 plane: length of the ray */
} fog_job;

/* A ray through the air: from its far end towards the eye, in half widths, frame of the sample. */
typedef struct air_ray {
    double from[3], to_eye[3], length;
    double from_mm[3];
} air_ray;

/* Depth towards the viewer of a vector in the frame of the turned sample. */
static double viewer_z(const weft_preview_setup *setup, const double v[3])
{
    return setup->view->shape == WEFT_PREVIEW_PLANE ? v[2] : setup->turn_cos * v[2] - setup->turn_sin * v[0];
}

/* The far end of a ray that passes the sample: at the back of the box. */
static void background(const weft_preview_setup *setup, double x_px, double y_px, air_ray *ray)
{
    const double x = x_px / setup->radius_px, y = y_px / setup->radius_px, d = setup->eye_distance;
    const double wide = d > 0 ? (d + 1) / sqrt(d * d - 1) : 1; /* the tangent of the outline, at z = -1 */
    double at[3] = {x * wide, y * wide, -1}, to[3] = {0, 0, 1};
    if (d > 0) {
        const double back[3] = {-at[0], -at[1], d + 1};
        const double inverse = 1 / sqrt(back[0] * back[0] + back[1] * back[1] + back[2] * back[2]);
        for (int c = 0; c < 3; c++)
            to[c] = back[c] * inverse;
    }
    for (int k = 0; k < 2; k++) {
        const double *const v = k ? to : at;
        double *const turned = k ? ray->to_eye : ray->from;
        turned[0] = setup->turn_cos * v[0] - setup->turn_sin * v[2];
        turned[1] = v[1];
        turned[2] = setup->turn_sin * v[0] + setup->turn_cos * v[2];
    }
}

static air_ray ray_of(const fog_job *job, const weft_preview_samples *s, int i)
{
    const weft_preview_setup *const setup = job->setup;
    const bool plane = setup->view->shape == WEFT_PREVIEW_PLANE;
    const double half_mm = job->half * setup->surface->mm_per_px;
    air_ray ray = {0};
    if (plane || s->hit[i] > 0) {
        weft_preview_place(setup, s, i, ray.from);
        for (int c = 0; c < 3; c++) {
            ray.from[c] /= job->half;
            ray.to_eye[c] = (double)s->eye[c][i];
        }
    } else {
        background(setup, (double)s->x[i], (double)s->y[i], &ray);
    }
    for (int c = 0; c < 3; c++)
        ray.from_mm[c] = plane ? (double)s->position_mm[c][i] : ray.from[c] * half_mm;
    ray.length = weft_max(1 - viewer_z(setup, ray.from), 0) / weft_max(viewer_z(setup, ray.to_eye), 1e-3);
    return ray;
}

/* Whether a ray from outside meets the ball or the roll before `reach`. */
static bool meets_round(const double from[3], const double to[3], double reach, bool roll)
{
    const double along = roll ? to[0] * to[0] + to[2] * to[2] : 1;
    const double b = from[0] * to[0] + from[2] * to[2] + (roll ? 0 : from[1] * to[1]);
    const double c = from[0] * from[0] + from[2] * from[2] + (roll ? 0 : from[1] * from[1]) - 1;
    const double root = b * b - along * c;
    if (along < 1e-12 || root <= 0)
        return false;
    const double t = (-b - sqrt(root)) / along;
    return t > 1e-6 && t < reach && (!roll || fabs(from[1] + t * to[1]) <= ROLL_LENGTH);
}

static bool lit(const fog_job *job, const double at[3], const double to[3], double reach)
{
    weft_voxel_ray ray = {.reach = reach};
    switch (job->setup->view->shape) {
    case WEFT_PREVIEW_PLANE:
        return to[2] > 0;
    case WEFT_PREVIEW_SPHERE:
    case WEFT_PREVIEW_CYLINDER:
        return !meets_round(at, to, reach, job->setup->view->shape == WEFT_PREVIEW_CYLINDER);
    case WEFT_PREVIEW_DRAPE:
        break;
    }
    for (int c = 0; c < 3; c++) {
        ray.from[c] = at[c];
        ray.to[c] = to[c];
    }
    return weft_voxels_lit_walked(job->voxels, &ray);
}

/* Adds what a lamp scatters to the eye along the ray; `b` is the dither. */
static void add_lamp(const fog_job *job, const weft_preview_light *light, const air_ray *ray, double b,
                     double other, weft_preview_samples *one, double sum[3])
{
    const weft_preview_fog *const fog = &job->setup->view->fog;
    const double half_mm = job->half * job->setup->surface->mm_per_px, step = ray->length / fog->steps;
    const bool large = light->kind == WEFT_PREVIEW_BALL || light->kind == WEFT_PREVIEW_TUBE;
    for (int k = 0; k < fog->steps; k++) {
        const double t = step * (k + b),
                     near = step * (fog->steps - k - 1); /* to the eye's side of the box */
        double at[3], to[3], cosine = 0;
        for (int c = 0; c < 3; c++) {
            at[c] = ray->from[c] + t * ray->to_eye[c];
            one->position_mm[c][0] = (float)(ray->from_mm[c] + t * half_mm * ray->to_eye[c]);
        }
        weft_preview_aim(light, one, 0, (int)(other * WEFT_PREVIEW_AREA_POINTS));
        for (int c = 0; c < 3; c++) {
            to[c] = (double)one->lamp[c][0];
            cosine -= to[c] * ray->to_eye[c];
        }
        const double reach = light->kind == WEFT_PREVIEW_DISTANT ? 1e9 : (double)one->reach_mm[0] / half_mm;
        if (!lit(job, at, to, reach))
            continue;
        const double scattered = weft_phase_henyey_greenstein(fog->g, cosine) * (double)one->irradiance[0] *
                                 (large ? WEFT_PREVIEW_AREA_POINTS : 1);
        /* the whole step's share of e^(-sigma s), wherever in it the look is: exact for even light */
        const double share =
            fog->even ? fog->depth / fog->steps : exp(-job->sigma * near) * -expm1(-job->sigma * step);
        for (int c = 0; c < 3; c++)
            sum[c] += share * scattered * light->irradiance[c];
    }
}

static void fill_run(const fog_job *job, int first, int row, weft_preview_samples *s)
{
    const weft_preview_view *const view = job->setup->view;
    const int rest = job->light->width - first;
    s->n = rest < WEFT_PREVIEW_RUN ? rest : WEFT_PREVIEW_RUN;
    for (int i = 0; i < s->n; i++) {
        s->x[i] = (float)((first + i + 0.5) * job->step - view->width / 2.0);
        s->y[i] = (float)(view->height / 2.0 - (row + 0.5) * job->step);
    }
    weft_preview_hit(job->setup, s);
}

static void march_rows(void *context, int band, int row_begin, int row_end)
{
    const fog_job *const job = context;
    const weft_preview_view *const view = job->setup->view;
    weft_preview_samples s = {0}, one = {.n = 1};
    (void)band;
    for (int row = row_begin; row < row_end; row++)
        for (int first = 0; first < job->light->width; first += WEFT_PREVIEW_RUN) {
            fill_run(job, first, row, &s);
            for (int i = 0; i < s.n; i++) {
                const air_ray ray = ray_of(job, &s, i);
                const double b = view->fog.plain ? 0.5 : weft_bayer(first + i, row, 0) + 1.0 / 32;
                const double other = view->fog.plain ? 0.5 : weft_bayer(row + 1, first + i + 2, 0) + 1.0 / 32;
                double sum[3] = {0};
                for (int k = 0; k < view->n_lights; k++)
                    add_lamp(job, &view->lights[k], &ray, b, other, &one, sum);
                for (int c = 0; c < 3; c++)
                    weft_image_row(job->light, c, row)[first + i] = (float)sum[c];
                weft_image_row(job->light, 3, row)[first + i] = (float)ray.length;
            }
        }
}

/* ---- blur and full size ---- */

typedef struct soften_job {
    const weft_image *from;
    weft_image *to;
} soften_job;

static int clamp_index(int i, int n)
{
    return i < 0 ? 0 : i < n ? i : n - 1;
}

/* Five by five places, the outer ones by half: each value of the dither weighs the same. */
static void soften_rows(void *context, int band, int row_begin, int row_end)
{
    const soften_job *const job = context;
    const weft_image *const from = job->from;
    (void)band;
    for (int y = row_begin; y < row_end; y++)
        for (int x = 0; x < from->width; x++) {
            const double z = (double)weft_image_row(from, 3, y)[x];
            double sum[3] = {0}, total = 0;
            for (int k = 0; k < 25; k++) {
                const int i = clamp_index(x + k % 5 - 2, from->width),
                          j = clamp_index(y + k / 5 - 2, from->height);
                const double near = 1 - SLOPE * fabs((double)weft_image_row(from, 3, j)[i] - z);
                const double w = weft_max(near, 0) * (k % 5 % 4 ? 1 : 0.5) * (k / 5 % 4 ? 1 : 0.5);
                total += w;
                for (int c = 0; c < 3; c++)
                    sum[c] += w * (double)weft_image_row(from, c, j)[i];
            }
            for (int c = 0; c < 3; c++)
                weft_image_row(job->to, c, y)[x] = (float)(sum[c] / total);
            weft_image_row(job->to, 3, y)[x] = (float)z;
        }
}

typedef struct cover_job {
    const fog_job *fog;
    weft_image *picture;
    double exposure;
} cover_job;

/* L at a pixel from the half size: its own place and three neighbours by depth, the nearest in depth where
 * none is near (S-BLG-09). */
static void light_at(const fog_job *fog, int x, int y, double depth, double light[3])
{
    const weft_image *const from = fog->light;
    double depths[4], values[4];
    int at[4][2], nearest = 0;
    for (int k = 0; k < 4; k++) {
        at[k][0] = clamp_index(x / fog->step + (k & 1 && fog->step > 1 ? (x % 2 ? 1 : -1) : 0), from->width);
        at[k][1] = clamp_index(y / fog->step + (k & 2 && fog->step > 1 ? (y % 2 ? 1 : -1) : 0), from->height);
        depths[k] = (double)weft_image_row(from, 3, at[k][1])[at[k][0]];
        nearest = fabs(depths[k] - depth) < fabs(depths[nearest] - depth) ? k : nearest;
    }
    const bool found = fabs(depths[nearest] - depth) * SLOPE < 0.9;
    for (int c = 0; c < 3; c++) {
        for (int k = 0; k < 4; k++)
            values[k] = (double)weft_image_row(from, c, at[k][1])[at[k][0]];
        light[c] = found ? weft_bilateral_mean(depth, 4, depths, values, SLOPE) : values[nearest];
    }
}

static void cover_rows(void *context, int band, int row_begin, int row_end)
{
    const cover_job *const job = context;
    const weft_preview_setup *const setup = job->fog->setup;
    weft_preview_samples s = {0};
    (void)band;
    for (int y = row_begin; y < row_end; y++)
        for (int first = 0; first < job->picture->width; first += WEFT_PREVIEW_RUN) {
            const int rest = job->picture->width - first;
            s.n = rest < WEFT_PREVIEW_RUN ? rest : WEFT_PREVIEW_RUN;
            for (int i = 0; i < s.n; i++) {
                s.x[i] = (float)(first + i + 0.5 - setup->view->width / 2.0);
                s.y[i] = (float)(setup->view->height / 2.0 - (y + 0.5));
            }
            weft_preview_hit(setup, &s);
            for (int i = 0; i < s.n; i++) {
                double light[3];
                const double depth = ray_of(job->fog, &s, i).length;
                const double through = setup->view->fog.even ? 1 : exp(-job->fog->sigma * depth);
                light_at(job->fog, first + i, y, depth, light);
                for (int c = 0; c < 3; c++) {
                    float *const pixel = &weft_image_row(job->picture, c, y)[first + i];
                    *pixel = (float)(through * (double)*pixel + job->exposure * light[c]);
                }
            }
        }
}

static weft_err soften(weft_image *light, weft_error *err)
{
    weft_image soft;
    WEFT_TRY(weft_image_init(&soft, light->width, light->height, light->planes, err));
    weft_parallel_rows(soft.height, soften_rows, &(soften_job){light, &soft});
    weft_image_fini(light);
    *light = soft;
    return WEFT_OK;
}

weft_err weft_preview_add_fog(const weft_preview_setup *setup, weft_image *picture, weft_error *err)
{
    const weft_preview_view *const view = setup->view;
    const weft_preview_crop crop = setup->crop;
    const bool plane = view->shape == WEFT_PREVIEW_PLANE;
    weft_voxels voxels = {0};
    weft_image light = {0};
    fog_job job = {.setup = setup,
                   .voxels = &voxels,
                   .step = view->fog.plain ? 1 : 2,
                   .half = plane ? 0.5 * (crop.width < crop.height ? crop.width : crop.height)
                                 : setup->radius_texels,
                   .sigma = view->fog.depth / (plane ? 1 : 2),
                   .light = &light};
    if (view->shape == WEFT_PREVIEW_DRAPE)
        WEFT_TRY(weft_preview_drape_voxels(&voxels, FAR_VOXELS, err));
    weft_err status = weft_image_init(&light, (view->width + job.step - 1) / job.step,
                                      (view->height + job.step - 1) / job.step, 4, err);
    if (status == WEFT_OK)
        status = weft_parallel_rows_progress(light.height, march_rows, &job, "fog", err);
    if (status == WEFT_OK && !view->fog.plain)
        status = soften(&light, err);
    if (status == WEFT_OK)
        weft_parallel_rows(picture->height, cover_rows, &(cover_job){&job, picture, exp2(view->exposure_ev)});
    weft_image_fini(&light);
    weft_voxels_fini(&voxels);
    return status;
}
