/** The JPEG that a body makes of its raw picture: half the size, gamma 1/2.2, no white balance. */
#ifndef WEFT_HOST_RIG_PREVIEW_JPEG_H
#define WEFT_HOST_RIG_PREVIEW_JPEG_H

#include "core/error.h"

#include <stddef.h>
#include <stdint.h>

/** @param dn  [height][width], RGGB, black to white.  @param bytes  weft_free() it */
weft_err weft_preview_jpeg(int width, int height, const uint16_t *dn, double black, double white,
                           uint8_t **bytes, size_t *n_bytes, weft_error *err);

#endif
