#include "host/solve/incidence.h"

#include "calibration/lens/lens_model.h"
#include "calibration/lights/light_model.h"
#include "core/mem.h"
#include "core/parallel.h"
#include "host/solve/samples.h"

#include <math.h>
#include <string.h>

typedef struct lattice {
    weft_incidence *to;
    const weft_calibration *cal;
    weft_pixel_scale pixel;
    bool near;
    int width, height;
} lattice;

/* One light and channel: the reciprocal of what a white patch facing the light would read. */
static float reciprocal_strength(const lattice *l, int light, int channel, double at, double u, double v)
{
    const double strength =
        l->cal->lights[light].intensity[channel] * at * weft_light_grid_gain(l->cal, light, channel, u, v);
    return strength > 0 ? (float)(1 / strength) : NAN;
}

static float over_distance(const weft_light *light, weft_vec3 point)
{
    return light->distant ? 1.0F : (float)(1 / weft_length(weft_sub(light->position, point)));
}

/* The planes of a node at solved pixel (i, j), which lies in the frame. */
static void evaluate(const lattice *l, double i, double j, float *planes)
{
    const double u = l->pixel.scale * i + l->pixel.offset, v = l->pixel.scale * j + l->pixel.offset;
    weft_vec3 point = {0, 0, l->to->height_mm}, to_light;
    if (l->near && !weft_camera_to_plane(&l->cal->camera, u, v, l->to->height_mm, &point))
        point = (weft_vec3){NAN, NAN, NAN};
    planes[0] = (float)point.x;
    planes[1] = (float)point.y;
    for (int light = 0; light < l->to->n_lights; light++) {
        const double at = weft_light_at(&l->cal->lights[light], point, &to_light);
        for (int c = 0; c < 3; c++)
            planes[WEFT_INCIDENCE_STRENGTH(light, c)] = reciprocal_strength(l, light, c, at, u, v);
        planes[WEFT_INCIDENCE_OVER_DISTANCE(light)] = over_distance(&l->cal->lights[light], point);
    }
}

/* Past the edge of the frame the lens model may fold over: there the last two nodes are carried on
 * straight, which leaves the interpolation inside the frame what it would be. */
static void extrapolate(const lattice *l, double i, double j, float *planes)
{
    const double last_i = l->width - 1, last_j = l->height - 1;
    const double edge_i = fmin(i, last_i), edge_j = fmin(j, last_j);
    const double inner_i = fmax(2 * edge_i - i, 0), inner_j = fmax(2 * edge_j - j, 0);
    evaluate(l, edge_i, edge_j, planes);
    if (edge_i == i && edge_j == j)
        return;
    float inner[WEFT_INCIDENCE_PLANES(WEFT_LIGHTS_MAX)] = {0};
    evaluate(l, inner_i, inner_j, inner);
    const double reach = hypot(edge_i - inner_i, edge_j - inner_j), past = hypot(i - edge_i, j - edge_j);
    const float t = reach > 0 ? (float)(past / reach) : 0;
    for (int p = 0; p < WEFT_INCIDENCE_PLANES(l->to->n_lights); p++)
        planes[p] += t * (planes[p] - inner[p]);
}

static void fill_rows(void *context, int band, int row_begin, int row_end)
{
    const lattice *const l = context;
    const weft_incidence *const to = l->to;
    (void)band;
    for (int row = row_begin; row < row_end; row++)
        for (int column = 0; column < to->columns; column++)
            extrapolate(l, ldexp(column, to->step_log2), ldexp(row, to->step_log2),
                        to->nodes +
                            ((size_t)row * (size_t)to->columns + (size_t)column) * (size_t)to->stride);
}

/* The largest step whose error is below the bound of the header. */
static int choose_step_log2(const lattice *l, double height_mm)
{
    const double u = 0.5 * (l->cal->camera.width - 1), v = 0.5 * (l->cal->camera.height - 1);
    weft_vec3 middle, beside;
    if (!l->near || !weft_camera_to_plane(&l->cal->camera, u, v, height_mm, &middle) ||
        !weft_camera_to_plane(&l->cal->camera, u + l->pixel.scale, v, height_mm, &beside))
        return 4;
    double nearest_mm = INFINITY;
    for (int j = 0; j < l->cal->n_lights; j++)
        if (!l->cal->lights[j].distant)
            nearest_mm = fmin(nearest_mm, weft_length(weft_sub(l->cal->lights[j].position, middle)));
    const double pixel_mm = weft_length(weft_sub(beside, middle));
    int step_log2 = 4;
    while (step_log2 > 0 && ldexp(pixel_mm, step_log2) > nearest_mm / 120)
        step_log2--;
    return step_log2;
}

static void copy_lights(weft_incidence *to, const weft_calibration *cal)
{
    for (int j = 0; j < cal->n_lights; j++) {
        const weft_light *const light = &cal->lights[j];
        const weft_vec3 at = light->distant ? weft_normalise(light->direction) : light->position;
        to->distant[j] = light->distant;
        to->light[j][0] = (float)at.x;
        to->light[j][1] = (float)at.y;
        to->light[j][2] = (float)at.z;
    }
}

/* The world point that the camera's frame puts at its origin: -R^T t. */
static void place_eye(weft_incidence *to, const weft_calibration *cal)
{
    to->has_eye = cal->has_camera && cal->camera.has_pose;
    if (!to->has_eye)
        return;
    const weft_mat3 back = weft_mat3_transpose(&cal->camera.rotation);
    const weft_vec3 eye = weft_scale(weft_mat3_apply(&back, cal->camera.translation), -1);
    to->eye[0] = (float)eye.x;
    to->eye[1] = (float)eye.y;
    to->eye[2] = (float)eye.z;
}

static bool any_near(const weft_calibration *cal)
{
    for (int j = 0; j < cal->n_lights; j++)
        if (!cal->lights[j].distant)
            return true;
    return false;
}

weft_err weft_incidence_init(weft_incidence *incidence, const weft_calibration *cal, int width, int height,
                             weft_pixel_scale pixel, double height_mm, weft_error *err)
{
    weft_incidence to = {.n_lights = cal->n_lights, .height_mm = (float)height_mm};
    lattice l = {&to, cal, pixel, any_near(cal), width, height};
    if (l.near && !(cal->has_camera && cal->camera.has_pose))
        return weft_fail(err, WEFT_ERR_MISSING,
                         "near lights need the camera's pose to know where a pixel lies "
                         "(run \"weft calibrate lens ... --board-on-table IMAGE\")");
    to.step_log2 = choose_step_log2(&l, height_mm);
    const int blocks = (width + WEFT_SOLVE_LANES - 1) / WEFT_SOLVE_LANES;
    to.columns = (blocks * WEFT_SOLVE_LANES >> to.step_log2) + 1;
    to.rows = ((height - 1) >> to.step_log2) + 2;
    to.stride = (WEFT_INCIDENCE_PLANES(cal->n_lights) + 15) / 16 * 16;
    to.nodes = weft_alloc((size_t)to.columns * (size_t)to.rows * (size_t)to.stride, sizeof *to.nodes, err);
    if (!to.nodes)
        return WEFT_ERR_NOMEM;
    copy_lights(&to, cal);
    place_eye(&to, cal);
    weft_parallel_rows(to.rows, fill_rows, &l);
    *incidence = to;
    return WEFT_OK;
}

void weft_incidence_fini(weft_incidence *incidence)
{
    weft_free(incidence->nodes);
    *incidence = (weft_incidence){0};
}
