/**
 * What a height field says of light: ambient occlusion with the bent cone, cavity and curvature.
 */
#ifndef WEFT_SHADING_BAKE_RELIEF_H
#define WEFT_SHADING_BAKE_RELIEF_H

#include "core/image.h"

/** How occlusion is searched for.  weft_relief_defaults() fills it. */
typedef struct weft_relief_options {
    double mm_per_px;
    double reach_mm; /* how far away relief can hide the sky */
    int slices;      /* directions over half a turn */
    bool periodic;
} weft_relief_options;

/** 2 mm, 8 slices, not periodic. */
weft_relief_options weft_relief_defaults(double mm_per_px);

/**
 * Ambient visibility and bent cone by horizons (S-COD-11, S-COD-12; Jimenez et al. 2016).
 *
 * In each slice the part of the sky that a height field leaves open is one arc: from the highest thing on one
 * side to the highest on the other, within the hemisphere of the normal.  Unlike in S-COD-11 the search
 * begins below the level horizon, so that an endless slope is open however it is tilted; the integral over
 * the arc is the closed form of S-COD-12.
 *
 * @param height     1 plane, mm
 * @param normal     3 planes, unit; NULL: from the height by central differences
 * @param occlusion  1 plane, initialised here: 0 closed to 1 open
 * @param cone       4 planes, initialised here: the mean open direction, cosine-weighted (unit), and the
 * cosine of the half angle of the cone that holds as much sky, sqrt(1 - V) (S-COD-16); NULL: not wanted
 */
weft_err weft_relief_occlusion(const weft_image *height, const weft_image *normal,
                               const weft_relief_options *options, weft_image *occlusion, weft_image *cone,
                               weft_error *err);

/**
 * Mean curvature in 1/mm, positive on ridges, from the divergence of the slopes of unit normals:
 * half the divergence of (x/z, y/z), by central differences.
 * @param curvature  1 plane, initialised here
 */
weft_err weft_relief_curvature(const weft_image *normal, double mm_per_px, bool periodic,
                               weft_image *curvature, weft_error *err);

/** A Gaussian blur of one plane, sigma in texels, edges repeated or wrapped.  @param out  initialised here */
weft_err weft_relief_blur(const weft_image *plane, double sigma_px, bool periodic, weft_image *out,
                          weft_error *err);

/**
 * Cavity: how far a texel lies below (towards 0) or above (towards 1) the mean of its surroundings, 0.5
 * level.
 *
 *     0.5 + 0.5 (h - blur(h)) / (2.5 sigma),  clamped; sigma the rms of h - blur(h)
 *
 * @param radius_mm  of the surroundings (a Gaussian of this sigma)
 * @param cavity     1 plane, initialised here
 */
weft_err weft_relief_cavity(const weft_image *height, double mm_per_px, double radius_mm, bool periodic,
                            weft_image *cavity, weft_error *err);

#endif
