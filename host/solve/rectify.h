/**
 * From sensor pixels to the sample plane: lens undistortion, pose and scale in one resampling.
 */
#ifndef WEFT_HOST_SOLVE_RECTIFY_H
#define WEFT_HOST_SOLVE_RECTIFY_H

#include "host/set/maps.h"
#include "host/solve/incidence.h"

/** A regular grid on the plane z = height_mm, symmetric about the world's z axis, an even number of pixels
 *  each way: pixel (i, j) has its centre at x = (i - (width - 1) / 2) mm_per_px, y up. */
typedef struct weft_plane_grid {
    int width, height;
    double mm_per_px, height_mm;
} weft_plane_grid;

/** Size of a sensor pixel on the sample at the middle of the frame, rounded to 3 significant digits. */
weft_err weft_plane_scale(const weft_camera *camera, weft_pixel_scale pixel, double height_mm,
                          double *mm_per_px, weft_error *err);

/** The smallest grid that holds all that the camera sees of the plane.
 *  @return WEFT_ERR_RANGE when it would be too large, saying which scale would do */
weft_err weft_plane_grid_init(weft_plane_grid *grid, const weft_camera *camera, double mm_per_px,
                              double height_mm, weft_error *err);

/** The grid of a wish: `mm_per_px` 0 takes the sensor's scale.
 *  @return what the two above say; WEFT_ERR_RANGE for more than 16 times as coarse as the sensor */
weft_err weft_plane_grid_choose(weft_plane_grid *grid, const weft_camera *camera, weft_pixel_scale pixel,
                                double mm_per_px, double height_mm, weft_error *err);

/**
 * Resamples maps in sensor geometry to the grid.
 *
 * A pixel is the mean over its area, on the sensor and on the grid.  So what is interpolated (by a Lanczos
 * kernel of three lobes) is the integral of unit normals and albedo, known exactly at the borders between
 * sensor pixels; a grid pixel is its difference, however coarse the grid.  The normals are made unit again;
 * residual, confidence and uncertainty are interpolated linearly, bits and numbers taken from the nearest.  A
 * pixel whose kernel touches one without an answer falls back to the answers among the nearest four; where
 * the nearest has none, or the camera does not look, there is no answer.
 *
 * @param sensor  maps with all four images and a mask, as solved
 * @param plane   gets images and mask, geometry, scale and origin; `info` stays NULL
 */
weft_err weft_rectify(const weft_maps *sensor, const weft_camera *camera, weft_pixel_scale pixel,
                      const weft_plane_grid *grid, weft_maps *plane, weft_error *err);

#endif
