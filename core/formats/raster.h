/** Interleaved 8- or 16-bit pictures as PNG and TIFF hold them: the step between a file and weft_image. */
#ifndef WEFT_CORE_FORMATS_RASTER_H
#define WEFT_CORE_FORMATS_RASTER_H

#include "core/error.h"
#include "core/image.h"

#include <stdint.h>

typedef struct weft_raster {
    int width, height;
    int channels;   /* 1 grey, 2 grey+alpha, 3 RGB, 4 RGBA */
    int bits;       /* 8 or 16: what the file had; the samples are always stored as uint16_t */
    uint16_t *data; /* [height][width][channels], 0..(1 << bits) - 1 */
} weft_raster;

/** What a file says of its picture besides the samples.  Borrowed; NULL and 0: not said. */
typedef struct weft_raster_note {
    const void *icc; /* ICC profile */
    size_t icc_size;
    const char *description, *software;
    const char *make, *model, *date_time; /* of the camera; TIFF only */
} weft_raster_note;

weft_err weft_raster_init(weft_raster *raster, int width, int height, int channels, int bits,
                          weft_error *err);
void weft_raster_fini(weft_raster *raster);

/** How numbers in a file stand for light. */
typedef enum weft_transfer {
    WEFT_TRANSFER_LINEAR,
    WEFT_TRANSFER_SRGB,
    WEFT_TRANSFER_BY_BITS, /* of colours, by docs/conventions.md: sRGB in 8 bits, linear in 16 */
} weft_transfer;

/** Planes 0..1 (alpha dropped) from a raster; sRGB codes are decoded to linear when asked. */
weft_err weft_image_from_raster(weft_image *image, const weft_raster *raster, weft_transfer transfer,
                                weft_error *err);
/** A raster of `bits` from 1 or 3 planes 0..1, clamped, NaN as 0, rounded to nearest. */
weft_err weft_raster_from_image(weft_raster *raster, const weft_image *image, int bits,
                                weft_transfer transfer, weft_error *err);

#endif
