/**
 * What a layout of lights will do for the normals, before anything is built: the noise of each normal over
 * the plate, from the camera's noise carried through the least squares.
 *
 *     X_j = S k intensity_j a_j / r_j^2 (n . l_j)       sample, part of full scale
 *     var X_j = read^2 + X_j / full well                (photon transfer)
 *     I'_j = X_j / (S intensity_j a_j / r_j^2)
 *     cov N = C (sum_j l_j l_j^T var I'_j) C,  C = (sum_j l_j l_j^T)^-1
 *     sigma^2 = tr((I - n n^T) cov N) / k^2
 *
 * Over the lights that shine on the surface (n . l_j > 0).  S is the exposure that brings the brightest spot
 * of a white sheet to `fill` under the brightest light, as the scanner exposes.
 */
#ifndef WEFT_HOST_SOLVE_LAYOUT_H
#define WEFT_HOST_SOLVE_LAYOUT_H

#include "calibration/calibration.h"

typedef struct weft_layout_options {
    double plate_mm[2]; /* width and height of the field, its middle at the origin */
    double albedo;      /* of the cloth, 0..1 */
    double tilt_deg;    /* of the surface: the variance is the mean over eight directions of leaning */
    double fill;        /* part of the range that the brightest spot of a white sheet reaches */
    double full_well_e; /* electrons at saturation */
    double read_e;      /* read noise, electrons rms */
} weft_layout_options;

typedef struct weft_layout {
    weft_image map;      /* 1 plane, degrees rms; row 0 at +y; NaN where three lights do not reach */
    double mean, max;    /* over the map, rms and largest */
    double middle;       /* at the origin */
    double undetermined; /* share of the map without an answer */
    double gain;         /* noise of the lights' geometry alone in the middle: radians per relative error */
    double evenness;     /* of the worst light: dimmest over brightest spot of the plate */
    double without[WEFT_LIGHTS_MAX]; /* mean when this light is not there; NaN: no answer anywhere */
} weft_layout;

void weft_layout_fini(weft_layout *layout);

/** Exposure S of a layout, per unit of intensity at 1 m. */
double weft_layout_exposure(const weft_calibration *cal, const weft_layout_options *options);

/**
 * Expected error of the normal at a point, rms, radians.
 *
 * @param exposure  S
 * @param skip      a light that is left out; -1: none
 * @return          NaN when the lights that shine there do not determine it
 */
double weft_layout_sigma(const weft_calibration *cal, const weft_layout_options *options, double exposure,
                         weft_vec3 point, weft_vec3 normal, int skip);

/** Works it out over the plate.  @return WEFT_ERR_NODATA when no place is determined, WEFT_ERR_NOMEM */
weft_err weft_layout_predict(const weft_calibration *cal, const weft_layout_options *options,
                             weft_layout *layout, weft_error *err);

/**
 * Lights from a table: columns x_mm, y_mm, z_mm, and where they are there power (relative, 1) and exponent
 * (of the lobe, 1).  They are aimed at the origin.
 * @return WEFT_ERR_FORMAT, _RANGE naming file and row
 */
weft_err weft_layout_read(const char *path, weft_calibration *cal, weft_error *err);

#endif
