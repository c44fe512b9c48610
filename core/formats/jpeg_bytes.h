/** JPEG in memory, for looking at: libjpeg-turbo. */
#ifndef WEFT_CORE_FORMATS_JPEG_BYTES_H
#define WEFT_CORE_FORMATS_JPEG_BYTES_H

#include "core/error.h"

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

#endif
