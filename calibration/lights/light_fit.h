/**
 * Where the lights are, how bright, and how they fall off: from a white sheet that fills the frame.
 *
 * Every light is a lamp at p that points to a spot near the middle of the plate.  A cell of the sheet at x
 * (normal n, reflectance k) has, in channel c,
 *
 *     I_c = k Phi_c S(u, v) (n.l) a(theta) / r^2,   l = (p - x) / |p - x|,   a = cos^e
 *
 * S is common to all lights (the camera's vignetting, the sheet's own unevenness, its texture, dust): a free
 * number for every cell and colour, taken out of the equations.  The ratios between the lights that remain
 * determine all lamps; a polynomial for S beside them would gain a tenth in precision and need the lens to
 * obey it.  Letting each light's strength be free at every pixel instead, as the plain alternation does,
 * determines nothing: any start would be a fixed point (S-ORD-18).  What a single light still misses,
 * smoothed, becomes its grid of gains.
 *
 * The sheet is flat at first, to within flatness_mm.  Then its tilt and its bow (a quadric) are left open: a
 * bow that stands out from its uncertainty is kept, a tilt is refused.
 */
#ifndef WEFT_CALIBRATION_LIGHTS_LIGHT_FIT_H
#define WEFT_CALIBRATION_LIGHTS_LIGHT_FIT_H

#include "calibration/calibration.h"
#include "calibration/lights/white_sheet.h"

#define WEFT_LIGHT_FIT_MAX_ROUNDS 20

typedef struct weft_light_fit_options {
    double reflectance;               /* of the sheet, 0.99 */
    int grid_columns, grid_rows;      /* nodes, 33 x 22 */
    int max_rounds;                   /* 10, half of WEFT_LIGHT_FIT_MAX_ROUNDS: twice, flat and bowed */
    double settled_mm;                /* a round that moves every light less than this is the last: 0.1 */
    double aim_sigma_rad;             /* how well the lamps point to the middle of the plate: 1 degree */
    double exponent_sigma;            /* how alike the lamps' exponents are: 0.2 */
    double sheet_height_mm;           /* of its surface over the calibrated plane: 0 */
    double flatness_mm;               /* how flat a flat sheet is, over the field's radius: 0.02 */
    double tilt_most_rad;             /* a sheet that is certainly more tilted is refused: 0.5 degrees */
    double bow_most_mm;               /* likewise bowed: 2 */
    double guess_off_mm;              /* a light farther from its guess is warned of: 60 */
    int n_guess;                      /* 0: the start is searched for */
    weft_vec3 guess[WEFT_LIGHTS_MAX]; /* rough positions, mm */
    double guess_sigma_mm;            /* > 0: how well they are known; 0: they are only a start */
} weft_light_fit_options;

extern const weft_light_fit_options weft_light_fit_defaults;

typedef struct weft_light_fit_round {
    double moved_mm; /* by the light that moved most against the round before (the start, in the first) */
    double rms;      /* of measured/model - 1 over all cells, without the grid */
} weft_light_fit_round;

/** How the sheet lay; with fewer than 4 lights nothing is known of it (all 0). */
typedef struct weft_light_sheet {
    double bow_mm[2], bow_sigma_mm[2];     /* its middle over the edges of the field, across and up */
    double tilt_rad[2], tilt_sigma_rad[2]; /* rises towards +X and +Y */
    bool bow_used;                         /* the lights were fitted with the bow */
} weft_light_sheet;

/** Standard deviations of a lamp's numbers, by the noise of the cells, the model's error and the priors. */
typedef struct weft_light_sigma {
    double position_mm[3], aim_rad, exponent;
    double intensity[3]; /* relative */
    double irradiance;   /* relative, of what the middle of the plate gets (green) */
} weft_light_sigma;

typedef struct weft_light_fit_report {
    int n_rounds;
    weft_light_fit_round rounds[WEFT_LIGHT_FIT_MAX_ROUNDS];
    bool settled;
    double vignetting[3], slope[2]; /* log S = sum v_k rho^(2k) + slope . (x, y), in radii: from (cx, cy) to
                                       the farthest corner */
    double exponent;                /* mean of the lamps */
    double model_error;             /* rms of what the model misses smoothly, before the grid; 0 not seen */
    weft_light_sheet sheet;
    double model_rms[WEFT_LIGHTS_MAX]; /* of measured/model - 1 without the grid, per light */
    weft_light_sigma sigma[WEFT_LIGHTS_MAX];
    double left_out[WEFT_LIGHTS_MAX]; /* share of cells saturated or far off the field (dust) */
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
