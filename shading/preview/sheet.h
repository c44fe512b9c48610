/** Contact sheets: labelled tiles in a grid, and the ways in which maps are shown in them. */
#ifndef WEFT_SHADING_PREVIEW_SHEET_H
#define WEFT_SHADING_PREVIEW_SHEET_H

#include "core/error.h"
#include "core/image.h"

#define WEFT_SHEET_GROUND 0.025 /* linear grey of the sheet between the tiles */
#define WEFT_SHEET_NONE   0.18  /* and of places without an answer */

/** A sheet under construction: linear RGB, written with the sRGB curve. */
typedef struct weft_sheet {
    weft_image image; /* 3 planes */
    int columns, rows;
    int tile_width, tile_height; /* of the picture in a tile */
    int label_scale;             /* of the font */
    int top;                     /* height of the title */
} weft_sheet;

/** A grey sheet with its title; free with weft_sheet_fini(). */
weft_err weft_sheet_init(weft_sheet *sheet, int columns, int rows, int tile_width, int tile_height,
                         const char *title, weft_error *err);
void weft_sheet_fini(weft_sheet *sheet);

/** Puts a linear picture (1 or 3 planes) into a tile, scaled to fit by area, with its label below.  A label
 *  that is too long is cut. */
weft_err weft_sheet_place(weft_sheet *sheet, int column, int row, const weft_image *picture,
                          const char *label, weft_error *err);

/** Scales by area (every source pixel counts for its share), aspect as asked. */
weft_err weft_image_scale(weft_image *scaled, const weft_image *image, int width, int height,
                          weft_error *err);

/** Copies a rectangle, which must lie inside. */
weft_err weft_image_crop(weft_image *part, const weft_image *image, int x, int y, int width, int height,
                         weft_error *err);

/** A linear picture whose masked places are grey; mask may be NULL. */
weft_err weft_sheet_show_colour(weft_image *picture, const weft_image *colour, const weft_mask *mask,
                                weft_error *err);

/** Normals as the usual picture: code 0.5 + 0.5 n in sRGB-encoded values; masked or zero normals grey. */
weft_err weft_sheet_show_normals(weft_image *picture, const weft_image *normal, weft_error *err);

/**
 * One plane in false colour (viridis) from `low` to `high`; masked places (mask may be NULL) and NaN grey.
 */
weft_err weft_sheet_show_scalar(weft_image *picture, const weft_image *scalar, const weft_mask *mask,
                                double low, double high, weft_error *err);

/** The value below which `share` (0..1) of the unmasked finite values of one plane lie; 0 when none are. */
weft_err weft_image_quantile(const weft_image *image, int plane, const weft_mask *mask, double share,
                             double *value, weft_error *err);

#endif
