/** JPEG in memory: libjpeg-turbo. */
#ifndef WEFT_CORE_FORMATS_JPEG_BYTES_H
#define WEFT_CORE_FORMATS_JPEG_BYTES_H

#include "core/formats/raster.h"

#include <stddef.h>
#include <stdint.h>

/**
 * Codes a picture, colour at half resolution (4:2:0).
 *
 * @param rgb      [height][width][3], sRGB
 * @param quality  1..100
 * @param bytes    gets it on the heap: weft_jpeg_free()
 */
weft_err weft_jpeg_encode(const uint8_t *rgb, int width, int height, int quality, unsigned char **bytes,
                          size_t *n, weft_error *err);
void weft_jpeg_free(unsigned char *bytes);

/** Decodes a JPEG as RGB of 8 bits.
 *  @return WEFT_ERR_FORMAT when it is damaged or claims more pixels than its bytes can hold */
weft_err weft_jpeg_decode(const unsigned char *bytes, size_t n, weft_raster *raster, weft_error *err);

#endif
