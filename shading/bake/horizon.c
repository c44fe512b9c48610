#include "shading/bake/horizon.h"

#include <math.h>

#define PI 3.14159265358979323846

weft_horizon_arc weft_horizon_clamp(weft_horizon_arc arc, double gamma_rad)
{
    return (weft_horizon_arc){gamma_rad + fmax(arc.h1_rad - gamma_rad, -PI / 2),
                              gamma_rad + fmin(arc.h2_rad - gamma_rad, PI / 2)};
}

static double half_arc(double h_rad, double gamma_rad)
{
    /* cos(gamma) - cos(2h - gamma) = 2 sin(h) sin(h - gamma): no cancellation near h = 0 */
    return 0.25 * (2 * sin(h_rad) * sin(h_rad - gamma_rad) + 2 * h_rad * sin(gamma_rad));
}

double weft_horizon_visibility(weft_horizon_arc clamped, double gamma_rad)
{
    return half_arc(clamped.h1_rad, gamma_rad) + half_arc(clamped.h2_rad, gamma_rad);
}

double weft_horizon_occlusion(weft_horizon_fn *fn, void *context, const double n[3], int n_slices)
{
    double sum = 0;
    for (int i = 0; i < n_slices; i++) {
        const double phi = PI * (i + 0.5) / n_slices;
        const double along = n[0] * cos(phi) + n[1] * sin(phi);
        const double gamma = atan2(along, n[2]);
        sum +=
            hypot(along, n[2]) * weft_horizon_visibility(weft_horizon_clamp(fn(context, phi), gamma), gamma);
    }
    return sum / n_slices;
}
