/**
 * Plain photographs: of any camera, under any light, without a scanner.
 *
 * A photo is linear light as the file has it: (DN - black) / (white - black) of a raw, 0..1 of a picture.
 */
#ifndef WEFT_HOST_PHOTO_PHOTO_H
#define WEFT_HOST_PHOTO_PHOTO_H

#include "core/formats/raster.h"
#include "core/formats/tiff_file.h"
#include "core/image.h"

/** What the numbers of PNG and TIFF pictures are; raw and EXR are linear whatever it says. */
typedef enum weft_photo_transfer {
    WEFT_PHOTO_AUTO, /* 8 bit: sRGB; 16 bit: linear (docs/formats.md) */
    WEFT_PHOTO_LINEAR,
    WEFT_PHOTO_SRGB,
} weft_photo_transfer;

typedef struct weft_photo {
    weft_image image;     /* 1 plane (mosaic) or 3 (RGB) */
    weft_cfa cfa;         /* WEFT_CFA_NONE for RGB */
    weft_mask clipped;    /* non-zero: at the end of the range, or next to such a photosite */
    weft_frame_info info; /* of raws; else empty */
    double exposure;      /* seconds x ISO / 100 / f-number^2; 0 unknown */
} weft_photo;

/** Reads a raw (DNG, NEF, CR2, ...), TIFF, PNG or EXR.  @return WEFT_ERR_FORMAT for grey pictures too */
weft_err weft_photo_read(const char *path, weft_photo_transfer transfer, weft_photo *photo, weft_error *err);
void weft_photo_fini(weft_photo *photo);

/** How uneven the light is: a blank sheet, smoothed, relative to its middle. */
typedef struct weft_photo_flat {
    int width, height; /* of the photographs it is for */
    weft_image gain;   /* 3 planes, small: what to divide by; {0}: no flat, 1 everywhere */
} weft_photo_flat;

/**
 * Makes it of a photograph of a blank sheet.
 *
 * @return WEFT_ERR_RANGE with the figure when it is clipped (above 0.1 %), too dark (mean below 3 %), or
 * shows something that is no even sheet
 */
weft_err weft_photo_flat_make(const weft_photo *sheet, weft_photo_flat *flat, weft_error *err);
void weft_photo_flat_fini(weft_photo_flat *flat);

/** Divides a photograph by it.  @return WEFT_ERR_MISMATCH for another size */
weft_err weft_photo_flatten(weft_photo *photo, const weft_photo_flat *flat, weft_error *err);

/** Multiplies the channels, cuts what is brighter than the first channel to clip (no coloured highlights),
 * and makes three planes of a mosaic. */
weft_err weft_photo_develop(weft_photo *photo, const double gain[3], weft_error *err);

#endif
