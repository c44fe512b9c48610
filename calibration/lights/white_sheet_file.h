/** The averaged white sheet beside a calibration, so that a report can hold the lights against it later. */
#ifndef WEFT_CALIBRATION_LIGHTS_WHITE_SHEET_FILE_H
#define WEFT_CALIBRATION_LIGHTS_WHITE_SHEET_FILE_H

#include "calibration/lights/white_sheet.h"

/** Its name in the folder of a calibration. */
#define WEFT_WHITE_SHEET_FILE "white-sheet.exr"

/** Writes `folder`/white-sheet.exr: floats, the channels light00.R, light00.G, ...; cells left out are
 * NaN. */
weft_err weft_white_sheet_save(const char *folder, const weft_white_sheet *sheet, weft_error *err);

/** Reads it for a calibration's lights and frame size.  @return WEFT_ERR_IO when it is not there,
 * WEFT_ERR_FORMAT, WEFT_ERR_MISMATCH when it is of other frames or lights */
weft_err weft_white_sheet_load(const char *folder, const weft_calibration *cal, weft_white_sheet *sheet,
                               weft_error *err);

/** A sheet to predict: flat and matte. */
typedef struct weft_sheet_kind {
    double reflectance, height_mm; /* of its surface over the plate */
} weft_sheet_kind;

/** What the calibration predicts for the middle of a cell; NaN where the pixel does not meet the sheet. */
double weft_white_sheet_predict(const weft_white_sheet *sheet, const weft_calibration *cal,
                                const weft_sheet_kind *kind, int light, int channel, int column, int row,
                                bool with_grid);

#endif
