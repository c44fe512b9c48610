/** One frame's file as linear light: the decoding behind plate.h. */
#ifndef WEFT_HOST_SET_FRAME_FILE_H
#define WEFT_HOST_SET_FRAME_FILE_H

#include "host/set/set.h"

/** Of a file (%s) that is no frame by its name. */
#define WEFT_FRAME_NOT_READ                                                                                  \
    "%s: is no camera raw, PNG, TIFF or EXR by its name (a JPEG is too coarse for normals)"

/**
 * Reads a frame as (DN - black) / (white - black) * scale.
 *
 * Camera raws bring black, white and CFA themselves and must agree with the set; mosaics in 16-bit PNG and
 * TIFF take them from the set; RGB and grey pictures are decoded by the set's transfer (8 bit) or as linear
 * (16 bit, EXR).  Values that are not finite become 0 and clipped.
 *
 * @param scale    1 / (exposure * gain)
 * @param clipped  255 at and beside saturated photosites of a mosaic, whatever their colours: a clipped
 *                 site spoils its neighbours too (crosstalk).  Of pictures, where any channel is at its top.
 */
weft_err weft_frame_read(const weft_set *set, int frame, double scale, weft_image *image, weft_mask *clipped,
                         weft_error *err);

#endif
