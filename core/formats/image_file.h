/** Reading and writing a picture by what its name ends in (.exr .png .tif .tiff; read only: .jpg .jpeg). */
#ifndef WEFT_CORE_FORMATS_IMAGE_FILE_H
#define WEFT_CORE_FORMATS_IMAGE_FILE_H

#include "core/formats/raster.h"
#include "core/image.h"

/** Reads grey (1 plane) or RGB (3 planes) as linear light; EXR as it is, the others 0..1 by `transfer`. */
weft_err weft_image_read(const char *path, weft_transfer transfer, weft_image *image, weft_error *err);

/** Whether weft_image_write() has a format for the name: to be asked before long work.
 *  @return WEFT_ERR_FORMAT with the endings there are */
weft_err weft_image_check_name(const char *path, weft_error *err);

/** Writes 1 or 3 planes: EXR half (linear), PNG/TIFF with `bits` and `transfer`; whole or not at all. */
weft_err weft_image_write(const char *path, const weft_image *image, int bits, weft_transfer transfer,
                          weft_error *err);

#endif
