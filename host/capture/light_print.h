/**
 * Whose light a frame was taken by, as far as the picture tells: the coarse shape of the light on the sample.
 *
 * The controller says which of its outputs were on, not which lamp shone.  Near lamps in different places
 * brighten different sides of the sample, so the frames of two lights differ in shape however alike they are
 * in brightness, and the frames of one light have one shape at every exposure.
 */
#ifndef WEFT_HOST_CAPTURE_LIGHT_PRINT_H
#define WEFT_HOST_CAPTURE_LIGHT_PRINT_H

#include "core/image.h"

#include <stdbool.h>

enum {
    WEFT_PRINT_COLUMNS = 12,
    WEFT_PRINT_ROWS = 8,
    WEFT_PRINT_CELLS = WEFT_PRINT_COLUMNS * WEFT_PRINT_ROWS
};

/** Two frames that differ by less show the light of one lamp.  On the virtual scanner those of one light
 * differ by 0.0008 at most, exposures a factor of 16 apart among them, those of two lights by 0.077 at least
 * (white sheet, satin, denim at 616 x 408). */
#define WEFT_PRINT_SAME_SHAPE 0.005

/** Zeroed: of no frame. */
typedef struct weft_light_print {
    double time;                    /* exposure times gain, s; 0: there is none */
    float cell[WEFT_PRINT_CELLS];   /* mean share of the range, [rows][columns] */
    bool clipped[WEFT_PRINT_CELLS]; /* more than a thousandth of it is at white */
} weft_light_print;

weft_light_print weft_light_print_make(const weft_mosaic *mosaic, double time);

/**
 * By how much the shapes of two frames differ: rms over the cells that clip in neither, of light (without
 * that of `dark`) over its mean.
 *
 * @param dark  of a frame without lights; time 0: none is subtracted
 * @return 0 for one shape, some 0.05 to 1 for lamps of a dome; -1 when a frame is too dark or clips too much
 *         to tell
 */
double weft_light_print_difference(const weft_light_print *a, const weft_light_print *b,
                                   const weft_light_print *dark);

#endif
