/**
 * A calibration: what is known of one scanner.  In memory and as `NAME.cal/` (docs/formats.md).
 *
 * Every part may be absent.  Each `calibrate` step fills one part and leaves the others as they are.
 */
#ifndef WEFT_CALIBRATION_CALIBRATION_H
#define WEFT_CALIBRATION_CALIBRATION_H

#include "calibration/colour_model.h"
#include "calibration/gamut.h"
#include "core/error.h"
#include "core/image.h"
#include "core/linalg.h"

#include <jansson.h>
#include <stdbool.h>

#define WEFT_CALIBRATION_VERSION 2   /* written when the file says something that version 1 does not know */
#define WEFT_LIGHTS_MAX          128 /* the largest open benchmark sets have 100 */

/** Coefficients of a lens. */
#define WEFT_DISTORTION 8

/** Pinhole camera with OpenCV's distortion, and its pose over the sample plane. */
typedef struct weft_camera {
    int width, height;     /* px of the frames it holds for */
    double fx, fy, cx, cy; /* px */
    /* k1, k2, p1, p2, k3, k4, k5, k6; the last three are the rational model's and 0 without it */
    double distortion[WEFT_DISTORTION];
    double rms_px; /* reprojection error of the fit */
    bool has_pose;
    weft_mat3 rotation;    /* world to camera: x_c = R x_w + t */
    weft_vec3 translation; /* mm */
} weft_camera;

/** One light of the dome (formats.md: I = albedo * intensity * a(theta) * (n.l) / r^2, r in metres). */
typedef struct weft_light {
    bool distant;        /* direction instead of position: a(theta) / r^2 is 1 */
    weft_vec3 position;  /* mm, world */
    weft_vec3 direction; /* unit, towards the light; distant only */
    weft_vec3 axis;      /* unit, where the lamp points */
    double exponent;     /* a(theta) = cos^exponent of the angle off the axis */
    double intensity[3]; /* linear value of a 100 % Lambertian sheet facing the light at 1 m, camera RGB */
    double white_balance[3];  /* gains that make a neutral equal, green 1 */
    double position_sigma_mm; /* uncertainty of the fit, 0 unknown */
    double residual;          /* rms of measured/model - 1 over the sheet after the grid, 0 unknown */
} weft_light;

/** Smooth gain per light and channel over the frame that multiplies the analytic model. */
typedef struct weft_light_grid {
    int columns, rows; /* 0 when absent; nodes at the frame's corners: u = i (width - 1) / (columns - 1) */
    float *gain;       /* [light][channel 3][rows][columns] */
} weft_light_grid;

typedef struct weft_linearity {
    double range[2]; /* of (DN - black) / (white - black) over which the sensor is linear */
    double max_deviation;
} weft_linearity;

typedef struct weft_colour_part {
    weft_colour_model model;                                 /* from camera RGB after white balance */
    double delta_e_mean, delta_e_max, delta_e_held_out_mean; /* CIEDE2000 over the chart */
    int n_gamut;                                             /* 0: unknown */
    double gamut[WEFT_GAMUT_MAX_POINTS][3];                  /* linear sRGB of the patches it was fitted to */
} weft_colour_part;

typedef struct weft_calibration {
    char created[32];
    bool has_camera, has_linearity, has_lights, has_colour;
    weft_camera camera;
    weft_linearity linearity;
    int n_lights;
    weft_light lights[WEFT_LIGHTS_MAX];
    weft_light_grid grid;
    weft_colour_part colour;
    json_t *other; /* keys of the file this program does not know, and reports; written back; may be NULL */
} weft_calibration;

/** An empty calibration: nothing is known. */
void weft_calibration_init(weft_calibration *cal);
void weft_calibration_fini(weft_calibration *cal);

/** Reads `NAME.cal/`.  @return WEFT_ERR_IO, _FORMAT, _VERSION, _RANGE naming file, key and remedy. */
weft_err weft_calibration_load(const char *folder, weft_calibration *cal, weft_error *err);

/** Writes the folder: the grid first, calibration.json last; whole or not at all.  An existing
 *  calibration is replaced file by file (its steps add to it); other files in the folder stay. */
weft_err weft_calibration_save(const char *folder, const weft_calibration *cal, weft_error *err);

/** The parts a step may need. */
typedef enum weft_calibration_part {
    WEFT_CALIBRATION_CAMERA = 1,
    WEFT_CALIBRATION_POSE = 2,
    WEFT_CALIBRATION_LIGHTS = 4,
    WEFT_CALIBRATION_COLOUR = 8,
    WEFT_CALIBRATION_LINEARITY = 16,
} weft_calibration_part;

/** @return WEFT_ERR_MISSING naming the first absent part of `parts` and the command that makes it;
 *  `folder` is only for the message. */
weft_err weft_calibration_require(const weft_calibration *cal, unsigned parts, const char *folder,
                                  weft_error *err);

/** @return WEFT_ERR_MISMATCH when the camera part is for another frame size than width x height. */
weft_err weft_calibration_require_size(const weft_calibration *cal, int width, int height, const char *folder,
                                       weft_error *err);

#endif
