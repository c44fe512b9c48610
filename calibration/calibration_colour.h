/** The "colour" part of calibration.json. */
#ifndef WEFT_CALIBRATION_CALIBRATION_COLOUR_H
#define WEFT_CALIBRATION_CALIBRATION_COLOUR_H

#include "calibration/calibration.h"

/** Reads the part; `file` is for messages.  @return WEFT_ERR_FORMAT, WEFT_ERR_RANGE, WEFT_ERR_UNSUPPORTED */
weft_err weft_calibration_colour_from_json(const json_t *object, weft_colour_part *colour, const char *file,
                                           weft_error *err);

/** The part as an object; NULL without memory. */
json_t *weft_calibration_colour_to_json(const weft_colour_part *colour);

/** The version of the file that the part needs: 1 for a matrix alone, which every Weft reads; else 2. */
int weft_calibration_colour_version(const weft_colour_part *colour);

#endif
