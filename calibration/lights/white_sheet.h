/** A white sheet under each light, averaged into cells: what the light fit sees. */
#ifndef WEFT_CALIBRATION_LIGHTS_WHITE_SHEET_H
#define WEFT_CALIBRATION_LIGHTS_WHITE_SHEET_H

#include "calibration/calibration.h"
#include "core/image.h"

/** Share of a plate's pixels that may be saturated (hot pixels) before it is refused. */
#define WEFT_WHITE_SHEET_CLIPPED_MOST 1e-3

typedef struct weft_white_sheet {
    int width, height; /* px of the frames */
    int cell_px;       /* even; cell (i, j) holds the pixels from (i, j) * cell_px on */
    int columns, rows;
    int n_lights;
    float *value; /* [light][channel 3][rows][columns] linear value, 1/s at gain 1; NaN: left out */
} weft_white_sheet;

/** Cells of about 1/80 of the frame's width (an even number of pixels, 2 or more); all left out so far. */
weft_err weft_white_sheet_init(weft_white_sheet *sheet, int width, int height, int n_lights, weft_error *err);
void weft_white_sheet_fini(weft_white_sheet *sheet);

/**
 * Averages a plate into the cells of a light, colour by colour.  A cell with a saturated pixel is left out.
 *
 * @param image    1 plane (a mosaic when `cfa` says so, else grey) or 3 planes RGB
 * @param clipped  non-zero where the value is not trustworthy
 * @return WEFT_ERR_MISMATCH for another size, WEFT_ERR_RANGE for values that are not finite and for a sheet
 *         of which more than WEFT_WHITE_SHEET_CLIPPED_MOST is saturated, naming the light
 */
weft_err weft_white_sheet_add(weft_white_sheet *sheet, int light, const weft_image *image, weft_cfa cfa,
                              const weft_mask *clipped, weft_error *err);

static inline float *weft_white_sheet_plane(const weft_white_sheet *sheet, int light, int channel)
{
    return sheet->value + (size_t)(light * 3 + channel) * (size_t)(sheet->columns * sheet->rows);
}

/** Pixel coordinate of the middle of cell column (or row) i. */
static inline double weft_white_sheet_centre(const weft_white_sheet *sheet, int i)
{
    return (i + 0.5) * sheet->cell_px - 0.5;
}

#endif
