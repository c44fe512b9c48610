/** What a raw frame looks like in numbers: is it lit, is it clipped. */
#ifndef WEFT_HOST_CAPTURE_FRAME_STATS_H
#define WEFT_HOST_CAPTURE_FRAME_STATS_H

#include "core/image.h"

#include <jansson.h>

/** Of one colour of the filter array.  Shares of the range: (DN - black) / (white - black). */
typedef struct weft_colour_stats {
    double mean;
    double middle;  /* half of the photosites lie at or below */
    double high;    /* 99.9 % lie at or below */
    double top;     /* 99.99 % lie at or below */
    double max;     /* the brightest photosite */
    double clipped; /* share of the photosites at or above white, 0..1 */
} weft_colour_stats;

typedef struct weft_frame_stats {
    weft_colour_stats colours[3]; /* red, green, blue */
    double mean;                  /* of all photosites */
} weft_frame_stats;

/** @return WEFT_ERR_NOMEM */
weft_err weft_frame_stats_make(const weft_mosaic *mosaic, weft_frame_stats *stats, weft_error *err);

/** The largest of the three colours' `high` / `clipped`. */
double weft_frame_stats_high(const weft_frame_stats *stats);
double weft_frame_stats_clipped(const weft_frame_stats *stats, const char **colour);

/** {"mean":[r,g,b],"middle":[...],"high":[...],"top":[...],"max":[...],"clipped":[...]}; NULL without
 *  memory. */
json_t *weft_frame_stats_to_json(const weft_frame_stats *stats);

#endif
