/** The camera as a map between the world and the picture (OpenCV's models: k1, k2, p1, p2, k3, and the
 * rational one with k4, k5, k6 below the line). */
#ifndef WEFT_CALIBRATION_LENS_LENS_MODEL_H
#define WEFT_CALIBRATION_LENS_LENS_MODEL_H

#include "calibration/calibration.h"

/** Distorts normalised coordinates (x_c / z_c, y_c / z_c). */
void weft_lens_distort(const double distortion[WEFT_DISTORTION], double x, double y, double *xd, double *yd);

/** Inverse of weft_lens_distort() by Newton's method, to 1e-12; false where the model folds over. */
bool weft_lens_undistort(const double distortion[WEFT_DISTORTION], double xd, double yd, double *x,
                         double *y);

/** World point (mm) to pixel.  False when it is behind the camera. */
bool weft_camera_project(const weft_camera *camera, weft_vec3 world, double *u, double *v);

/** Pixel to the viewing ray: origin is the camera's centre (mm, world), direction unit, world. */
bool weft_camera_ray(const weft_camera *camera, double u, double v, weft_vec3 *origin, weft_vec3 *direction);

/** Where the ray of a pixel meets the plane z = height_mm.  False when it does not. */
bool weft_camera_to_plane(const weft_camera *camera, double u, double v, double height_mm, weft_vec3 *world);

/** Centre of projection in the world, mm. */
weft_vec3 weft_camera_centre(const weft_camera *camera);

#endif
