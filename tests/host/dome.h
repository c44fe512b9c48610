/** A scanner for the tests of the solver: camera, ten lights, and what they show, from formulas of its own.
 */
#ifndef WEFT_TESTS_HOST_DOME_H
#define WEFT_TESTS_HOST_DOME_H

#include "calibration/calibration.h"

/**
 * Camera 600 mm over the table with a field of 154 mm across, tilted, rolled and with a lens; ten lights on
 * a dome of 300 mm, six at 35 degrees, three at 60, one at 80, jittered, each with its own lobe and tint.
 */
void dome_init(weft_calibration *cal, int width, int height);

/** World point under a pixel on the plane z = height_mm, by bisection of the forward model. */
void dome_point(const weft_camera *camera, double u, double v, double height_mm, double point[3]);

/** Linear value of a Lambertian patch: formats.md, "Then I = albedo * intensity * a(theta) * (n.l) / r^2". */
double dome_radiance(const weft_light *light, int channel, const double point[3], const double normal[3],
                     double albedo);

/** Angle between two vectors in degrees. */
double dome_angle_deg(const double a[3], const double b[3]);

#endif
