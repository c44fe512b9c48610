/** The mean of several frames of one scene: its noise is smaller by the root of their number. */
#ifndef WEFT_HOST_CAPTURE_AVERAGE_H
#define WEFT_HOST_CAPTURE_AVERAGE_H

#include "core/image.h"

/** More would overflow nothing, but a bracket does it better. */
#define WEFT_AVERAGE_MAX 256

typedef struct weft_average {
    uint32_t *sum; /* [height][width] */
    size_t n_sites;
    int n;         /* frames so far */
    bool *clipped; /* a frame was at white there: the mean would look darker than the truth */
    uint16_t white;
} weft_average;

/** Adds a frame; the first one sets the size.  `{0}` before.
 *  @return WEFT_ERR_MISMATCH when a later frame has another size, WEFT_ERR_NOMEM */
weft_err weft_average_add(weft_average *average, const weft_mosaic *frame, weft_error *err);

/** Writes the mean, rounded to a number of the sensor, over `frame`, which must be of the size.  A photosite
 *  that clipped in any of the frames keeps white. */
void weft_average_get(const weft_average *average, weft_mosaic *frame);

void weft_average_fini(weft_average *average);

#endif
