/** Phase function for light in haze (S-BLG-08). */
#ifndef WEFT_SHADING_LIGHTING_VOLUME_LIGHT_H
#define WEFT_SHADING_LIGHTING_VOLUME_LIGHT_H

#include <math.h>

/**
 * Henyey-Greenstein, per steradian; its integral over the sphere is 1.
 *
 *     p = (1 - g^2)/(4 pi (1 + g^2 - 2 g c)^(3/2))
 *
 * @param g       -1 < g < 1; above 0 light goes on forwards
 * @param cosine  between the ray from the eye and the direction to the sun, so that g > 0 glows around it
 * Source: Henyey and Greenstein 1941; S-BLG-08.
 */
static inline double weft_phase_henyey_greenstein(double g, double cosine)
{
    const double t = 1 + g * g - 2 * g * cosine;
    return (1 - g * g) / (4 * 3.14159265358979323846 * t * sqrt(t));
}

#endif
