/** Luminance of the CIE standard sky and its projection to spherical harmonics (S-FC3-05 to S-FC3-07). */
#ifndef WEFT_SHADING_LIGHTING_SKY_H
#define WEFT_SHADING_LIGHTING_SKY_H

#include "shading/lighting/spherical_harmonics.h"

/**
 * The five numbers of a sky: gradation 1 + a e^(b/cos) from horizon to zenith and indicatrix
 * 1 + c (e^(d x) - e^(d pi/2)) + e cos^2 x around the sun.  b < 0.
 */
typedef struct weft_sky {
    double a, b, c, d, e;
} weft_sky;

/** The CIE's standard clear sky (type 12) and Far Cry 3's.  c is positive: the printed minus would make a
 *  black sun. */
extern const weft_sky weft_sky_cie_clear;
extern const weft_sky weft_sky_far_cry_3;

/** Angle between a sky element and the sun, in radians; keeps its digits when they are close. */
double weft_sky_sun_angle(double zenith_rad, double azimuth_rad, double sun_zenith_rad);

/**
 * Luminance of the element at zenith_rad (0..pi/2 and beyond, where the gradation stays that of the horizon)
 * and azimuth_rad from the sun, relative to the zenith: 1 there.
 *
 *     L/Lz = f(zenith) g(chi) / (f(0) g(sun zenith))
 *
 * Source: CIE S 011, Far Cry 3's first formula with e cos^2 outside of the bracket of c, where its
 * denominator has it; S-FC3-05.
 */
double weft_sky_relative_to_zenith(const weft_sky *sky, double zenith_rad, double azimuth_rad,
                                   double sun_zenith_rad);

/** The same relative to the sky at the sun: 1 there.  Source: S-FC3-06 (the left side is misprinted). */
double weft_sky_relative_to_sun(const weft_sky *sky, double zenith_rad, double azimuth_rad,
                                double sun_zenith_rad);

/**
 * Coefficients of the upper hemisphere's luminance relative to the sky at the sun; black below the horizon.
 *
 * @param sun_azimuth_rad  from x towards y
 * @param light            all nine to about 1e-13; a consumer of two bands takes the first four.  Irradiance:
 *                         weft_sh_convolve() with weft_sh_cosine.
 * Source: S-FC3-07.
 */
void weft_sky_project(const weft_sky *sky, double sun_zenith_rad, double sun_azimuth_rad,
                      double light[WEFT_SH_COUNT]);

#endif
