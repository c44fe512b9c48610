/**
 * The three functions that Weft takes from OpenCV, behind plain C.
 *
 * OpenCV's camera calibration exists in C++ only.  lens_opencv.cpp wraps it into a module of its own which
 * lens_module.c opens when a command needs it, so that no other command pays for OpenCV's libraries.
 * Arrays in, arrays out; no exception passes.  Every function gives 0 (or what it says) and -1 after an
 * exception with OpenCV's words in `why`.
 */
#ifndef WEFT_CALIBRATION_LENS_OPENCV_H
#define WEFT_CALIBRATION_LENS_OPENCV_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define WEFT_LENS_OPENCV_ABI    2
#define WEFT_LENS_OPENCV_SYMBOL "weft_lens_opencv_table"

/** Room for the words of an exception. */
typedef struct weft_lens_why {
    char text[256];
} weft_lens_why;

/** Which coefficients are free; the others are 0. */
typedef enum weft_lens_terms {
    WEFT_LENS_TERMS_4, /* k1, k2, p1, p2 */
    WEFT_LENS_TERMS_5, /* and k3 */
    WEFT_LENS_TERMS_8, /* and k4, k5, k6 below the line: rational */
} weft_lens_terms;

/** What cv::calibrateCamera gives. */
typedef struct weft_lens_estimate {
    double camera[4];     /* fx, fy, cx, cy in px */
    double distortion[8]; /* k1, k2, p1, p2, k3, k4, k5, k6 */
    double sigma[12];     /* standard deviations of fx, fy, cx, cy and the coefficients; 0 where held */
    double rms_px;
} weft_lens_estimate;

typedef struct weft_lens_opencv {
    int abi;
    const char *version; /* "4.6.0" */

    /**
     * Inner corners of a chessboard.
     *
     * @param grey     [height][stride], 8 bit
     * @param share    half-window of the refinement as a share of the smallest corner spacing
     * @param corners  gets [rows][columns][2] u, v in pixels
     * @return 1 found, 2 when there is a second one beside it, 0 not found
     */
    int (*find_chessboard)(const uint8_t *grey, int width, int height, size_t stride, int columns, int rows,
                           double share, float *corners, weft_lens_why *why);

    /**
     * Intrinsics from `n_views` views of the same `n_points` points.
     *
     * @param object        [n_points][3] mm, z = 0
     * @param image         [n_views][n_points][2] px
     * @param hinge         the last point of the first row: the board may be bent, and its points but the
     * first, this one and the plane's last are found too (cv::calibrateCameraRO); -1: it is flat
     * @param bent          gets [n_points][3]: the board as found; NULL for a flat one
     * @param per_view_rms  gets [n_views] px
     * @param residuals     gets [n_views][n_points][2]: seen minus predicted, px; NULL: not wanted
     */
    int (*calibrate)(int n_views, int n_points, const float *object, const float *image, int width,
                     int height, weft_lens_terms terms, int hinge, weft_lens_estimate *estimate, float *bent,
                     double *per_view_rms, float *residuals, weft_lens_why *why);

    /**
     * Pose of a plane's points: the better of the two that a plane allows, refined.
     *
     * @param rotation, translation  get [9] row by row and [3] mm of x_c = R x_w + t
     * @param rms_px                 gets the reprojection error
     */
    int (*solve_pose)(int n_points, const float *object, const float *image, const double camera[4],
                      const double distortion[8], double rotation[9], double translation[3], double *rms_px,
                      weft_lens_why *why);
} weft_lens_opencv;

#ifdef __cplusplus
}
#endif

#endif
