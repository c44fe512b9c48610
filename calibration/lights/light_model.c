#include "calibration/lights/light_model.h"

double weft_light_at(const weft_light *light, weft_vec3 point, weft_vec3 *to_light)
{
    if (light->distant) {
        *to_light = light->direction;
        return 1;
    }
    const weft_vec3 d = weft_sub(light->position, point);
    const double r2 = weft_dot(d, d);
    *to_light = weft_normalise(d);
    const double cosine = -weft_dot(light->axis, *to_light);
    if (!(cosine > 0) || !(r2 > 0))
        return 0;
    return pow(cosine, light->exponent) / (r2 * 1e-6); /* mm^2 to m^2 */
}

/* Splits a pixel coordinate into node and fraction; outside, the nearest edge. */
static int node(double u, int pixels, int nodes, double *fraction)
{
    const double at = pixels > 1 ? fmin(fmax(u / (pixels - 1), 0), 1) * (nodes - 1) : 0;
    const int i = at < nodes - 2 ? (int)at : nodes - 2;
    *fraction = at - i;
    return i;
}

double weft_light_grid_gain(const weft_calibration *cal, int light, int channel, double u, double v)
{
    const weft_light_grid *const g = &cal->grid;
    if (g->columns < 2 || g->rows < 2)
        return 1;
    double a, b;
    const int i = node(u, cal->camera.width, g->columns, &a), j = node(v, cal->camera.height, g->rows, &b);
    const size_t plane = (size_t)(light * 3 + channel) * (size_t)(g->columns * g->rows);
    const float *const p = g->gain + plane + (size_t)(j * g->columns + i), *const q = p + g->columns;
    return (1 - b) * ((1 - a) * (double)p[0] + a * (double)p[1]) +
           b * ((1 - a) * (double)q[0] + a * (double)q[1]);
}
