/**
 * Plates: the linear light of a set, ready for computing.
 *
 * A plate is what one light alone put on the sensor: (DN - black) / (white - black) / exposure_s / gain,
 * brackets merged by noise (bracket.h), the ambient plate subtracted.  Two exposures of one scene give the
 * same plate.
 */
#ifndef WEFT_HOST_SET_PLATE_H
#define WEFT_HOST_SET_PLATE_H

#include "core/image.h"
#include "host/set/set.h"

typedef struct weft_plate {
    weft_image image;   /* 1 plane: mosaic or grey; 3 planes: RGB.  1/s at gain 1 */
    weft_cfa cfa;       /* WEFT_CFA_NONE for grey and RGB */
    weft_mask clipped;  /* non-zero where the value is not trustworthy: saturated in every exposure */
    double noise_floor; /* read noise as linear value, for "below 3 sigma of black is shadow"; 0 unknown */
} weft_plate;

void weft_plate_fini(weft_plate *plate);

/** Reads one frame without ambient subtraction.  Checks size, CFA, sha256 (when recorded) and names the
 *  file in every failure. */
weft_err weft_plate_load_frame(const weft_set *set, int frame, weft_plate *plate, weft_error *err);

/** Reads a light: all its frames merged, minus the ambient plate when `ambient` is not NULL. */
weft_err weft_plate_load_light(const weft_set *set, int light, const weft_plate *ambient, weft_plate *plate,
                               weft_error *err);

/** Reads the ambient plate; `*present` false (and the plate {0}) when the set has none. */
weft_err weft_plate_load_ambient(const weft_set *set, weft_plate *plate, bool *present, weft_error *err);

/** Reads the set's mask; all inside when it has none. */
weft_err weft_set_load_mask(const weft_set *set, weft_mask *mask, weft_error *err);

/** How to make three planes of one. */
typedef enum weft_demosaic {
    WEFT_DEMOSAIC_LINEAR, /* gradient-corrected bilinear, full size (Malvar, He, Cutler 2004) */
    WEFT_DEMOSAIC_HALF,   /* 2x2 cells: half size, greens averaged; pixel (i, j) centre is (2i+.5, 2j+.5) */
} weft_demosaic;

/** RGB plate from a mosaic plate; `clipped` grows to every pixel that used a clipped site.
 *  RGB and grey plates are copied (grey to three equal planes); HALF averages 2x2 there. */
weft_err weft_plate_demosaic(const weft_plate *mosaic, weft_demosaic how, weft_plate *rgb, weft_error *err);

#endif
