/** Noise, gain and saturation of a set's sensor, for the report of `weft calibrate linearity`. */
#ifndef WEFT_HOST_CLI_SENSOR_REPORT_H
#define WEFT_HOST_CLI_SENSOR_REPORT_H

#include "host/set/set.h"

/**
 * Photon transfer over the raw frames of one analogue gain (calibration/sensor_noise.h).
 *
 * @param offset  [4] of full scale that the exposure series found at exposure 0; NULL without a series
 * @param noise   gets "noise" of the report: an array of four sites; NULL when the frames are no raws or too
 * few
 * @return WEFT_ERR_NOMEM, WEFT_ERR_CANCELLED
 */
weft_err weft_sensor_report(const weft_set *set, const double *offset, json_t **noise, weft_error *err);

#endif
