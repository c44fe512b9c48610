/**
 * What others captured, as a set and a calibration of distant lights (docs/import.md).
 *
 * Four kinds are known: an RTI light-position file (.lp), a folder that holds one, a folder with
 * light_directions.txt (the layout of the DiLiGenT benchmark), and a plain folder of camera raws in the
 * order of the lights.  The last says nothing about the lights, so it makes a set alone.
 */
#ifndef WEFT_HOST_SET_IMPORT_H
#define WEFT_HOST_SET_IMPORT_H

#include "core/error.h"

#include <stdbool.h>

/** How 8-bit pictures stand for light.  AUTO: 8 bits are sRGB, more are linear (docs/formats.md). */
typedef enum weft_import_transfer {
    WEFT_IMPORT_AUTO,
    WEFT_IMPORT_LINEAR,
    WEFT_IMPORT_SRGB
} weft_import_transfer;

typedef struct weft_import_options {
    weft_import_transfer transfer;
    bool copy;  /* copy the pictures into the set; else set.json names them where they are */
    bool force; /* replace a set or calibration that is there */
} weft_import_options;

typedef struct weft_import_result {
    const char *kind; /* "lp", "directions", "raw" */
    int n_lights, width, height;
    bool has_calibration;
    bool srgb; /* the pictures are taken as sRGB codes */
    int bits;  /* of the pictures; 0 for EXR and raws */
    /* Rms misfit of a Lambertian surface, relative to the rms of the light, when the pictures are taken
     * as linear and as sRGB; 0 when it was not measured (raws, EXR). */
    double misfit_linear, misfit_srgb;
} weft_import_result;

/**
 * Imports `path` into the set `set_folder` and, for the kinds that know directions, the calibration
 * `cal_folder`.
 *
 * The .lp reader takes what is found in the wild: spaces, quotes and numbers in names, absolute and
 * Windows paths (the name is then looked for beside the .lp), decimal commas, further columns, a missing
 * or wrong count.  What was guessed is said as a warning.  When 8-bit pictures fit a Lambertian surface
 * clearly better under the other transfer, that is said too.
 *
 * @param cal_folder  NULL: beside the set, NAME.cal for NAME.set
 * @return WEFT_ERR_EXISTS before any work; WEFT_ERR_MISSING naming the picture that is not there and the
 *         line that wants it; WEFT_ERR_FORMAT, _MISMATCH, _RANGE naming file and line
 */
weft_err weft_import(const char *path, const char *set_folder, const char *cal_folder,
                     const weft_import_options *options, weft_import_result *result, weft_error *err);

#endif
