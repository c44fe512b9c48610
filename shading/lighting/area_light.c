#include "shading/lighting/area_light.h"

#include "shading/lighting/representative.h"

double weft_light_falloff(double distance, double radius)
{
    const double share = distance / radius, window = weft_clamp01(1 - share * share * share * share);
    return window * window / (distance * distance + 1);
}

double weft_light_widened_alpha(double alpha, double half_size, double distance)
{
    return weft_widened_alpha(alpha, half_size, distance);
}

static weft_light_point point_of(const weft_representative *r)
{
    return (weft_light_point){{r->l[0], r->l[1], r->l[2]}, r->alpha, r->norm};
}

weft_light_point weft_light_sphere(const double to_centre[3], const double r[3], double radius, double alpha)
{
    const weft_representative point = weft_representative_sphere(to_centre, r, radius, alpha);
    return point_of(&point);
}

weft_light_tube weft_light_tube_of(const double l0[3], const double l1[3], const double r[3], double alpha)
{
    weft_light_tube tube;
    const weft_representative point = weft_representative_tube(l0, l1, r, alpha, &tube.smallest_distance);
    const double d[3] = {l1[0] - l0[0], l1[1] - l0[1], l1[2] - l0[2]};
    const double d2 = weft_dot3(d, d), r0 = weft_dot3(r, l0), rd = weft_dot3(r, d), d0 = weft_dot3(l0, d);
    const double l02 = weft_dot3(l0, l0), below = d0 * rd - d2 * r0;
    tube.smallest_angle = below != 0 ? (d0 * r0 - l02 * rd) / below : l02 <= weft_dot3(l1, l1) ? 0 : 1;
    tube.t = weft_clamp01(tube.smallest_distance);
    tube.point = point_of(&point);
    return tube;
}

double weft_light_tube_irradiance(const double l0[3], const double l1[3], const double n[3])
{
    const double a = sqrt(weft_dot3(l0, l0)), b = sqrt(weft_dot3(l1, l1));
    return (weft_dot3(n, l0) / a + weft_dot3(n, l1) / b) / (a * b + weft_dot3(l0, l1));
}

double weft_light_tube_irradiance_soft(const double l0[3], const double l1[3], const double n[3])
{
    const double a = sqrt(weft_dot3(l0, l0)), b = sqrt(weft_dot3(l1, l1));
    return 2 * weft_clamp01(weft_dot3(n, l0) / (2 * a) + weft_dot3(n, l1) / (2 * b)) /
           (a * b + weft_dot3(l0, l1) + 2);
}
