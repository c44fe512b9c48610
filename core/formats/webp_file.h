/** Animated WebP files (libwebp): pictures of a sequence one after the other, for ever. */
#ifndef WEFT_CORE_FORMATS_WEBP_FILE_H
#define WEFT_CORE_FORMATS_WEBP_FILE_H

#include "core/formats/raster.h"

/** A file under construction; its frames are compressed as they come. */
typedef struct weft_webp weft_webp;

/**
 * Begins an animation of pictures of one size.
 *
 * @param frames_per_s  0.1..100; a frame is shown a whole number of milliseconds, the last as long as the
 * mean
 * @param quality       0..100 as in cwebp; 100 is lossless (to the code)
 * @return WEFT_ERR_RANGE for sides above 16383, which WebP cannot hold; WEFT_ERR_NOMEM
 */
weft_err weft_webp_begin(weft_webp **webp, int width, int height, double frames_per_s, int quality,
                         weft_error *err);

/** Adds a picture of 8 bits, grey or RGB.  @return WEFT_ERR_MISMATCH for another size or kind, WEFT_ERR_NOMEM
 */
weft_err weft_webp_add(weft_webp *webp, const weft_raster *picture, weft_error *err);

/** Writes the file, whole or not at all.  @return WEFT_ERR_NODATA without frames, WEFT_ERR_IO, WEFT_ERR_NOMEM
 */
weft_err weft_webp_write(weft_webp *webp, const char *path, weft_error *err);

/** Frees it; NULL is fine. */
void weft_webp_destroy(weft_webp *webp);

#endif
