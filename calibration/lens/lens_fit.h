/**
 * Camera and pose from photographs of a chessboard.
 *
 * A board is a lattice of inner corners; its views come from weft_board_find().  Intrinsics: Zhang 2000 as
 * cv::calibrateCamera does it.  How many coefficients the lens gets, and whether the board is held to be
 * flat, is decided by the error on views that the fit has not seen: the rms falls with every coefficient,
 * that does not. Needs the OpenCV module (lens_module.h).
 */
#ifndef WEFT_CALIBRATION_LENS_FIT_H
#define WEFT_CALIBRATION_LENS_FIT_H

#include "calibration/calibration.h"

#define WEFT_BOARD_MAX_SIDE 64
/** Fewer views do not determine a lens. */
#define WEFT_LENS_MIN_VIEWS 5

typedef struct weft_board {
    int columns, rows; /* inner corners, 3..WEFT_BOARD_MAX_SIDE each */
    double square_mm;  /* side of a square */
} weft_board;

/** What was seen of the board in one picture. */
typedef struct weft_board_view {
    const char *name; /* of the picture, for messages */
    float *corners;   /* [rows][columns][2] u, v in px; the caller's */
    double edge_px;   /* width of the squares' edges (weft_board_edge_width()); 0 unknown */
    bool used;        /* false: left out by weft_lens_fit() */
    bool blurred;     /* that is why */
    double rms_px;    /* reprojection error */
    float *residuals; /* [rows][columns][2] seen minus predicted, px; the caller's room, or NULL */
} weft_board_view;

/** The models of a lens, from few to many coefficients. */
typedef enum weft_lens_model_choice {
    WEFT_LENS_AUTO = -1, /* by the held-out error */
    WEFT_LENS_K1K2P1P2,
    WEFT_LENS_K3,
    WEFT_LENS_RATIONAL,
    WEFT_LENS_N_MODELS
} weft_lens_model_choice;

/** @return "k1k2p1p2", "k1k2p1p2k3", "rational" */
const char *weft_lens_model_name(weft_lens_model_choice model);

typedef struct weft_lens_options {
    weft_lens_model_choice model;
    int bent; /* -1: by the held-out error; 0: the board is flat; 1: it is bent */
} weft_lens_options;

#define WEFT_COVERAGE_COLUMNS 8
#define WEFT_COVERAGE_ROWS    6

typedef struct weft_lens_report {
    int n_used;
    double
        held_out_px; /* rms over views that the fit had not seen, each with its own pose; 0: too few views */
    double
        sigma[12]; /* standard deviations of fx, fy, cx, cy (px), k1, k2, p1, p2, k3, k4, k5, k6; 0: held */
    weft_lens_model_choice model;
    bool bent;
    double bend_mm; /* from the lowest to the highest corner of a bent board, over its mean plane */
    /* What was tried: [0] flat, [1] bent boards; 0: not tried. */
    double tried_px[2][WEFT_LENS_N_MODELS];
    int map[WEFT_COVERAGE_ROWS][WEFT_COVERAGE_COLUMNS]; /* corners of used views in each cell of the frame */
    double coverage;                                    /* share of the cells that have one */
} weft_lens_report;

/** "9x6" as inner corners; WEFT_ERR_USAGE outside 3..WEFT_BOARD_MAX_SIDE or for a square of no size. */
weft_err weft_board_check(const weft_board *board, weft_error *err);

/**
 * 8-bit grey for the corner finder: green sites of a mosaic (the others from their neighbours), else the
 * mean of the planes; stretched from the 1st to the 99.5th percentile, linear in light.
 *
 * @param image  1 plane (mosaic when `cfa` says so, else grey) or 3 planes RGB; NaN counts as black
 * @param grey   gets [height][width]
 */
void weft_board_grey(const weft_image *image, weft_cfa cfa, uint8_t *grey);

/**
 * Median width of the edges of the squares: contrast over the steepest slope, px.  A sharp picture has 1
 * to 4.
 *
 * @param share  gets it as a share of the corners' spacing; beyond 0.2 corners lose their place
 */
double weft_board_edge_width(const uint8_t *grey, int width, int height, const weft_board *board,
                             const float *corners, double *share);

/**
 * Looks for the board and refines its corners with a half-window of 0.35 of their smallest spacing
 * (a larger one takes in the neighbours' edges, a smaller one loses precision).
 *
 * @param corners  gets [rows][columns][2]; untouched when not found
 * @return WEFT_ERR_NODATA when there are two boards in the picture
 */
weft_err weft_board_find(const uint8_t *grey, int width, int height, const weft_board *board, float *corners,
                         bool *found, weft_error *err);

/**
 * Fits the intrinsics.  A view whose error is above 0.25 px and three times the median is left out, the
 * worst first, and one whose edges are 2.5 times as wide as the median's; its `used` becomes false.
 *
 * @param options  NULL: all by the held-out error.  A richer model must lower it by 3 %, a bent board by 5 %
 * @param camera   gets everything but the pose, which becomes absent
 * @return WEFT_ERR_NODATA for too few views, for too many outliers (named), and for views which leave the
 *         focal length uncertain by more than 1 %
 */
weft_err weft_lens_fit(const weft_board *board, int width, int height, weft_board_view *views, int n_views,
                       const weft_lens_options *options, weft_camera *camera, weft_lens_report *report,
                       weft_error *err);

/**
 * Pose from a board that lies on the sample plane with its rows along the width of the picture.
 *
 * The corners' order does not matter: +X is the way along the rows that goes right in the picture, +Y the
 * way across that goes up, so +Z points to the camera.
 *
 * @param origin_mm  where the middle of the board is in the world, x and y
 * @param camera     intrinsics in, pose out
 * @param rms_px     reprojection error
 * @return WEFT_ERR_RANGE when the rows are turned by more than 45 degrees
 */
weft_err weft_lens_fit_pose(const weft_board *board, const weft_board_view *view, const double origin_mm[2],
                            weft_camera *camera, double *rms_px, weft_error *err);

#endif
