/** PNG files, 8 and 16 bit, grey to RGBA (libpng). */
#ifndef WEFT_CORE_FORMATS_PNG_FILE_H
#define WEFT_CORE_FORMATS_PNG_FILE_H

#include "core/formats/raster.h"
#include "core/text_buffer.h"

/** Reads a PNG; palettes and 1/2/4-bit greys are expanded.  WEFT_ERR_FORMAT names the file. */
weft_err weft_png_read(const char *path, weft_raster *raster, weft_error *err);
/** Writes a PNG of raster->bits, whole or not at all. */
weft_err weft_png_write(const char *path, const weft_raster *raster, weft_error *err);

/** The same with what the file says of the picture.  @param note  may be NULL */
weft_err weft_png_write_noted(const char *path, const weft_raster *raster, const weft_raster_note *note,
                              weft_error *err);

/** Appends the bytes of a PNG file to `out`, where failures stick. */
weft_err weft_png_encode(const weft_raster *raster, weft_text_buffer *out);

/** Reads any PNG as a mask: non-zero luminance is inside. */
weft_err weft_png_read_mask(const char *path, weft_mask *mask, weft_error *err);
/** Writes a mask as 8-bit grey 0 / 255. */
weft_err weft_png_write_mask(const char *path, const weft_mask *mask, weft_error *err);

/** As masks, but the bytes themselves: numbers and bits, one channel of 8 bits.
 *  @return WEFT_ERR_FORMAT from reading when the picture is of another kind */
weft_err weft_png_read_bytes(const char *path, weft_mask *bytes, weft_error *err);
weft_err weft_png_write_bytes(const char *path, const weft_mask *bytes, weft_error *err);

#endif
