/** The points that stand for area lights (area_light.h), over weft_real for loops that become vector code. */
#ifndef WEFT_SHADING_LIGHTING_REPRESENTATIVE_H
#define WEFT_SHADING_LIGHTING_REPRESENTATIVE_H

#include "shading/brdf/real.h"

/** What stands for an area light at one place of the surface. */
typedef struct weft_representative {
    weft_real l[3];  /* unit vector to the representative point */
    weft_real alpha; /* widened width, for the normalisation only: D keeps the material's */
    weft_real norm;  /* factor on the specular term */
} weft_representative;

WEFT_INLINE weft_real weft_dot3(const weft_real a[3], const weft_real b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

WEFT_INLINE weft_real weft_clamp01(weft_real x)
{
    return x > 0 ? (x < 1 ? x : 1) : 0;
}

/** Width of a GGX lobe widened by the light's size; 1 at distance 0.  Source: Karis 2013 eq. 10; S-UE4-15. */
WEFT_INLINE weft_real weft_widened_alpha(weft_real alpha, weft_real half_size, weft_real distance)
{
    const weft_real far = distance > 0 ? distance : 1, wide = weft_clamp01(alpha + half_size / (3 * far));
    return distance > 0 ? wide : 1;
}

WEFT_INLINE void weft_representative_aim(weft_representative *point, const weft_real p[3], weft_real length)
{
    const weft_real inverse = length > 0 ? 1 / (length > 0 ? length : 1) : 0;
    point->l[0] = p[0] * inverse;
    point->l[1] = p[1] * inverse;
    point->l[2] = p[2] * inverse;
}

/** Of a sphere: weft_light_sphere().  Source: Karis 2013 eqs. 11, 14; S-UE4-16. */
WEFT_INLINE weft_representative weft_representative_sphere(const weft_real to_centre[3], const weft_real r[3],
                                                           weft_real radius, weft_real alpha)
{
    const weft_real along = weft_dot3(to_centre, r);
    const weft_real c[3] = {along * r[0] - to_centre[0], along * r[1] - to_centre[1],
                            along * r[2] - to_centre[2]};
    const weft_real length = weft_sqrt(weft_dot3(c, c)), safe = length > 0 ? length : 1;
    const weft_real share = length > 0 ? weft_clamp01(radius / safe) : 0;
    const weft_real p[3] = {to_centre[0] + c[0] * share, to_centre[1] + c[1] * share,
                            to_centre[2] + c[2] * share};
    weft_representative point;
    weft_representative_aim(&point, p, weft_sqrt(weft_dot3(p, p)));
    point.alpha = weft_widened_alpha(alpha, radius, weft_sqrt(weft_dot3(to_centre, to_centre)));
    const weft_real ratio = alpha / point.alpha;
    point.norm = ratio * ratio;
    return point;
}

/** Of a tube from l0 to l1: weft_light_tube_of(); `t` gets the place along it.
 *  Source: Karis 2013 eqs. 17-20; S-UE4-17. */
WEFT_INLINE weft_representative weft_representative_tube(const weft_real l0[3], const weft_real l1[3],
                                                         const weft_real r[3], weft_real alpha, weft_real *t)
{
    const weft_real d[3] = {l1[0] - l0[0], l1[1] - l0[1], l1[2] - l0[2]};
    const weft_real d2 = weft_dot3(d, d), rd = weft_dot3(r, d), below = d2 - rd * rd;
    const weft_real nearer = weft_dot3(l0, l0) <= weft_dot3(l1, l1) ? WEFT_R(0.0) : WEFT_R(1.0);
    const weft_real safe = below > 0 ? below : 1;
    const weft_real distance = below > 0 ? (weft_dot3(r, l0) * rd - weft_dot3(l0, d)) / safe : nearer;
    const weft_real at = weft_clamp01(distance);
    const weft_real p[3] = {l0[0] + at * d[0], l0[1] + at * d[1], l0[2] + at * d[2]};
    const weft_real length = weft_sqrt(weft_dot3(p, p));
    weft_representative point;
    weft_representative_aim(&point, p, length);
    point.alpha = weft_widened_alpha(alpha, weft_sqrt(d2) / 2, length);
    point.norm = alpha / point.alpha;
    *t = distance;
    return point;
}

#endif
