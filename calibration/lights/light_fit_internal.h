/** The inside of the light fit: cells, parameters, the three steps.  Only for calibration/lights. */
#ifndef WEFT_CALIBRATION_LIGHTS_LIGHT_FIT_INTERNAL_H
#define WEFT_CALIBRATION_LIGHTS_LIGHT_FIT_INTERNAL_H

#include "calibration/lights/light_fit.h"

/** Terms of log S: rho^2, rho^4, rho^6, and a slope along x and y, in radii of the frame. */
enum { FIT_RADIAL = 3, FIT_COMMON = 5 };

/** Terms of the sheet's height, mm: x, y, x^2, x y, y^2 in units of the field's radius. */
enum { FIT_TILT = 2, FIT_SHAPE = 5 };

/** With fewer lights there is no telling the camera's vignetting from theirs: cos^4 is taken for it. */
#define FIT_LIGHTS_LEAST 4

/** A pixel from the middle of the vignetting, in radii. */
typedef struct fit_place {
    double x, y;
} fit_place;

/** What is known of a lamp: position, exponent, the spot it points to (mm on z = 0), log Phi. */
typedef struct fit_lamp {
    double p[3], e, m[2], log_phi[3];
} fit_lamp;

enum { FIT_LAMP = sizeof(fit_lamp) / sizeof(double) }; /* 9 numbers in this order */

/** What the lamps share: their mean exponent, and the shape of the sheet. */
typedef struct fit_shared {
    double e0, shape[FIT_SHAPE];
} fit_shared;

enum { FIT_SHARED = sizeof(fit_shared) / sizeof(double) };

/** Where a cell is on the table, and how that moves with the height of the sheet (along the camera's ray). */
typedef struct fit_cell {
    double x, y;   /* mm, on the plane of the options' height */
    double dx, dy; /* mm per mm of height */
} fit_cell;

typedef struct fit_problem {
    const weft_light_fit_options *options;
    int width, height;     /* px */
    double cx, cy, radius; /* middle of the vignetting and the distance of the farthest corner, px */
    double field_mm;       /* from the middle of the plate to the farthest cell */
    double half_field_mm[2];
    int middle;            /* the cell nearest to the middle of the plate */
    int n_lights, n_cells; /* cells row by row, as the sheet's or a subset */
    fit_cell *cell;        /* [n_cells] */
    fit_place *place;      /* [n_cells] */
    double *common;        /* [channel][n_cells] log S */
    float *y;              /* [light][channel][n_cells] log(value / reflectance); NaN left out */
    float *weight;         /* [light][channel][n_cells] shot noise's: value / mean value; 0 left out */
    fit_lamp lamps[WEFT_LIGHTS_MAX];
    fit_shared shared;
    double v[FIT_COMMON];                   /* the polynomial in log S, once fit_settle_common() has run */
    double noise[WEFT_LIGHTS_MAX][3];       /* standard deviation of a residual of weight 1 */
    double model_variance;                  /* what smooth errors of the model add to a cell's variance */
    fit_lamp sigma[WEFT_LIGHTS_MAX];        /* standard deviations */
    double position_sigma[WEFT_LIGHTS_MAX]; /* mm, of all three together */
    double irradiance_sigma[WEFT_LIGHTS_MAX];
    fit_shared shared_sigma;
} fit_problem;

static inline size_t fit_plane(const fit_problem *f, int light, int channel)
{
    return (size_t)(light * 3 + channel) * (size_t)f->n_cells;
}

/** Room for `n_cells`; fit_problem_fini() also after a failure. */
weft_err fit_problem_init(fit_problem *f, int n_lights, int n_cells, weft_error *err);
void fit_problem_fini(fit_problem *f);

/** The sheet at a cell: its point, normal (not normalised: z 1), and the terms of its height. */
typedef struct fit_surface {
    weft_vec3 x, n;
    double n2; /* n.n */
    double term[FIT_SHAPE];
} fit_surface;

fit_surface fit_surface_at(const fit_problem *f, int cell);

/** log of a lamp's part of the model without Phi: a (n.l) / r^2 in 1/m^2; NAN where it gives no light. */
double fit_lamp_log(const fit_lamp *lamp, const fit_surface *at);

/** The same with its derivatives by p, e, m (mm, 1, mm) and by the sheet's shape. */
enum { FIT_GEOMETRY = 6 };
double fit_lamp_gradient(const fit_problem *f, const fit_lamp *lamp, int cell, const fit_surface *at,
                         double by_lamp[FIT_GEOMETRY], double by_shape[FIT_SHAPE]);

/** log of the polynomial part of S. */
double fit_common_log(const double v[FIT_COMMON], fit_place place);

/** measured/model at a cell, as a logarithm, with S left in it; NAN left out. */
double fit_ratio(const fit_problem *f, int light, int channel, int cell);

/** measured/model at a cell, as a logarithm; NAN left out. */
static inline double fit_residual(const fit_problem *f, int light, int channel, int cell)
{
    return fit_ratio(f, light, channel, cell) -
           f->common[(size_t)channel * (size_t)f->n_cells + (size_t)cell];
}

/** Which lights are fitted, what is free beside them, and how often the weights are made anew. */
typedef struct fit_scope {
    int first, n;
    bool common_free; /* S: a number for each cell and channel, eliminated */
    bool bow_free, tilt_free;
    bool sigmas; /* wanted too */
    int runs;
} fit_scope;

/** Levenberg-Marquardt with Tukey's weights to convergence; fills common and noise, and the sigmas if wanted.
 */
weft_err fit_solve(fit_problem *f, fit_scope scope, weft_error *err);

/** Takes the polynomial out of S and its constants into the lamps' Phi, so that S is 1 at its middle. */
weft_err fit_settle_common(fit_problem *f, weft_error *err);

/** Sets every light's start from the guess, or by a search over the dome. */
weft_err fit_start(fit_problem *f, weft_error *err);

/** A plane over the cells, smoothed to nodes at the frame's corners and between. */
typedef struct fit_smooth {
    const weft_white_sheet *sheet;
    int columns, rows; /* of nodes */
    double sigma_px;   /* of the Gaussian window */
    double *row_sums;  /* scratch: [5][sheet rows][columns] */
} fit_smooth;

weft_err fit_smooth_init(fit_smooth *s, const weft_white_sheet *sheet, int columns, int rows,
                         weft_error *err);
void fit_smooth_fini(fit_smooth *s);

/**
 * Local straight-line regression (no bias at the borders).
 *
 * @param values   [sheet rows][sheet columns]; NaN left out
 * @param weights  the same shape, or NULL: all alike
 * @param nodes    gets [rows][columns]; NaN where fewer than a fifth of the cells are there
 */
void fit_smooth_plane(const fit_smooth *s, const float *values, const float *weights, float *nodes);

/** Bilinear between nodes. */
double fit_smooth_at(const fit_smooth *s, const float *nodes, double u, double v);

/** A pixel as fit_place. */
fit_place fit_place_at(const fit_problem *f, double u, double v);

/** Planes that the rounds and the grid need. */
typedef struct fit_planes {
    fit_smooth smooth;
    float *residual; /* [cells] */
    float *weight;   /* [cells] */
    float *nodes;    /* [grid rows][grid columns] */
    float *colours;  /* [3][grid rows][grid columns] */
} fit_planes;

weft_err fit_planes_init(fit_planes *p, const fit_problem *f, const weft_white_sheet *sheet, weft_error *err);
void fit_planes_fini(fit_planes *p);

/**
 * Smooths p->residual into p->nodes, specks of dust left out.
 *
 * @param first  gets the first cell that is far (5 %) from the smooth field, -1 when there is none
 * @return       the share of such cells
 */
double fit_smooth_robust(const fit_problem *f, fit_planes *p, int *first);

/**
 * The gains of a light and channel: the polynomial part of S times the smoothed rest.
 *
 * @param gain      gets [grid rows][grid columns]
 * @param left_out  raised to the share of cells that do not belong to a smooth field
 * @return WEFT_ERR_NODATA naming light and place when there are too many of them, or the gain is absurd
 */
weft_err fit_grid(const fit_problem *f, fit_planes *p, int light, int channel, float *gain, double *left_out,
                  weft_error *err);

/**
 * Mean square of what the residuals of two colours have in common after smoothing: noise has nothing, an
 * error of the model has.  @return 0 when it does not stand out
 */
double fit_model_error(const fit_problem *f, fit_planes *p);

/** rms of measured/(model grid) - 1 of a light, dust left out; `gain` is the whole grid. */
double fit_grid_residual(const fit_problem *f, const fit_planes *p, int light, const float *gain);

#endif
