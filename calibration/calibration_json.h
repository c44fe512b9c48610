/** The parts of calibration.json (docs/formats.md), between JSON and the structs.  Internal. */
#ifndef WEFT_CALIBRATION_CALIBRATION_JSON_H
#define WEFT_CALIBRATION_CALIBRATION_JSON_H

#include "calibration/calibration.h"

/**
 * Fills the parts that `root` has, all but the grid's gains.
 *
 * @param place      path of the file, for messages
 * @param grid_file  gets the name of the grid's file, which lives as long as `root`; NULL when it has none
 * @return WEFT_ERR_FORMAT, _RANGE or _UNSUPPORTED naming file and key
 */
weft_err weft_calibration_from_json(const json_t *root, const char *place, weft_calibration *cal,
                                    const char **grid_file, weft_error *err);

/** All parts as one object with the keys of `cal->other` behind them; NULL without memory. */
json_t *weft_calibration_to_json(const weft_calibration *cal, const char *created, const char *grid_file);

#endif
