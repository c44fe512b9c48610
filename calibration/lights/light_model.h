/** What a light of the calibration does at a point of the sample. */
#ifndef WEFT_CALIBRATION_LIGHTS_LIGHT_MODEL_H
#define WEFT_CALIBRATION_LIGHTS_LIGHT_MODEL_H

#include "calibration/calibration.h"

/**
 * Direction to a light and its strength at a world point (formats.md).
 *
 * @param to_light  gets the unit vector from the point towards the light
 * @return          a(theta) / r^2 (r in metres; 1 for a distant light), >= 0; times intensity[c] it is the
 *                  linear value of a 100 % Lambertian patch that faces the light there
 */
double weft_light_at(const weft_light *light, weft_vec3 point, weft_vec3 *to_light);

/** Gain of the grid for a light and channel at pixel (u, v), bilinear between nodes; 1 without a grid. */
double weft_light_grid_gain(const weft_calibration *cal, int light, int channel, double u, double v);

#endif
