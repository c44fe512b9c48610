#include "shading/preview/preview_visibility.h"

#include "core/parallel.h"
#include "shading/brdf/half_vector.h"
#include "shading/brdf/sampling.h"
#include "shading/preview/bayer.h"
#include "shading/preview/preview_history.h"

#include <string.h>

#define MOST_PLACES (1 << 27) /* of all planes together: half a gigabyte */

#define DEPTH_SLOPE   0.05 /* of the blur, per texel; S-BLG-09 */
#define DRAPE_SQUARES 160  /* of the mesh that is cut into voxels, along a side */

typedef struct look_job {
    const weft_preview_setup *setup;
    weft_preview_visibility *visibility;
    const weft_preview_light *lights; /* distant ones at a place of their disc */
    int phase;                        /* of the dither */
} look_job;

/* ---- one look a place ---- */

/* What a look says: dark 0, lit 1, and 2 more where it wants to be blurred. */
enum { COARSE = 2 };

/* The folds of the drape, for sample i, whose lamp is set; `b` is the dither. */
static int look_past_folds(const look_job *job, const weft_preview_samples *s, int i, bool distant, double b)
{
    const weft_preview_setup *const setup = job->setup;
    const weft_voxels *const voxels = &job->visibility->voxels;
    const weft_preview_shadows *const how = &setup->view->shadows;
    weft_voxel_ray ray = {.reach = 1e9};
    weft_preview_place(setup, s, i, ray.from);
    for (int c = 0; c < 3; c++) {
        ray.from[c] /= setup->radius_texels;
        ray.normal[c] = (double)s->axis[2][c][i];
        ray.to[c] = (double)s->lamp[c][i];
    }
    if (!distant)
        ray.reach = (double)s->reach_mm[i] / (setup->radius_texels * setup->surface->mm_per_px);
    if (how->folds == WEFT_PREVIEW_FOLDS_WALKED)
        return weft_voxels_lit_walked(voxels, &ray);
    const bool coarse = weft_voxels_step(voxels, &ray, how->voxel_steps) > 1;
    return weft_voxels_lit_marched(voxels, &ray, how->voxel_steps, b) + (coarse ? COARSE : 0);
}

/* The lamp's cosine with axis `a` of the shape. */
static double towards(const weft_preview_samples *s, int i, int a)
{
    double sum = 0;
    for (int c = 0; c < 3; c++)
        sum += (double)s->lamp[c][i] * (double)s->axis[a][c][i];
    return sum;
}

static int look_past_relief(const look_job *job, const weft_preview_samples *s, int i, double b)
{
    const weft_preview_crop crop = job->setup->crop;
    const double tangent[3] = {towards(s, i, 0), towards(s, i, 1), towards(s, i, 2)};
    if (tangent[2] <= 0)
        return 1; /* what faces away is the shading's business */
    const weft_height_look look =
        weft_height_field_look(&job->visibility->field, crop.x + s->u[i], crop.y + s->v[i], tangent,
                               (weft_height_march){job->setup->view->shadows.steps, b});
    return look.lit + (look.coarse ? COARSE : 0);
}

/* Aims at a point of a large lamp, drawn by `b` (0..1) with what each adds to the light of the place: their
 * mean over the dither is the share of the lamp that is seen. */
static void aim_at_a_point(const weft_preview_light *lamp, weft_preview_samples *s, int i, double b)
{
    double sums[WEFT_PREVIEW_AREA_POINTS], sum = 0;
    int k = 0;
    for (int j = 0; j < WEFT_PREVIEW_AREA_POINTS; j++) {
        weft_preview_aim(lamp, s, i, j);
        sum += (double)s->irradiance[i] * weft_max(towards(s, i, 2), 0);
        sums[j] = sum;
    }
    while (k < WEFT_PREVIEW_AREA_POINTS - 1 && sums[k] < b * sum)
        k++;
    weft_preview_aim(lamp, s, i, sum > 0 ? k : WEFT_PREVIEW_AREA_POINTS / 2);
}

static void look_at_lamp(const look_job *job, weft_preview_samples *s, int light, int first, int row)
{
    const weft_preview_visibility *const vis = job->visibility;
    const weft_preview_shadows *const how = &job->setup->view->shadows;
    const weft_preview_light *const lamp = &job->lights[light];
    const bool large = lamp->kind == WEFT_PREVIEW_BALL || lamp->kind == WEFT_PREVIEW_TUBE;
    const bool plain = how->blur == WEFT_PREVIEW_BLUR_NEVER;
    float *const to = weft_image_row(&vis->lit, light, row);
    for (int i = 0; i < s->n; i++) {
        const double b = plain ? 0.5 : weft_bayer(first + i, row, job->phase) + 1.0 / 32;
        const double other = plain ? 0.5 : weft_bayer(row + 1, first + i + 2, job->phase) + 1.0 / 32;
        int folds = 1, relief = 1;
        if (s->hit[i] > 0) {
            if (large)
                aim_at_a_point(lamp, s, i, other);
            else
                weft_preview_aim(lamp, s, i, 0);
            folds = vis->voxels.bits ? look_past_folds(job, s, i, lamp->kind == WEFT_PREVIEW_DISTANT, b) : 1;
            relief = vis->field.height ? look_past_relief(job, s, i, b) : 1;
        }
        const bool soft = large || ((folds | relief) & COARSE) || how->blur == WEFT_PREVIEW_BLUR_ALWAYS;
        to[first + i] = (float)((folds & relief & 1) + (soft && !plain ? COARSE : 0));
    }
}

/* Towards the viewer, in texels. */
static double depth_at(const look_job *job, const weft_preview_samples *s, int i)
{
    const weft_height_field *const field = &job->visibility->field;
    const weft_preview_crop crop = job->setup->crop;
    const double relief = field->height ? weft_height_field_at(field, crop.x + s->u[i], crop.y + s->v[i]) : 0;
    double place[3], depth = 0;
    weft_preview_place(job->setup, s, i, place);
    for (int c = 0; c < 3; c++)
        depth += (double)s->eye[c][i] * (place[c] + relief * (double)s->axis[2][c][i]);
    return depth;
}

void weft_preview_visibility_hit(const weft_preview_setup *setup, const weft_preview_visibility *vis,
                                 int first, int row, weft_preview_samples *s)
{
    const int rest = vis->depth.width - first;
    s->n = rest < WEFT_PREVIEW_RUN ? rest : WEFT_PREVIEW_RUN;
    for (int i = 0; i < s->n; i++) {
        s->x[i] = (float)((first + i + 0.5) / vis->scale - setup->view->width / 2.0);
        s->y[i] = (float)(setup->view->height / 2.0 - (row + 0.5) / vis->scale);
    }
    weft_preview_hit(setup, s);
}

static void look_rows(void *context, int band, int row_begin, int row_end)
{
    const look_job *const job = context;
    weft_preview_visibility *const vis = job->visibility;
    weft_preview_samples s = {0};
    (void)band;
    for (int row = row_begin; row < row_end; row++)
        for (int first = 0; first < vis->depth.width; first += WEFT_PREVIEW_RUN) {
            weft_preview_visibility_hit(job->setup, vis, first, row, &s);
            for (int i = 0; i < s.n; i++)
                weft_image_row(&vis->depth, 0, row)[first + i] =
                    s.hit[i] > 0 ? (float)depth_at(job, &s, i) : NAN;
            for (int k = 0; k < job->setup->view->n_lights; k++)
                look_at_lamp(job, &s, k, first, row);
        }
}

/* ---- blur ---- */

typedef struct blur_job {
    const weft_image *lit, *depth;
    weft_image *to;
} blur_job;

/* Half weight at the ends: any four neighbours in a row of the matrix weigh the same. */
static const float window[5] = {0.5f, 1, 1, 1, 0.5f};

/* The answer of a look without its mark. */
static float answer(float look)
{
    return look >= COARSE ? look - COARSE : look;
}

static void blur_place(const blur_job *job, int x, int y)
{
    const int width = job->depth->width, height = job->depth->height, n = job->lit->planes;
    const float z = weft_image_row(job->depth, 0, y)[x];
    float sum[WEFT_PREVIEW_MAX_LIGHTS] = {0}, total = 0;
    for (int j = -2; j <= 2; j++) {
        const int row = y + j < 0 ? 0 : y + j < height ? y + j : height - 1;
        for (int i = -2; i <= 2; i++) {
            const int column = x + i < 0 ? 0 : x + i < width ? x + i : width - 1;
            const float other = weft_image_row(job->depth, 0, row)[column];
            const float near = isnan(z) ? 1 : 1 - (float)DEPTH_SLOPE * fabsf(other - z);
            if (!(near > 0) || isnan(other)) /* beyond an edge, or beside the sample */
                continue;
            const float weight = near * window[i + 2] * window[j + 2];
            total += weight;
            for (int k = 0; k < n; k++)
                sum[k] += weight * answer(weft_image_row(job->lit, k, row)[column]);
        }
    }
    for (int k = 0; k < n; k++) {
        const float look = weft_image_row(job->lit, k, y)[x];
        const bool soft = look >= COARSE || isnan(z);
        weft_image_row(job->to, k, y)[x] = !soft ? look : total > 0 ? sum[k] / total : 1;
    }
}

static void blur_rows(void *context, int band, int row_begin, int row_end)
{
    const blur_job *const job = context;
    (void)band;
    for (int y = row_begin; y < row_end; y++)
        for (int x = 0; x < job->depth->width; x++)
            blur_place(job, x, y);
}

static weft_err blur(weft_preview_visibility *vis, weft_error *err)
{
    weft_image soft;
    WEFT_TRY(weft_image_init(&soft, vis->lit.width, vis->lit.height, vis->lit.planes, err));
    weft_parallel_rows(soft.height, blur_rows, &(blur_job){&vis->lit, &vis->depth, &soft});
    weft_image_fini(&vis->lit);
    vis->lit = soft;
    return WEFT_OK;
}

/* ---- the whole buffer ---- */

static void drape_vertex(int column, int row, double at[3])
{
    double slope[2];
    at[0] = 2.0 * column / DRAPE_SQUARES - 1;
    at[1] = 2.0 * row / DRAPE_SQUARES - 1;
    at[2] = weft_preview_drape_height(at[0], at[1], slope);
}

weft_err weft_preview_drape_voxels(weft_voxels *voxels, int n_across, weft_error *err)
{
    const double depth = WEFT_PREVIEW_DRAPE_DEPTH;
    WEFT_TRY(weft_voxels_init(voxels, (const double[3]){-1, -1, -depth}, (const double[3]){1, 1, depth},
                              n_across, err));
    for (int row = 0; row < DRAPE_SQUARES; row++)
        for (int column = 0; column < DRAPE_SQUARES; column++) {
            double corner[4][3];
            for (int k = 0; k < 4; k++)
                drape_vertex(column + (k & 1), row + (k >> 1), corner[k]);
            weft_voxels_add_triangle(voxels, corner[0], corner[1], corner[3]);
            weft_voxels_add_triangle(voxels, corner[0], corner[3], corner[2]);
        }
    return WEFT_OK;
}

static weft_err prepare(weft_preview_visibility *vis, const weft_preview_setup *setup, weft_error *err)
{
    const weft_preview_view *const view = setup->view;
    const weft_preview_surface *const surface = setup->surface;
    const weft_preview_crop crop = setup->crop;
    if (view->shadows.relief) {
        WEFT_TRY(weft_height_field_init(&vis->field, surface->height_mm, surface->mm_per_px, err));
        if (view->shape != WEFT_PREVIEW_PLANE)
            weft_height_field_mirror(&vis->field, crop.x, crop.y, crop.width, crop.height);
    }
    if (view->shape == WEFT_PREVIEW_DRAPE && view->shadows.folds != WEFT_PREVIEW_FOLDS_FORMULA)
        WEFT_TRY(weft_preview_drape_voxels(&vis->voxels, view->shadows.voxels, err));
    vis->scale = setup->supersampling;
    const double planes = 2.0 * view->n_lights + 1, pixels = (double)view->width * view->height;
    const int longest = view->width > view->height ? view->width : view->height;
    while (vis->scale > 1 && (pixels * planes * vis->scale * vis->scale > MOST_PLACES ||
                              longest * vis->scale > WEFT_IMAGE_MAX_SIDE))
        vis->scale--;
    const int width = view->width * vis->scale, height = view->height * vis->scale;
    WEFT_TRY(weft_image_init(&vis->depth, width, height, 1, err));
    return weft_image_init(&vis->lit, width, height, view->n_lights, err);
}

/* Place k of n on a disc of `radius` about a unit direction: Hammersley's points, even in area. */
static void jitter(double direction[3], double radius, uint32_t k, uint32_t n)
{
    double u[2], t[3], length2 = 0;
    weft_hammersley(k, n, u);
    const double r = radius * sqrt(u[0] + 0.5 / n), phi = 2 * WEFT_PI * u[1];
    const int small = fabs(direction[0]) < 0.7 ? 0 : 1;
    for (int c = 0; c < 3; c++)
        t[c] = (c == small) - direction[small] * direction[c];
    for (int c = 0; c < 3; c++)
        length2 += t[c] * t[c];
    for (int c = 0; c < 3; c++)
        t[c] /= sqrt(length2);
    const double *const d = direction;
    const double b[3] = {d[1] * t[2] - d[2] * t[1], d[2] * t[0] - d[0] * t[2], d[0] * t[1] - d[1] * t[0]};
    double moved[3];
    length2 = 0;
    for (int c = 0; c < 3; c++) {
        moved[c] = d[c] + r * (cos(phi) * t[c] + sin(phi) * b[c]);
        length2 += moved[c] * moved[c];
    }
    for (int c = 0; c < 3; c++)
        direction[c] = moved[c] / sqrt(length2);
}

/* One look at every place, blurred; number k of n whose mean is wanted. */
static weft_err look(const weft_preview_setup *setup, weft_preview_visibility *vis, int k, int n,
                     weft_error *err)
{
    const weft_preview_view *const view = setup->view;
    weft_preview_light lights[WEFT_PREVIEW_MAX_LIGHTS];
    const look_job job = {setup, vis, lights, (view->shadows.phase + 5 * k) & 15};
    memcpy(lights, view->lights, sizeof lights);
    for (int i = 0; i < view->n_lights && n > 1; i++)
        if (lights[i].kind == WEFT_PREVIEW_DISTANT)
            jitter(lights[i].direction, view->shadows.disc_rad, (uint32_t)k, (uint32_t)n);
    WEFT_TRY(weft_parallel_rows_progress(vis->depth.height, look_rows, (void *)&job, "shadows", err));
    return blur(vis, err);
}

/* The mean of n looks, each with its own dither and place on the lamp. */
static weft_err look_often(const weft_preview_setup *setup, weft_preview_visibility *vis, int n,
                           weft_error *err)
{
    weft_image mean;
    WEFT_TRY(weft_image_init(&mean, vis->lit.width, vis->lit.height, vis->lit.planes, err));
    const size_t size = weft_image_plane_size(&mean) * (size_t)mean.planes;
    weft_err status = WEFT_OK;
    for (int k = 0; k < n && status == WEFT_OK; k++) {
        status = look(setup, vis, k, n, err);
        for (size_t i = 0; i < size && status == WEFT_OK; i++)
            mean.data[i] += vis->lit.data[i] / (float)n;
    }
    weft_image_fini(&vis->lit);
    vis->lit = mean;
    return status;
}

weft_err weft_preview_visibility_init(weft_preview_visibility *visibility, const weft_preview_setup *setup,
                                      weft_error *err)
{
    enum { PHASES = 16 }; /* of the memory; sevens go through them far apart */
    const weft_preview_shadows *const how = &setup->view->shadows;
    weft_preview_visibility made = {0};
    weft_err status = prepare(&made, setup, err);
    if (status == WEFT_OK && how->accumulate > 1)
        status = look_often(setup, &made, how->accumulate, err);
    else if (status == WEFT_OK)
        status = how->history ? look(setup, &made, 7 * how->history->frame++ % PHASES, PHASES, err)
                              : look(setup, &made, 0, 1, err);
    if (status == WEFT_OK && how->history)
        status = weft_preview_history_add(how->history, setup, &made, err);
    if (status != WEFT_OK)
        weft_preview_visibility_fini(&made);
    else
        *visibility = made;
    return status;
}

void weft_preview_visibility_fini(weft_preview_visibility *visibility)
{
    weft_image_fini(&visibility->lit);
    weft_image_fini(&visibility->depth);
    weft_height_field_fini(&visibility->field);
    weft_voxels_fini(&visibility->voxels);
    *visibility = (weft_preview_visibility){0};
}

void weft_preview_see(const weft_preview_setup *setup, int light, weft_preview_samples *s)
{
    const weft_preview_visibility *const vis = setup->visibility;
    const double half_width = setup->view->width / 2.0, half_height = setup->view->height / 2.0;
    for (int i = 0; i < s->n; i++)
        s->visible[i] = weft_image_sample(&vis->lit, light, ((double)s->x[i] + half_width) * vis->scale - 0.5,
                                          (half_height - (double)s->y[i]) * vis->scale - 0.5);
}
