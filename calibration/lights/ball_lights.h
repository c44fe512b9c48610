/**
 * Where the lights are, from glossy or mirroring balls on the table: each lamp mirrors itself in each ball,
 * and the mirrored rays of a lamp meet where it is.  Weaker than the white sheet (a few millimetres), but it
 * needs no model of the lamps and no start: a check and a start for the sheet's fit.
 */
#ifndef WEFT_CALIBRATION_LIGHTS_BALL_LIGHTS_H
#define WEFT_CALIBRATION_LIGHTS_BALL_LIGHTS_H

#include "calibration/calibration.h"

#define WEFT_BALLS_MAX 16

/** The pictures of the balls under each light, binned. */
typedef struct weft_ball_pictures {
    int width, height; /* px of the frames */
    int bin_px; /* even; pixel (i, j) is the mean of the photosites from (i, j) * bin_px on, all colours */
    int columns, rows;
    int n_lights;
    float *value; /* [light][rows][columns] */
} weft_ball_pictures;

weft_err weft_ball_pictures_init(weft_ball_pictures *pictures, int width, int height, int n_lights,
                                 weft_error *err);
void weft_ball_pictures_fini(weft_ball_pictures *pictures);

/** Bins a light's plate (1 or 3 planes).  @return WEFT_ERR_MISMATCH for another size */
weft_err weft_ball_pictures_add(weft_ball_pictures *pictures, int light, const weft_image *image,
                                weft_error *err);

typedef struct weft_ball_lights {
    int n_balls;
    weft_vec3 ball[WEFT_BALLS_MAX]; /* middles, mm */
    weft_vec3 position[WEFT_LIGHTS_MAX];
    double miss_mm[WEFT_LIGHTS_MAX]; /* rms distance of the mirrored rays from the position */
    double miss_mean_mm;
} weft_ball_lights;

/**
 * Finds the balls (darker than the table, wholly in the picture) and the lights.
 *
 * @param camera     with a pose
 * @param radius_mm  of the balls, which lie on the table
 * @return WEFT_ERR_NODATA with fewer than two balls or a light that mirrors itself in fewer than two, naming
 * it; WEFT_ERR_RANGE when the balls' outlines do not fit the radius; WEFT_ERR_NOMEM
 */
weft_err weft_ball_lights_find(const weft_camera *camera, const weft_ball_pictures *pictures,
                               double radius_mm, weft_ball_lights *lights, weft_error *err);

#endif
