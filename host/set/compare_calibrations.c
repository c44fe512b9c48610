#include "calibration/lens/lens_model.h"
#include "calibration/lights/light_model.h"
#include "host/set/compare.h"

#include <math.h>

static const double degrees = 57.29577951308232;

/* Mean of x / y and its relative standard deviation, gathered one by one. */
typedef struct ratios {
    int n;
    double sum, squares;
} ratios;

static void add_ratio(ratios *r, double x, double y)
{
    if (!(x > 0) || !(y > 0))
        return;
    r->n++;
    r->sum += x / y;
    r->squares += x / y * (x / y);
}

static double ratio_mean(const ratios *r)
{
    return r->n ? r->sum / r->n : 0;
}

static double ratio_spread(const ratios *r)
{
    const double mean = ratio_mean(r);
    return mean > 0 ? sqrt(fmax(r->squares / r->n - mean * mean, 0)) / mean : 0;
}

static weft_vec3 direction_of(const weft_light *light)
{
    return weft_normalise(light->distant ? light->direction : light->position);
}

static void compare_lights(const weft_calibration *a, const weft_calibration *b,
                           weft_calibration_difference *d)
{
    const weft_vec3 origin = {0, 0, 0};
    ratios intensity = {0}, irradiance = {0};
    int n_near = 0;
    for (int j = 0; j < a->n_lights; j++) {
        const weft_light *const p = &a->lights[j], *const q = &b->lights[j];
        const double angle = weft_angle_between(direction_of(p), direction_of(q)) * degrees;
        weft_vec3 unused;
        d->direction_deg[0] += angle / a->n_lights;
        d->direction_deg[1] = fmax(d->direction_deg[1], angle);
        d->exponent_max = fmax(d->exponent_max, fabs(p->exponent - q->exponent));
        if (!p->distant && !q->distant) {
            const double off = weft_length(weft_sub(p->position, q->position));
            n_near++;
            d->position_mm[0] += off;
            if (off > d->position_mm[1]) {
                d->position_mm[1] = off;
                d->position_mm[2] = j;
            }
        } else
            d->has_distant = true;
        for (int c = 0; c < 3; c++) {
            add_ratio(&intensity, p->intensity[c], q->intensity[c]);
            add_ratio(&irradiance, p->intensity[c] * weft_light_at(p, origin, &unused),
                      q->intensity[c] * weft_light_at(q, origin, &unused));
        }
    }
    if (n_near)
        d->position_mm[0] /= n_near;
    d->intensity_ratio_mean = ratio_mean(&intensity);
    d->intensity_ratio_spread = ratio_spread(&intensity);
    d->irradiance_ratio_mean = ratio_mean(&irradiance);
    d->irradiance_ratio_spread = ratio_spread(&irradiance);
}

/* Where A's pixels land in B's picture by way of the plane z = 0. */
static void compare_projection(const weft_camera *a, const weft_camera *b, weft_calibration_difference *d)
{
    int n = 0;
    for (int i = 0; i < 81; i++) {
        const int column = i % 9, row = i / 9;
        const double u = (a->width - 1) * column / 8.0, v = (a->height - 1) * row / 8.0;
        weft_vec3 point;
        double x, y;
        if (!weft_camera_to_plane(a, u, v, 0, &point) || !weft_camera_project(b, point, &x, &y))
            continue;
        const double off = hypot(x - u, y - v);
        d->projection_px[0] += off;
        d->projection_px[1] = fmax(d->projection_px[1], off);
        n++;
    }
    if (n)
        d->projection_px[0] /= n;
}

static weft_err compare_cameras(const weft_camera *a, const weft_camera *b, weft_calibration_difference *d,
                                weft_error *err)
{
    if (a->width != b->width || a->height != b->height)
        return weft_fail(err, WEFT_ERR_MISMATCH,
                         "one calibration is for frames of %d x %d pixels, the other %d x %d", a->width,
                         a->height, b->width, b->height);
    d->focal_ratio = a->fx / b->fx;
    d->principal_px = hypot(a->cx - b->cx, a->cy - b->cy);
    if (!d->has_pose)
        return WEFT_OK;
    const double *const p = a->rotation.m, *const q = b->rotation.m;
    d->centre_mm = weft_length(weft_sub(weft_camera_centre(a), weft_camera_centre(b)));
    d->view_deg = weft_angle_between((weft_vec3){p[6], p[7], p[8]}, (weft_vec3){q[6], q[7], q[8]}) * degrees;
    compare_projection(a, b, d);
    return WEFT_OK;
}

weft_err weft_compare_calibrations(const weft_calibration *a, const weft_calibration *b,
                                   weft_calibration_difference *difference, weft_error *err)
{
    weft_calibration_difference d = {.has_lights = a->has_lights && b->has_lights,
                                     .has_camera = a->has_camera && b->has_camera,
                                     .has_colour = a->has_colour && b->has_colour};
    d.has_pose = d.has_camera && a->camera.has_pose && b->camera.has_pose;
    if (!d.has_lights && !d.has_camera && !d.has_colour)
        return weft_fail(err, WEFT_ERR_NODATA, "the calibrations have no part in common");
    if (d.has_lights && a->n_lights != b->n_lights)
        return weft_fail(err, WEFT_ERR_MISMATCH, "one calibration has %d lights, the other %d", a->n_lights,
                         b->n_lights);
    if (d.has_lights) {
        d.n_lights = a->n_lights;
        compare_lights(a, b, &d);
    }
    if (d.has_camera)
        WEFT_TRY(compare_cameras(&a->camera, &b->camera, &d, err));
    for (int i = 0; i < 9 && d.has_colour; i++)
        d.matrix_max = fmax(d.matrix_max, fabs(a->colour.model.matrix.m[i] - b->colour.model.matrix.m[i]));
    *difference = d;
    return WEFT_OK;
}
