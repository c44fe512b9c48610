#include "host/solve/rectify.h"

#include "calibration/lens/lens_model.h"
#include "core/parallel.h"

#include <assert.h>
#include <math.h>

enum { LOBES = 3, STEPS = 256, COARSEST = 16, TAPS_MAX = COARSEST + 2 * LOBES + 4, PLANES = 6 };

static const double pi = 3.14159265358979323846;

weft_err weft_plane_scale(const weft_camera *camera, weft_pixel_scale pixel, double height_mm,
                          double *mm_per_px, weft_error *err)
{
    const double u = 0.5 * (camera->width - 1), v = 0.5 * (camera->height - 1), h = 0.5 * pixel.scale;
    weft_vec3 left, right, up, down;
    if (!weft_camera_to_plane(camera, u - h, v, height_mm, &left) ||
        !weft_camera_to_plane(camera, u + h, v, height_mm, &right) ||
        !weft_camera_to_plane(camera, u, v - h, height_mm, &up) ||
        !weft_camera_to_plane(camera, u, v + h, height_mm, &down))
        return weft_fail(
            err, WEFT_ERR_RANGE,
            "the calibration's camera does not look at the sample plane (calibrate the pose again)");
    const weft_vec3 cross = weft_cross(weft_sub(right, left), weft_sub(up, down));
    const double exact = sqrt(weft_length(cross)); /* side of a square of the same area */
    const double unit = pow(10, floor(log10(exact)) - 2);
    *mm_per_px = unit < 1 ? round(exact / unit) / round(1 / unit) : round(exact / unit) * unit;
    return WEFT_OK;
}

/* Largest |x| and |y| of the plane along the edge of the frame. */
static bool measure_view(const weft_camera *camera, double height_mm, double *x_mm, double *y_mm)
{
    *x_mm = *y_mm = 0;
    for (int side = 0; side < 4; side++)
        for (int i = 0; i <= 64; i++) {
            const double t = i / 64.0, w = camera->width - 1, h = camera->height - 1;
            const double u = side == 0 ? 0 : side == 1 ? w : t * w;
            const double v = side == 2 ? 0 : side == 3 ? h : t * h;
            weft_vec3 point;
            if (!weft_camera_to_plane(camera, u, v, height_mm, &point))
                return false;
            *x_mm = fmax(*x_mm, fabs(point.x));
            *y_mm = fmax(*y_mm, fabs(point.y));
        }
    return true;
}

weft_err weft_plane_grid_init(weft_plane_grid *grid, const weft_camera *camera, double mm_per_px,
                              double height_mm, weft_error *err)
{
    double x_mm, y_mm;
    assert(mm_per_px > 0);
    if (!measure_view(camera, height_mm, &x_mm, &y_mm))
        return weft_fail(err, WEFT_ERR_RANGE,
                         "part of the frame does not see the sample plane (calibrate the pose again, or use "
                         "--geometry sensor)");
    const double columns = 2 * (floor(x_mm / mm_per_px - 0.5) + 1);
    const double rows = 2 * (floor(y_mm / mm_per_px - 0.5) + 1);
    const double side = fmax(columns, rows);
    const bool too_fine = !(side <= WEFT_IMAGE_MAX_SIDE);
    if (too_fine || columns < 2 || rows < 2)
        return weft_fail(err, WEFT_ERR_RANGE,
                         "a grid of %.6g mm a pixel over %.4g x %.4g mm has %.0f x %.0f pixels "
                         "(use --mm-per-px of %s %.2g)",
                         mm_per_px, 2 * x_mm, 2 * y_mm, columns, rows, too_fine ? "at least" : "less than",
                         too_fine ? 2.1 * fmax(x_mm, y_mm) / WEFT_IMAGE_MAX_SIDE : 0.9 * fmin(x_mm, y_mm));
    *grid = (weft_plane_grid){(int)columns, (int)rows, mm_per_px, height_mm};
    return WEFT_OK;
}

static weft_err refuse_coarse(double mm_per_px, double sensor_mm, weft_error *err)
{
    return mm_per_px <= COARSEST * sensor_mm
               ? WEFT_OK
               : weft_fail(err, WEFT_ERR_RANGE,
                           "%.4g mm a pixel is more than %d times as coarse as the sensor (use at most %.3g)",
                           mm_per_px, COARSEST, COARSEST * sensor_mm);
}

weft_err weft_plane_grid_choose(weft_plane_grid *grid, const weft_camera *camera, weft_pixel_scale pixel,
                                double mm_per_px, double height_mm, weft_error *err)
{
    double sensor_mm;
    WEFT_TRY(weft_plane_scale(camera, pixel, height_mm, &sensor_mm, err));
    if (!(mm_per_px > 0))
        mm_per_px = sensor_mm;
    WEFT_TRY(refuse_coarse(mm_per_px, sensor_mm, err));
    return weft_plane_grid_init(grid, camera, mm_per_px, height_mm, err);
}

/* Lanczos kernel of three lobes at distances 0, 1/256, ... 3 and one past the end. */
typedef struct kernel {
    float value[LOBES * STEPS + 2];
} kernel;

static void kernel_init(kernel *k)
{
    for (int i = 0; i < LOBES * STEPS + 2; i++) {
        const double x = pi * i / STEPS;
        k->value[i] = i == 0 ? 1 : i < LOBES * STEPS ? (float)(sin(x) / x * sin(x / LOBES) / (x / LOBES)) : 0;
    }
}

static float kernel_at(const kernel *k, double distance)
{
    const double x = fabs(distance) * STEPS;
    if (x >= LOBES * STEPS)
        return 0;
    const int i = (int)x;
    const float t = (float)(x - i);
    return k->value[i] + t * (k->value[i + 1] - k->value[i]);
}

typedef struct rectify_job {
    const weft_maps *sensor;
    const weft_camera *camera;
    weft_pixel_scale pixel;
    const weft_plane_grid *grid;
    weft_maps *plane;
    kernel kernel;
    double widen; /* sensor pixels per grid pixel, at least 1 */
} rectify_job;

/* The taps along one axis: first index, number, weights that sum to 1. */
typedef struct taps {
    int first, n;
    float weight[TAPS_MAX];
} taps;

/* Adds `sign` times the integral of the samples from far left up to `x`, as weights of the samples.  A pixel
 * is the mean over its area, so the integral is known exactly at the borders between pixels; between borders
 * it is interpolated by the kernel. */
static void add_integral(const kernel *k, double x, float sign, taps *t)
{
    const int border = (int)floor(x + 0.5); /* pixel whose area x lies in */
    float near[2 * LOBES + 1], sum = 0;
    const int first = border - LOBES; /* lower border of pixel i is at i - 0.5 */
    for (int i = 0; i <= 2 * LOBES; i++) {
        near[i] = kernel_at(k, x - (first + i - 0.5));
        sum += near[i];
    }
    float passed = 0;                     /* of the weight of all borders: those above pixel i */
    for (int i = 2 * LOBES; i > 1; i--) { /* the kernel is 0 at i = 0, so from i = 1 on all is passed */
        passed += near[i] / sum;
        t->weight[first + i - 1 - t->first] += sign * passed;
    }
    for (int i = t->first; i <= first; i++)
        t->weight[i - t->first] += sign;
}

/* The mean over [at - widen / 2, at + widen / 2]. */
static taps make_taps(const rectify_job *job, double at)
{
    taps t = {0};
    float sum = 0;
    const double a = at - 0.5 * job->widen, b = at + 0.5 * job->widen;
    t.first = (int)floor(a + 0.5) - LOBES + 1;
    t.n = (int)floor(b + 0.5) + LOBES - t.first;
    assert(t.n <= TAPS_MAX);
    add_integral(&job->kernel, b, 1, &t);
    add_integral(&job->kernel, a, -1, &t);
    for (int i = 0; i < t.n; i++)
        sum += t.weight[i];
    for (int i = 0; i < t.n; i++)
        t.weight[i] /= sum;
    return t;
}

static bool all_answered(const weft_mask *mask, const taps *x, const taps *y)
{
    if (x->first < 0 || y->first < 0 || x->first + x->n > mask->width || y->first + y->n > mask->height)
        return false;
    for (int j = 0; j < y->n; j++) {
        const uint8_t *const row = mask->data + (size_t)(y->first + j) * (size_t)mask->width + x->first;
        uint8_t all = 255;
        for (int i = 0; i < x->n; i++)
            all &= row[i];
        if (all != 255)
            return false;
    }
    return true;
}

/* The value of a plane under the taps. */
static float filter(const weft_image *image, int plane, const taps *x, const taps *y)
{
    float sum = 0;
    for (int j = 0; j < y->n; j++) {
        const float *const row = weft_image_row(image, plane, y->first + j) + x->first;
        float line = 0;
        for (int i = 0; i < x->n; i++)
            line += x->weight[i] * row[i];
        sum += y->weight[j] * line;
    }
    return sum;
}

/* Keeps a filtered value within those of the nearest four: the kernel's lobes would ring where a dark yarn
 * meets a light one, down to below black. */
static float within_nearest(const weft_image *image, int plane, int u0, int v0, float value)
{
    const float *const top = weft_image_row(image, plane, v0) + u0;
    const float *const bottom = weft_image_row(image, plane, v0 + 1) + u0;
    const float least = fminf(fminf(top[0], top[1]), fminf(bottom[0], bottom[1]));
    const float most = fmaxf(fmaxf(top[0], top[1]), fmaxf(bottom[0], bottom[1]));
    return fminf(fmaxf(value, least), most);
}

/* Linear weights of the nearest four that have an answer; false when the nearest one has none. */
static bool near_weights(const weft_mask *mask, double u, double v, int *u0, int *v0, float weight[4])
{
    const double u_in = fmin(fmax(u, 0), mask->width - 1), v_in = fmin(fmax(v, 0), mask->height - 1);
    if (fabs(u - u_in) > 0.5 || fabs(v - v_in) > 0.5) /* outside what any pixel covers */
        return false;
    const size_t nearest = (size_t)lround(v_in) * (size_t)mask->width + (size_t)lround(u_in);
    if (!mask->data[nearest])
        return false;
    *u0 = (int)u_in < mask->width - 2 ? (int)u_in : mask->width - 2;
    *v0 = (int)v_in < mask->height - 2 ? (int)v_in : mask->height - 2;
    const float a = (float)(u_in - *u0), b = (float)(v_in - *v0);
    const float linear[4] = {(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b};
    float sum = 0;
    for (int i = 0; i < 4; i++) {
        const size_t at = (size_t)(*v0 + i / 2) * (size_t)mask->width + (size_t)(*u0 + i % 2);
        weight[i] = mask->data[at] ? linear[i] : 0;
        sum += weight[i];
    }
    for (int i = 0; i < 4; i++)
        weight[i] /= sum;
    return sum > 0;
}

static float near_value(const weft_image *image, int plane, int u0, int v0, const float weight[4])
{
    const float *const top = weft_image_row(image, plane, v0) + u0;
    const float *const bottom = weft_image_row(image, plane, v0 + 1) + u0;
    return weight[0] * top[0] + weight[1] * top[1] + weight[2] * bottom[0] + weight[3] * bottom[1];
}

/* One pixel of the grid that lies at (u, v) among the solved pixels. */
static bool resample(const rectify_job *job, double u, double v, float normal_albedo[PLANES],
                     float quality[3], size_t *nearest)
{
    const weft_maps *const s = job->sensor;
    int u0, v0;
    float near[4];
    if (!near_weights(&s->mask, u, v, &u0, &v0, near))
        return false;
    quality[0] = near_value(&s->residual, 0, u0, v0, near);
    quality[1] = near_value(&s->confidence, 0, u0, v0, near);
    quality[2] = s->uncertainty.planes ? near_value(&s->uncertainty, 0, u0, v0, near) : 0;
    int most = 0;
    for (int i = 1; i < 4; i++)
        most = near[i] > near[most] ? i : most;
    *nearest = (size_t)(v0 + most / 2) * (size_t)s->mask.width + (size_t)(u0 + most % 2);
    const taps x = make_taps(job, u), y = make_taps(job, v);
    const bool whole = all_answered(&s->mask, &x, &y);
    for (int p = 0; p < PLANES; p++) {
        const weft_image *const image = p < 3 ? &s->normal : &s->albedo;
        normal_albedo[p] = whole ? filter(image, p % 3, &x, &y) : near_value(image, p % 3, u0, v0, near);
    }
    for (int p = 3; p < PLANES && whole && job->widen <= 1; p++)
        normal_albedo[p] = within_nearest(&s->albedo, p - 3, u0, v0, normal_albedo[p]);
    float *const n = normal_albedo;
    const float length = sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    if (!(length > 0))
        return false;
    for (int p = 0; p < 3; p++)
        n[p] /= length;
    return true;
}

static void rectify_rows(void *context, int band, int row_begin, int row_end)
{
    const rectify_job *const job = context;
    const weft_plane_grid *const g = job->grid;
    weft_maps *const to = job->plane;
    (void)band;
    for (int j = row_begin; j < row_end; j++)
        for (int i = 0; i < g->width; i++) {
            const weft_vec3 point = {(i - 0.5 * (g->width - 1)) * g->mm_per_px,
                                     (0.5 * (g->height - 1) - j) * g->mm_per_px, g->height_mm};
            double u, v;
            float value[PLANES], quality[3];
            size_t nearest;
            if (!weft_camera_project(job->camera, point, &u, &v) ||
                !resample(job, (u - job->pixel.offset) / job->pixel.scale,
                          (v - job->pixel.offset) / job->pixel.scale, value, quality, &nearest))
                continue;
            const size_t at = (size_t)j * (size_t)g->width + (size_t)i;
            for (int p = 0; p < 3; p++) {
                weft_image_row(&to->normal, p, j)[i] = value[p];
                weft_image_row(&to->albedo, p, j)[i] = value[3 + p];
            }
            weft_image_row(&to->residual, 0, j)[i] = quality[0];
            weft_image_row(&to->confidence, 0, j)[i] = quality[1];
            if (to->uncertainty.planes)
                weft_image_row(&to->uncertainty, 0, j)[i] = quality[2];
            if (to->lights.data)
                to->lights.data[at] = job->sensor->lights.data[nearest];
            if (to->quality.data)
                to->quality.data[at] = job->sensor->quality.data[nearest];
            to->mask.data[at] = 255;
        }
}

/* The maps that `sensor` has. */
static weft_err make_images(weft_maps *maps, const weft_maps *sensor, int width, int height, weft_error *err)
{
    WEFT_TRY(weft_image_init(&maps->normal, width, height, 3, err));
    WEFT_TRY(weft_image_init(&maps->albedo, width, height, 3, err));
    WEFT_TRY(weft_image_init(&maps->residual, width, height, 1, err));
    WEFT_TRY(weft_image_init(&maps->confidence, width, height, 1, err));
    if (sensor->uncertainty.planes)
        WEFT_TRY(weft_image_init(&maps->uncertainty, width, height, 1, err));
    if (sensor->lights.data)
        WEFT_TRY(weft_mask_init(&maps->lights, width, height, 0, err));
    if (sensor->quality.data)
        WEFT_TRY(weft_mask_init(&maps->quality, width, height, 0, err));
    return weft_mask_init(&maps->mask, width, height, 0, err);
}

weft_err weft_rectify(const weft_maps *sensor, const weft_camera *camera, weft_pixel_scale pixel,
                      const weft_plane_grid *grid, weft_maps *plane, weft_error *err)
{
    double sensor_mm;
    WEFT_TRY(weft_plane_scale(camera, pixel, grid->height_mm, &sensor_mm, err));
    rectify_job job = {sensor, camera, pixel, grid, plane, {{0}}, fmax(1, grid->mm_per_px / sensor_mm)};
    WEFT_TRY(refuse_coarse(grid->mm_per_px, sensor_mm, err));
    if (sensor->width < 2 || sensor->height < 2)
        return weft_fail(err, WEFT_ERR_RANGE, "%d x %d pixels are too few to resample", sensor->width,
                         sensor->height);
    kernel_init(&job.kernel);
    weft_maps to = {
        .width = grid->width,
        .height = grid->height,
        .geometry = WEFT_GEOMETRY_PLANE,
        .mm_per_px = grid->mm_per_px,
        .origin_mm = {-0.5 * (grid->width - 1) * grid->mm_per_px, 0.5 * (grid->height - 1) * grid->mm_per_px},
        .albedo_is_srgb = sensor->albedo_is_srgb};
    job.plane = &to;
    weft_err status = make_images(&to, sensor, grid->width, grid->height, err);
    if (status == WEFT_OK)
        status = weft_parallel_rows_progress(grid->height, rectify_rows, &job, "rectifying", err);
    if (status == WEFT_OK)
        *plane = to;
    else
        weft_maps_fini(&to);
    return status;
}
