/** Where corners were seen and where the fitted lens puts them. */
#ifndef WEFT_CALIBRATION_LENS_LENS_RESIDUALS_H
#define WEFT_CALIBRATION_LENS_LENS_RESIDUALS_H

#include "calibration/lens/lens_fit.h"

/**
 * Residuals of one view under the pose that fits it best.
 *
 * @param camera     intrinsics; its pose is not used
 * @param residuals  gets [rows][columns][4]: u and v of the corner, and du, dv of it from where it should be,
 * px
 * @return WEFT_ERR_NODATA when no pose is found, WEFT_ERR_UNSUPPORTED without the OpenCV module
 */
weft_err weft_lens_view_residuals(const weft_board *board, const weft_board_view *view,
                                  const weft_camera *camera, double *residuals, weft_error *err);

#endif
