/**
 * Where the lights are, how bright, and how they fall off: from a white sheet that fills the frame.
 *
 * Every light is a lamp at p that points to a spot near the middle of the plate.  A cell of the sheet at x
 * (normal n, reflectance k) has, in channel c,
 *
 *     I_c = k Phi_c S(u, v) (n.l) a(theta) / r^2,   l = (p - x) / |p - x|,   a = cos^e
 *
 * S is common to all lights (the camera's vignetting, the sheet's own unevenness): a radial polynomial,
 * fitted together with all lamps, times what remains common after that.  Letting the strength be free at
 * every pixel instead, as the plain alternation does, determines nothing: any start would be a fixed point
 * (S-ORD-18).  What a single light still misses, smoothed, becomes its grid of gains.
 */
#ifndef WEFT_CALIBRATION_LIGHTS_LIGHT_FIT_H
#define WEFT_CALIBRATION_LIGHTS_LIGHT_FIT_H

#include "calibration/calibration.h"
#include "calibration/lights/white_sheet.h"

#define WEFT_LIGHT_FIT_MAX_ROUNDS 10

typedef struct weft_light_fit_options {
    double reflectance;               /* of the sheet, 0.99 */
    int grid_columns, grid_rows;      /* nodes, 33 x 22 */
    int max_rounds;                   /* at most WEFT_LIGHT_FIT_MAX_ROUNDS */
    double settled_mm;                /* a round that moves every light less than this is the last: 0.1 */
    double aim_sigma_rad;             /* how well the lamps point to the middle of the plate: 1 degree */
    double exponent_sigma;            /* how alike the lamps' exponents are: 0.2 */
    int n_guess;                      /* 0: the start is searched for */
    weft_vec3 guess[WEFT_LIGHTS_MAX]; /* rough positions, mm */
} weft_light_fit_options;

extern const weft_light_fit_options weft_light_fit_defaults;

typedef struct weft_light_fit_round {
    double moved_mm; /* by the light that moved most against the round before (the start, in the first) */
    double rms;      /* of measured/model - 1 over all cells, without the grid */
} weft_light_fit_round;

typedef struct weft_light_fit_report {
    int n_rounds;
    weft_light_fit_round rounds[WEFT_LIGHT_FIT_MAX_ROUNDS];
    bool settled;
    double vignetting[3], slope[2]; /* log S = sum v_k rho^(2k) + slope . (x, y), in radii: from (cx, cy) to
                                       the farthest corner */
    double exponent;                /* mean of the lamps */
    double model_rms[WEFT_LIGHTS_MAX]; /* of measured/model - 1 without the grid, per light */
    double left_out[WEFT_LIGHTS_MAX];  /* share of cells saturated or far off the field (dust) */
} weft_light_fit_report;

/**
 * Fits all lights and their grid.
 *
 * @param camera  with a pose; its size is that of the sheet
 * @param cal     gets lights (their white balance from the sheet, which is taken as neutral) and grid in
 *                place of what it had; untouched on failure
 * @return WEFT_ERR_NODATA naming the light that is dark or absent, or the place where the sheet does not
 *         look like one; WEFT_ERR_MISMATCH, WEFT_ERR_RANGE, WEFT_ERR_NOMEM
 */
weft_err weft_light_fit(const weft_camera *camera, const weft_white_sheet *sheet,
                        const weft_light_fit_options *options, weft_calibration *cal,
                        weft_light_fit_report *report, weft_error *err);

#endif
