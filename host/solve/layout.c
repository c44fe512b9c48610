#include "host/solve/layout.h"

#include "calibration/lights/light_model.h"
#include "core/csv.h"

#include <math.h>

enum { COLUMNS = 48, LEANINGS = 8 };

static const double degrees = 57.29577951308232;

void weft_layout_fini(weft_layout *layout)
{
    weft_image_fini(&layout->map);
}

/* ---- one point ---- */

static weft_vec3 map_point(const weft_image *map, const weft_layout_options *o, int column, int row)
{
    return (weft_vec3){((column + 0.5) / map->width - 0.5) * o->plate_mm[0],
                       (0.5 - (row + 0.5) / map->height) * o->plate_mm[1], 0};
}

/* Green is what the normal is seen by. */
static double light_strength(const weft_light *light, weft_vec3 point, weft_vec3 *to_light)
{
    return light->intensity[1] * weft_light_at(light, point, to_light);
}

double weft_layout_exposure(const weft_calibration *cal, const weft_layout_options *o)
{
    const weft_image grid = {.width = COLUMNS, .height = COLUMNS, .planes = 1};
    double most = 0;
    for (int j = 0; j < cal->n_lights; j++)
        for (int i = 0; i < COLUMNS * COLUMNS; i++) {
            weft_vec3 l;
            const weft_vec3 point = map_point(&grid, o, i % COLUMNS, i / COLUMNS);
            const double s = light_strength(&cal->lights[j], point, &l);
            most = fmax(most, s * fmax(l.z, 0));
        }
    return most > 0 ? o->fill / most : 0;
}

/* Adds weight l l^T. */
static void add_outer(weft_mat3 *to, weft_vec3 l, double weight)
{
    const double v[3] = {l.x, l.y, l.z};
    for (int i = 0; i < 9; i++)
        to->m[i] += weight * v[i / 3] * v[i % 3];
}

double weft_layout_sigma(const weft_calibration *cal, const weft_layout_options *o, double exposure,
                         weft_vec3 point, weft_vec3 normal, int skip)
{
    weft_mat3 a = {{0}}, noise = {{0}}, c;
    int n = 0;
    for (int j = 0; j < cal->n_lights; j++) {
        weft_vec3 l;
        const double s = j == skip ? 0 : exposure * light_strength(&cal->lights[j], point, &l);
        if (!(s > 0) || !(weft_dot(normal, l) > 0))
            continue;
        const double x = o->albedo * s * weft_dot(normal, l);
        const double variance = (pow(o->read_e / o->full_well_e, 2) + x / o->full_well_e) / (s * s);
        add_outer(&a, l, 1);
        add_outer(&noise, l, variance);
        n++;
    }
    /* three lights span 0.0025^2 of volume or more where the smallest singular value is 0.05 */
    if (n < 3 || !(weft_mat3_determinant(&a) > 1e-5) || !weft_mat3_invert(&a, &c))
        return (double)NAN;
    const weft_mat3 left = weft_mat3_multiply(&c, &noise), covariance = weft_mat3_multiply(&left, &c);
    const weft_vec3 along = weft_mat3_apply(&covariance, normal);
    const double trace = covariance.m[0] + covariance.m[4] + covariance.m[8];
    return sqrt(fmax(trace - weft_dot(normal, along), 0)) / o->albedo;
}

/* Variance over the leanings of the surface. */
static double variance_at(const weft_calibration *cal, const weft_layout_options *o, double exposure,
                          weft_vec3 point, int skip)
{
    const double tilt = o->tilt_deg / degrees;
    const int n = tilt > 0 ? LEANINGS : 1;
    double sum = 0;
    for (int i = 0; i < n; i++) {
        const double around = 6.283185307179586 * i / LEANINGS;
        const weft_vec3 normal = {sin(tilt) * cos(around), sin(tilt) * sin(around), cos(tilt)};
        const double sigma = weft_layout_sigma(cal, o, exposure, point, normal, skip);
        sum += sigma * sigma / n;
    }
    return sum;
}

/* ---- the plate ---- */

/* Root of the mean variance over the map, degrees; NaN when nothing is determined. */
static double survey(const weft_calibration *cal, const weft_layout_options *o, double exposure, int skip,
                     weft_image *map, double *max, double *undetermined)
{
    double sum = 0;
    int n = 0;
    const int all = map->width * map->height;
    *max = 0;
    for (int i = 0; i < all; i++) {
        const weft_vec3 point = map_point(map, o, i % map->width, i / map->width);
        const double variance = variance_at(cal, o, exposure, point, skip);
        if (skip < 0)
            map->data[i] = (float)(degrees * sqrt(variance));
        if (!isfinite(variance))
            continue;
        sum += variance;
        *max = fmax(*max, degrees * sqrt(variance));
        n++;
    }
    *undetermined = 1 - (double)n / all;
    return n > 0 ? degrees * sqrt(sum / n) : (double)NAN;
}

/* Noise of the directions alone: samples of one relative error as bright as a surface that faces the light.
 */
static double gain_in_the_middle(const weft_calibration *cal)
{
    weft_mat3 a = {{0}}, c;
    for (int j = 0; j < cal->n_lights; j++) {
        weft_vec3 l;
        (void)weft_light_at(&cal->lights[j], (weft_vec3){0, 0, 0}, &l);
        add_outer(&a, l, 1);
    }
    return weft_mat3_invert(&a, &c) ? sqrt(fmax(c.m[0] + c.m[4], 0)) : (double)NAN;
}

static double evenness_of(const weft_calibration *cal, const weft_layout_options *o, const weft_image *map)
{
    double worst = 1;
    for (int j = 0; j < cal->n_lights; j++) {
        double least = INFINITY, most = 0;
        for (int i = 0; i < map->width * map->height; i++) {
            weft_vec3 l;
            const weft_vec3 point = map_point(map, o, i % map->width, i / map->width);
            const double s = light_strength(&cal->lights[j], point, &l) * fmax(l.z, 0);
            least = fmin(least, s);
            most = fmax(most, s);
        }
        worst = fmin(worst, most > 0 ? least / most : 0);
    }
    return worst;
}

weft_err weft_layout_predict(const weft_calibration *cal, const weft_layout_options *o, weft_layout *layout,
                             weft_error *err)
{
    const double exposure = weft_layout_exposure(cal, o);
    const double rows = COLUMNS * o->plate_mm[1] / o->plate_mm[0];
    weft_layout l = {0};
    WEFT_TRY(weft_image_init(&l.map, COLUMNS, (int)fmin(fmax(rows, 2), 10 * COLUMNS), 1, err));
    l.mean = survey(cal, o, exposure, -1, &l.map, &l.max, &l.undetermined);
    l.middle = degrees * sqrt(variance_at(cal, o, exposure, (weft_vec3){0, 0, 0}, -1));
    l.gain = gain_in_the_middle(cal);
    l.evenness = evenness_of(cal, o, &l.map);
    for (int j = 0; j < cal->n_lights; j++) {
        double max, undetermined;
        l.without[j] = survey(cal, o, exposure, j, &l.map, &max, &undetermined);
        if (undetermined > l.undetermined)
            l.without[j] = (double)NAN;
    }
    if (l.undetermined >= 1) {
        weft_layout_fini(&l);
        return weft_fail(
            err, WEFT_ERR_NODATA,
            "these lights do not determine a normal anywhere on the plate (three must shine there, "
            "not in a plane)");
    }
    *layout = l;
    return WEFT_OK;
}

/* ---- the table ---- */

static weft_err read_light(const weft_csv *csv, int row, const char *path, weft_light *light, weft_error *err)
{
    static const char *const names[] = {"x_mm", "y_mm", "z_mm"};
    const int power = weft_csv_column(csv, "power"), exponent = weft_csv_column(csv, "exponent");
    double at[3], intensity = 1;
    *light = (weft_light){.exponent = 1, .white_balance = {1, 1, 1}};
    for (int i = 0; i < 3; i++) {
        const int column = weft_csv_column(csv, names[i]);
        if (column < 0)
            return weft_fail(err, WEFT_ERR_FORMAT, "%s: there is no column %s (wanted: x_mm, y_mm, z_mm)",
                             path, names[i]);
        WEFT_TRY(weft_csv_number(csv, row, column, path, &at[i], err));
    }
    if (power >= 0)
        WEFT_TRY(weft_csv_number(csv, row, power, path, &intensity, err));
    if (exponent >= 0)
        WEFT_TRY(weft_csv_number(csv, row, exponent, path, &light->exponent, err));
    light->position = (weft_vec3){at[0], at[1], at[2]};
    if (!(at[2] > 1) || fmax(fabs(at[0]), fmax(fabs(at[1]), at[2])) > 1e5 || !(intensity > 0) ||
        light->exponent < 0 || light->exponent > 1000)
        return weft_fail(
            err, WEFT_ERR_RANGE,
            "%s: row %d: a light lies 1 mm to 100 m over the plate (z_mm), its power is above 0, its "
            "exponent 0 to 1000",
            path, row + 1);
    light->axis = weft_normalise(weft_scale(light->position, -1));
    for (int c = 0; c < 3; c++)
        light->intensity[c] = intensity;
    return WEFT_OK;
}

weft_err weft_layout_read(const char *path, weft_calibration *cal, weft_error *err)
{
    weft_csv csv;
    WEFT_TRY(weft_csv_read(path, &csv, err));
    weft_err status = WEFT_OK;
    weft_calibration_init(cal);
    if (csv.rows < 3 || csv.rows > WEFT_LIGHTS_MAX)
        status = weft_fail(err, WEFT_ERR_RANGE, "%s: has %d lights; 3 to %d are wanted", path, csv.rows,
                           WEFT_LIGHTS_MAX);
    for (int row = 0; row < csv.rows && status == WEFT_OK; row++)
        status = read_light(&csv, row, path, &cal->lights[row], err);
    if (status == WEFT_OK) {
        cal->n_lights = csv.rows;
        cal->has_lights = true;
    }
    weft_csv_fini(&csv);
    return status;
}
