/** What all lights of a set put on the sensor, handed out row by row. */
#ifndef WEFT_HOST_SOLVE_LIGHT_PLATES_H
#define WEFT_HOST_SOLVE_LIGHT_PLATES_H

#include "calibration/calibration.h"
#include "host/set/noise.h"
#include "host/set/plate.h"
#include "host/solve/solve_row.h"

/** Above this share of the range a value is taken for saturated (S-ORD-17). */
#define WEFT_SATURATION_SHARE 0.98

typedef struct weft_light_plates {
    int n, width, height; /* at solving size */
    weft_cfa cfa;         /* of mosaics at full size; NONE for grey and RGB, and at half size */
    weft_plate plate[WEFT_LIGHTS_MAX];
    weft_noise noise;                 /* of a frame, as parts of full scale; {0}: not known */
    double time[WEFT_LIGHTS_MAX];     /* exposure times gain, s: of a bracket the sum */
    double gathered[WEFT_LIGHTS_MAX]; /* the same, each times how many frames its file is the mean of */
    double most[WEFT_LIGHTS_MAX]; /* WEFT_SATURATION_SHARE of the (shortest) exposure's range as linear value;
                                     0 for pictures */
} weft_light_plates;

/** What becomes of the photosites of a mosaic. */
typedef enum weft_light_reading {
    WEFT_READ_SITES,  /* they stay what they are */
    WEFT_READ_HALF,   /* one RGB pixel of each 2x2 cell (or 2x2 pixels of a picture) */
    WEFT_READ_LINEAR, /* every frame is demosaiced first, as others do: for comparison, three times the memory
                       */
} weft_light_reading;

/** Reads every light, the ambient plate subtracted.
 *  Shows progress.  @return what the readers say, WEFT_ERR_MISMATCH for plates that differ. */
weft_err weft_light_plates_load(const weft_set *set, weft_light_reading reading, weft_light_plates *plates,
                                weft_error *err);
void weft_light_plates_fini(weft_light_plates *plates);

/**
 * Takes the noise of a frame from `sensor.noise` of the set, or from the photon transfer that
 * `weft calibrate linearity` measured, so that a sample's variance follows from its own value.  The fixed
 * pattern is no noise here: it is the same under every light and becomes albedo.  Shot noise grows with the
 * analogue gain, read noise with its square.
 *
 * Without either the noise of a light's darkest tenth, which each plate was read with, stands for all values.
 */
void weft_light_plates_know_noise(weft_light_plates *plates, const weft_set *set,
                                  const weft_calibration *cal);

/** Points at row `row` of every light. */
void weft_light_plates_row(const weft_light_plates *plates, int row, weft_solve_row_in in[WEFT_LIGHTS_MAX]);

/** The middle of part i of n equal parts of 0 .. `length` - 1. */
static inline int weft_spread_over(int length, int i, int n)
{
    const long twice = 2L * i + 1;
    return (int)(length * twice / (2L * n));
}

#endif
