/** What all lights of a set put on the sensor, handed out row by row in colour. */
#ifndef WEFT_HOST_SOLVE_LIGHT_PLATES_H
#define WEFT_HOST_SOLVE_LIGHT_PLATES_H

#include "host/set/plate.h"
#include "host/solve/solve_row.h"

typedef struct weft_light_plates {
    int n;
    bool mosaic; /* colour is made band by band; else the plates are grey or RGB at solving size */
    weft_plate plate[WEFT_LIGHTS_MAX];
    weft_plate colour[WEFT_LIGHTS_MAX]; /* of the band, mosaics only */
    int colour_row;                     /* solved row that is row 0 of `colour` */
} weft_light_plates;

/** Reads every light, the ambient plate subtracted; `half` halves pictures without a mosaic at once.
 *  Shows progress.  @return what the readers say, WEFT_ERR_MISMATCH for plates that differ. */
weft_err weft_light_plates_load(const weft_set *set, bool half, weft_light_plates *plates, weft_error *err);
void weft_light_plates_fini(weft_light_plates *plates);

/** Makes the colour of `n` solved rows from row `first`; nothing to do without a mosaic.  The demosaicing
 *  sees a margin above and below, so bands join without a seam. */
weft_err weft_light_plates_make_band(weft_light_plates *plates, int first, int n, bool half, weft_error *err);

/** Points at solved row `row` of every light; with a mosaic it must lie in the band. */
void weft_light_plates_row(const weft_light_plates *plates, int row, weft_solve_row_in in[WEFT_LIGHTS_MAX]);

#endif
