/** What each calibration step says of itself, kept under "reports" of calibration.json. */
#ifndef WEFT_CALIBRATION_CALIBRATION_REPORT_H
#define WEFT_CALIBRATION_CALIBRATION_REPORT_H

#include "calibration/calibration.h"

/** Reads a calibration, or begins an empty one where there is no calibration.json yet. */
weft_err weft_calibration_open(const char *folder, weft_calibration *cal, weft_error *err);

/**
 * Puts a step's report in place of its former one: cal->other["reports"][step].
 *
 * @param step    "lens", "lights", "linearity", "white", "colour"
 * @param report  taken over, also on failure; NULL is an out-of-memory error, so that json_pack() needs no
 * check. "created" (now) and "software" (name and version) are added to it
 */
weft_err weft_calibration_set_report(weft_calibration *cal, const char *step, json_t *report,
                                     weft_error *err);

/** The report of a step, borrowed; NULL when there is none. */
const json_t *weft_calibration_get_report(const weft_calibration *cal, const char *step);

#endif
