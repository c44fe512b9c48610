#include "shading/lighting/area_light.h"

#include <math.h>

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double clamp01(double x)
{
    return x > 0 ? (x < 1 ? x : 1) : 0;
}

double weft_light_falloff(double distance, double radius)
{
    const double share = distance / radius, window = clamp01(1 - share * share * share * share);
    return window * window / (distance * distance + 1);
}

double weft_light_widened_alpha(double alpha, double half_size, double distance)
{
    return distance > 0 ? clamp01(alpha + half_size / (3 * distance)) : 1;
}

static void set_direction(weft_light_point *point, const double p[3])
{
    const double length = sqrt(dot(p, p));
    for (int c = 0; c < 3; c++)
        point->l[c] = length > 0 ? p[c] / length : 0;
}

weft_light_point weft_light_sphere(const double to_centre[3], const double r[3], double radius, double alpha)
{
    const double along = dot(to_centre, r);
    double c[3], p[3];
    weft_light_point point;
    for (int i = 0; i < 3; i++)
        c[i] = along * r[i] - to_centre[i];
    const double length = sqrt(dot(c, c)), share = length > 0 ? clamp01(radius / length) : 0;
    for (int i = 0; i < 3; i++)
        p[i] = to_centre[i] + c[i] * share;
    set_direction(&point, p);
    point.alpha = weft_light_widened_alpha(alpha, radius, sqrt(dot(to_centre, to_centre)));
    point.norm = alpha / point.alpha * (alpha / point.alpha);
    return point;
}

weft_light_tube weft_light_tube_of(const double l0[3], const double l1[3], const double r[3], double alpha)
{
    double d[3], p[3];
    weft_light_tube tube;
    for (int c = 0; c < 3; c++)
        d[c] = l1[c] - l0[c];
    const double d2 = dot(d, d), r0 = dot(r, l0), rd = dot(r, d), d0 = dot(l0, d), l02 = dot(l0, l0);
    const double angle_below = d0 * rd - d2 * r0, distance_below = d2 - rd * rd;
    const double nearer = l02 <= dot(l1, l1) ? 0 : 1;
    tube.smallest_angle = angle_below != 0 ? (d0 * r0 - l02 * rd) / angle_below : nearer;
    tube.smallest_distance = distance_below > 0 ? (r0 * rd - d0) / distance_below : nearer;
    tube.t = clamp01(tube.smallest_distance);
    for (int c = 0; c < 3; c++)
        p[c] = l0[c] + tube.t * d[c];
    set_direction(&tube.point, p);
    tube.point.alpha = weft_light_widened_alpha(alpha, sqrt(d2) / 2, sqrt(dot(p, p)));
    tube.point.norm = alpha / tube.point.alpha;
    return tube;
}

double weft_light_tube_irradiance(const double l0[3], const double l1[3], const double n[3])
{
    const double a = sqrt(dot(l0, l0)), b = sqrt(dot(l1, l1));
    return (dot(n, l0) / a + dot(n, l1) / b) / (a * b + dot(l0, l1));
}

double weft_light_tube_irradiance_soft(const double l0[3], const double l1[3], const double n[3])
{
    const double a = sqrt(dot(l0, l0)), b = sqrt(dot(l1, l1));
    return 2 * clamp01(dot(n, l0) / (2 * a) + dot(n, l1) / (2 * b)) / (a * b + dot(l0, l1) + 2);
}
