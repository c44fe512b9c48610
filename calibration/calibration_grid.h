/** The grid of gains as an EXR file: a float channel per light and colour, "light00.R".  Internal. */
#ifndef WEFT_CALIBRATION_CALIBRATION_GRID_H
#define WEFT_CALIBRATION_CALIBRATION_GRID_H

#include "calibration/calibration.h"

/** Names of the channels of an EXR file with a plane a light and colour: "light00.R", "light00.G", ... */
typedef struct weft_light_channels {
    char text[3 * WEFT_LIGHTS_MAX][16];
    const char *names[3 * WEFT_LIGHTS_MAX];
} weft_light_channels;

/** Fills the first n names. */
void weft_light_channels_name(weft_light_channels *channels, int n);

/** Reads cal->grid.columns x rows gains of cal->n_lights lights into a new cal->grid.gain.
 *  @return WEFT_ERR_MISMATCH for another size, WEFT_ERR_RANGE for gains that are not above 0 */
weft_err weft_calibration_grid_load(const char *path, weft_calibration *cal, weft_error *err);

/** Writes the gains, whole or not at all. */
weft_err weft_calibration_grid_save(const char *path, const weft_calibration *cal, weft_error *err);

/** Number of gains: lights x 3 x rows x columns. */
size_t weft_calibration_grid_size(const weft_calibration *cal);

#endif
