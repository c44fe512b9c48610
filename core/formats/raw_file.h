/** Camera raw files (DNG, NEF, CR2, ...) through LibRaw: the untouched Bayer plane and its black level. */
#ifndef WEFT_CORE_FORMATS_RAW_FILE_H
#define WEFT_CORE_FORMATS_RAW_FILE_H

#include "core/formats/tiff_file.h"
#include "core/image.h"

/**
 * Reads the visible Bayer plane exactly as the file has it: nothing scaled, subtracted or interpolated.
 * Black is LibRaw's `black` plus all parts of `cblack`, per site of the 2x2 cell.
 *
 * @return WEFT_ERR_FORMAT for a damaged or cut file and for files without a Bayer plane, naming the file
 */
weft_err weft_raw_read(const char *path, weft_mosaic *mosaic, weft_frame_info *info, weft_error *err);

/** As weft_raw_read() for a file in memory, called `name` in messages.  A DNG whose end is missing is not
 *  noticed when only tags were cut. */
weft_err weft_raw_read_bytes(const char *name, const void *bytes, size_t n, weft_mosaic *mosaic,
                             weft_frame_info *info, weft_error *err);

/** Whether the name ends like a raw file that LibRaw may read (.dng .nef .cr2 .arw ...). */
bool weft_raw_is_name(const char *path);

#endif
