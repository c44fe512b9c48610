/** The picture a chart is looked for in, and its reduced copy. */
#ifndef WEFT_CALIBRATION_CHARTS_CHART_PICTURE_H
#define WEFT_CALIBRATION_CHARTS_CHART_PICTURE_H

#include "core/error.h"
#include "core/image.h"

/** Borrowed: linear light, black subtracted. */
typedef struct weft_chart_picture {
    const weft_image *image;  /* 1 plane (mosaic or grey) or 3 (RGB) */
    weft_cfa cfa;             /* WEFT_CFA_NONE for grey and RGB */
    const weft_mask *clipped; /* non-zero: not trustworthy; NULL: nothing is clipped */
} weft_chart_picture;

/**
 * Averages square cells to R, G, B (three equal planes for grey pictures).
 *
 * @param side   of a cell in pixels; even for a mosaic; rows and columns that fill no cell are left out
 * @param cells  uninitialised; the centre of cell (i, j) is at pixel (side * (i + 0.5) - 0.5, ...)
 */
weft_err weft_chart_picture_reduce(const weft_chart_picture *picture, int side, weft_image *cells,
                                   weft_error *err);

/** Pixel coordinate to cell coordinate. */
static inline double weft_chart_to_cell(double u_px, int side)
{
    return (u_px + 0.5) / side - 0.5;
}

static inline double weft_chart_from_cell(double u_cell, int side)
{
    return (u_cell + 0.5) * side - 0.5;
}

/** How to make one plane of three; each channel is divided by its 95th percentile first. */
typedef enum weft_contrast {
    WEFT_CONTRAST_MAX,  /* the largest: every colour stands out against a dark frame, purple and blue too */
    WEFT_CONTRAST_MEAN, /* the mean: edges stay where they are (a maximum of noisy channels widens them) */
} weft_contrast;

/** One plane from the cells.  @param contrast  uninitialised */
weft_err weft_chart_picture_contrast(const weft_image *cells, weft_contrast how, weft_image *contrast,
                                     weft_error *err);

#endif
