/** TIFF files: plain pictures, and Bayer frames as DNG (libtiff). */
#ifndef WEFT_CORE_FORMATS_TIFF_FILE_H
#define WEFT_CORE_FORMATS_TIFF_FILE_H

#include "core/formats/raster.h"
#include "core/image.h"

/** Reads a grey or RGB(A) TIFF of 8 or 16 bit. */
weft_err weft_tiff_read(const char *path, weft_raster *raster, weft_error *err);
/** Writes an 8- or 16-bit TIFF, whole or not at all. */
weft_err weft_tiff_write(const char *path, const weft_raster *raster, weft_error *err);

/** The same with what the file says of the picture.  @param note  may be NULL */
weft_err weft_tiff_write_noted(const char *path, const weft_raster *raster, const weft_raster_note *note,
                               weft_error *err);

/** What a raw frame says of itself.  Unknown numbers are 0, unknown texts empty. */
typedef struct weft_frame_info {
    double exposure_s;
    double gain; /* analogue gain, linear; 1 = base */
    double iso;  /* ISO speed; 0 unknown */
    double f_number;
    char make[64], model[64], serial[64];
    char date_time[32];        /* "2026:11:23 10:00:00" as EXIF spells it */
    double as_shot_neutral[3]; /* camera RGB of white, green 1; all 0 unknown */
    double xyz_to_camera[9];   /* DNG ColorMatrix1 for D65; all 0 unknown */
} weft_frame_info;

/** Writes a mosaic as an uncompressed 16-bit CFA DNG 1.4 with the tags that LibRaw, dcraw, darktable and
 *  exiftool ask for (docs/formats.md), whole or not at all. */
weft_err weft_dng_write(const char *path, const weft_mosaic *mosaic, const weft_frame_info *info,
                        weft_error *err);

#endif
