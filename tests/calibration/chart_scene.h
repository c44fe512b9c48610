/** Photographs of charts and of things that are no charts, drawn from their geometry. */
#ifndef WEFT_TESTS_CALIBRATION_CHART_SCENE_H
#define WEFT_TESTS_CALIBRATION_CHART_SCENE_H

#include "calibration/charts/chart.h"
#include "calibration/charts/chart_picture.h"
#include "core/linalg.h"

#include <stdint.h>

typedef struct chart_scene {
    int width, height;
    const weft_chart *chart; /* NULL: table only */
    weft_mat3 to_pixel;      /* chart mm to px */
    double frame, table;     /* reflectance of the dark frame and of the table */
    double clutter;          /* strength of the pattern on the table, 0..1 */
    double fall_u, fall_v;   /* illumination: exp(fall * (position -1..1)) */
    double exposure;         /* linear value of a 100 % white */
    double shot, read;       /* variance = shot * value + read^2 */
    double blur;             /* px: half width of the pixel's footprint */
    uint64_t seed;
} chart_scene;

/** An upright chart in the middle, `fill` of the width; then turned by degrees and tilted about both axes. */
weft_mat3 chart_scene_view(const weft_chart *chart, int width, int height, double fill, double turn_deg,
                           double tilt_x_deg, double tilt_y_deg);

/** Sensible defaults: 616 x 408, mid-grey table, no noise. */
chart_scene chart_scene_make(const weft_chart *chart, weft_mat3 to_pixel);

/** Draws the RGGB mosaic as a D5100-like camera sees it: linear, black subtracted, clipped at 1. */
void chart_scene_draw(const chart_scene *scene, weft_image *mosaic, weft_mask *clipped);

/** The camera: its RGB of a linear sRGB colour (positive, mixed, not white balanced). */
void chart_scene_camera(const double srgb[3], double camera[3]);

#endif
