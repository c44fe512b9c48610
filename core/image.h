/**
 * Pictures in memory.
 *
 * weft_image is planar float: what every stage computes with.  weft_mosaic is the untouched plane of a
 * Bayer sensor.  Row 0 is the top row; pixel (u, v) is column u, row v, its centre at (u, v).
 */
#ifndef WEFT_CORE_IMAGE_H
#define WEFT_CORE_IMAGE_H

#include "core/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** Refused above this: a header that claims more is damaged (the largest medium-format backs have 15000). */
#define WEFT_IMAGE_MAX_SIDE   32768
#define WEFT_IMAGE_MAX_PLANES 384 /* a gain map of 128 lights in three channels */

typedef struct weft_image {
    int width, height, planes;
    float *data; /* [planes][height][width] */
} weft_image;

/** Zeroed image.  @return WEFT_ERR_RANGE for sides outside 1..WEFT_IMAGE_MAX_SIDE, WEFT_ERR_NOMEM. */
weft_err weft_image_init(weft_image *image, int width, int height, int planes, weft_error *err);
/** Frees the data; `{0}` is fine. */
void weft_image_fini(weft_image *image);
/** Deep copy into an uninitialised `copy`. */
weft_err weft_image_copy(weft_image *copy, const weft_image *image, weft_error *err);

static inline size_t weft_image_plane_size(const weft_image *image)
{
    return (size_t)image->width * (size_t)image->height;
}

static inline float *weft_image_plane(const weft_image *image, int plane)
{
    return image->data + (size_t)plane * weft_image_plane_size(image);
}

static inline float *weft_image_row(const weft_image *image, int plane, int row)
{
    return weft_image_plane(image, plane) + (size_t)row * (size_t)image->width;
}

/** Bilinear sample of one plane at (u, v) in pixels; outside, the nearest edge pixel. */
float weft_image_sample(const weft_image *image, int plane, double u, double v);

/** Byte per pixel: 0 is "not the sample" / "no answer". */
typedef struct weft_mask {
    int width, height;
    uint8_t *data; /* [height][width] */
} weft_mask;

weft_err weft_mask_init(weft_mask *mask, int width, int height, uint8_t value, weft_error *err);
void weft_mask_fini(weft_mask *mask);

/** Colour filter array: which colour is at (u & 1, v & 1).  Spelled row by row from the top left. */
typedef enum weft_cfa { WEFT_CFA_NONE, WEFT_CFA_RGGB, WEFT_CFA_GRBG, WEFT_CFA_GBRG, WEFT_CFA_BGGR } weft_cfa;

/** @return "RGGB", ..., "none". */
const char *weft_cfa_name(weft_cfa cfa);
/** The CFA of a name; false when unknown. */
bool weft_cfa_from_name(const char *name, weft_cfa *cfa);

/** Colour 0 red, 1 green, 2 blue of photosite (u, v); not for WEFT_CFA_NONE. */
static inline int weft_cfa_colour(weft_cfa cfa, int u, int v)
{
    static const uint8_t table[5][4] = {{0, 0, 0, 0}, {0, 1, 1, 2}, {1, 0, 2, 1}, {1, 2, 0, 1}, {2, 1, 1, 0}};
    return table[cfa][(v & 1) * 2 + (u & 1)];
}

/** Raw sensor numbers (DN) of a Bayer sensor. */
typedef struct weft_mosaic {
    int width, height;
    weft_cfa cfa;
    float black[4]; /* DN, of the 2x2 cell row by row */
    float white;    /* DN at which the sensor or converter saturates */
    uint16_t *data; /* [height][width] */
} weft_mosaic;

weft_err weft_mosaic_init(weft_mosaic *mosaic, int width, int height, weft_cfa cfa, weft_error *err);
void weft_mosaic_fini(weft_mosaic *mosaic);

#endif
