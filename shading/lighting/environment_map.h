/**
 * Panoramas as light: irradiance by spherical harmonics, mirrored light by mips that are prefiltered with
 * GGX (S-UE4-07, S-UE4-08).
 *
 * Frame: z is up; the panorama is equirectangular, its top row the zenith, its middle column the direction
 * +y, its right half towards +x (as one sees who looks along +y with z up).
 */
#ifndef WEFT_SHADING_LIGHTING_ENVIRONMENT_MAP_H
#define WEFT_SHADING_LIGHTING_ENVIRONMENT_MAP_H

#include "core/image.h"
#include "shading/lighting/polariser.h"
#include "shading/lighting/sky.h"

/** Level l is filtered for the roughness l/(WEFT_ENVIRONMENT_LEVELS - 1), alpha its square. */
#define WEFT_ENVIRONMENT_LEVELS 8

typedef struct weft_environment_map {
    weft_image levels[WEFT_ENVIRONMENT_LEVELS]; /* 3 planes: radiance, linear BT.709 */
    double light[3][WEFT_SH_COUNT];             /* of the radiance, per channel */
} weft_environment_map;

/**
 * Filters a panorama; takes half a second.
 *
 * The kernel of a level is that of the split sum, normal and view along the direction looked up:
 * mean of L(l) over l = mirror of h drawn from GGX, weighted by n.l.  256 points of low discrepancy a texel,
 * each looking up the panorama's own mip whose texel is as large as the point's share of the sphere (Krivanek
 * and Colbert 2008), so that small bright lamps do not sparkle.
 *
 * @param panorama  1 or 3 planes; not finite or negative values count as 0
 */
weft_err weft_environment_map_init(weft_environment_map *map, const weft_image *panorama, weft_error *err);
/** The same behind a filter: its factor is on what is looked at and mirrored, not on the diffuse light. */
weft_err weft_environment_map_init_filtered(weft_environment_map *map, const weft_image *panorama,
                                            const weft_sky_filter *filter, weft_error *err);
void weft_environment_map_fini(weft_environment_map *map);

/** Paints a sky, black below the horizon, scaled so that a level white card reads 1 (irradiance pi).  The
 *  sun itself is not in it.  The azimuth counts from x towards y. */
weft_err weft_environment_paint_sky(weft_image *panorama, const weft_sky *sky, double sun_zenith_rad,
                                    double sun_azimuth_rad, weft_error *err);

/** Irradiance of a surface with the unit normal n, three bands; not below 0. */
void weft_environment_map_irradiance(const weft_environment_map *map, const double n[3], double e[3]);

/** Filtered radiance along a unit direction; between the levels linear in roughness (0..1). */
void weft_environment_map_look(const weft_environment_map *map, const double direction[3], double roughness,
                               double radiance[3]);

#endif
