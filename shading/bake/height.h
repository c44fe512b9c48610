/** Height of a surface from its normals by least squares (S-COD-10). */
#ifndef WEFT_SHADING_BAKE_HEIGHT_H
#define WEFT_SHADING_BAKE_HEIGHT_H

#include "core/error.h"

/** Slopes are cut here (normals with n_z <= 0.01). */
#define WEFT_HEIGHT_MAX_SLOPE 100

/** Slope -n_x/n_z along x (or y with n_y) of a normal, in height per texel, within WEFT_HEIGHT_MAX_SLOPE. */
double weft_height_slope(double n_across, double n_z);

/**
 * Height of a map that repeats, from the slope of each texel to its neighbours:
 *
 *     dx[y][x] = H(x + 1, y) - H(x, y),   dy[y][x] = H(x, y + 1) - H(x, y)
 *
 * The least-squares surface where no surface has just these slopes; its mean is 0.  Solves
 *
 *     4 H(x,y) = H(x-1,y) + dx(x-1,y) + H(x+1,y) - dx(x,y) + H(x,y-1) + dy(x,y-1) + H(x,y+1) - dy(x,y)
 *
 * (the printed form adds the slopes to the right and lower neighbour, and would tilt a ramp) by relaxation on
 * grids of half, quarter, ... size.  Slopes at the middle of texels: pass (dx(x) + dx(x+1))/2.
 *
 * @param dx, dy  [h][w], in the unit of height
 * @param height  [h][w]
 * @param tolerance  largest change of the last round, in the unit of height; 1e-4 of a texel for pictures
 * @return WEFT_ERR_NOMEM; WEFT_ERR_FORMAT when slopes are not finite
 * Source: Chan 2018 pages 38-39; S-COD-10.
 */
weft_err weft_height_from_slopes(int w, int h, const double *dx, const double *dy, double tolerance,
                                 double *height, weft_error *err);

#endif
