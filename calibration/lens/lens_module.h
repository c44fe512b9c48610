/** Opens the OpenCV module (lens_opencv.h) when it is needed. */
#ifndef WEFT_CALIBRATION_LENS_MODULE_H
#define WEFT_CALIBRATION_LENS_MODULE_H

#include "calibration/lens/lens_opencv.h"
#include "core/error.h"

/**
 * The functions of libweft_lens_opencv.so, loaded at the first call and kept.  It is looked for in
 * $WEFT_MODULES when that is set, else beside the program, in ../lib/weft and in ../bin.
 *
 * @return WEFT_ERR_UNSUPPORTED naming where it was looked for and how to get it.  Not from two threads at
 *         once.
 */
weft_err weft_lens_opencv_load(const weft_lens_opencv **opencv, weft_error *err);

#endif
