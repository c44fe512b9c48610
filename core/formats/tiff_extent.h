/** Whether a TIFF's directories lie inside the file: inside core/formats only. */
#ifndef WEFT_CORE_FORMATS_TIFF_EXTENT_H
#define WEFT_CORE_FORMATS_TIFF_EXTENT_H

#include "core/error.h"

/**
 * For a DNG file: every value of its main, EXIF and sub-directories lies inside the file.
 *
 * Readers fill in defaults for tags whose values were cut away, so that a DNG without its end would come
 * back with a black level of 0 and no word said.  Files that are no DNG pass: other makers' raws point to
 * odd places.
 *
 * @return WEFT_ERR_FORMAT naming the file
 */
weft_err weft_dng_check_extent(const char *path, weft_error *err);

#endif
