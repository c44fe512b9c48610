/**
 * Where each pixel lies on the sample, and what each light does there (S-ORD-18).
 *
 * The world position and the strength of a light vary smoothly over the frame, so they are worked out in
 * double at the nodes of a lattice and interpolated linearly between; the direction to the light, which
 * the normal hangs on, is computed from the position at every pixel.  The step is halved until it is at
 * most 1/120 of the distance of the nearest light: the strength is then right to 2e-5.
 */
#ifndef WEFT_HOST_SOLVE_INCIDENCE_H
#define WEFT_HOST_SOLVE_INCIDENCE_H

#include "calibration/calibration.h"

/** Planes of a node: world x and y (mm), then four per light: the reciprocal of its strength in the three
 *  channels, and the reciprocal of its distance (1/mm; 1 when it is distant), from which one step of Newton
 *  finds that of any pixel between without a root and a division. */
#define WEFT_INCIDENCE_PLANES(n_lights)     (2 + 4 * (n_lights))
#define WEFT_INCIDENCE_STRENGTH(light, c)   (2 + 4 * (light) + (c))
#define WEFT_INCIDENCE_OVER_DISTANCE(light) (2 + 4 * (light) + 3)

typedef struct weft_incidence {
    int n_lights;
    int step_log2;     /* nodes are 1, 2, 4, 8 or 16 pixels apart */
    int columns, rows; /* of nodes; they reach past the last pixel to a whole block of 16 */
    int stride;        /* floats from node to node, a multiple of 16 */
    float height_mm;   /* of the surface over the sample plane */
    bool has_eye;      /* false: the camera is far away over the plane */
    float eye[3];      /* the camera's centre, mm */
    bool distant[WEFT_LIGHTS_MAX];
    float light[WEFT_LIGHTS_MAX][3]; /* position in mm, or unit direction when distant */
    /* [rows][columns][stride]; NaN where a ray misses the plane or a light does not shine */
    float *nodes;
} weft_incidence;

/** How a solved pixel lies on the sensor: u = scale i + offset (1, 0 at full size, 2, 0.5 at half). */
typedef struct weft_pixel_scale {
    double scale, offset;
} weft_pixel_scale;

/**
 * Works out the lattice for `width` x `height` solved pixels.
 *
 * @param height_mm  height of the sample's surface over the plane z = 0 of the calibration
 * @return WEFT_ERR_MISSING when lights are near and the calibration has no camera with a pose
 */
weft_err weft_incidence_init(weft_incidence *incidence, const weft_calibration *cal, int width, int height,
                             weft_pixel_scale pixel, double height_mm, weft_error *err);
void weft_incidence_fini(weft_incidence *incidence);

#endif
