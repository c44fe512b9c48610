/** What the camera sees, for the one who watches (core/report_channel.h): a small picture, histograms,
 * clipping. */
#ifndef WEFT_HOST_CAPTURE_LIVE_PICTURE_H
#define WEFT_HOST_CAPTURE_LIVE_PICTURE_H

#include "core/image.h"

#include <jansson.h>
#include <stdint.h>

#define WEFT_LIVE_SIDE 1024 /* px, the longest side of a picture at most */
#define WEFT_LIVE_BINS 64   /* of a histogram: equal parts of the range from black to white */

/** Counts of one frame, for each colour of the filter array. */
typedef struct weft_live_stats {
    uint32_t bins[3][WEFT_LIVE_BINS]; /* photosites; the last bin includes the clipped ones */
    double mean[3];                   /* share of the range */
    double clipped[3];                /* share of the photosites at or above white */
} weft_live_stats;

/** @return WEFT_ERR_UNSUPPORTED without a filter array */
weft_err weft_live_stats_make(const weft_mosaic *mosaic, weft_live_stats *stats, weft_error *err);

/**
 * A picture for looking at: whole cells of the filter array averaged, each colour scaled so that the frame is
 * grey on average, sRGB.
 *
 * @param rgb  gets [*height][*width][3] on the heap: weft_free()
 */
weft_err weft_live_picture_make(const weft_mosaic *mosaic, const weft_live_stats *stats, uint8_t **rgb,
                                int *width, int *height, weft_error *err);

/** Reports the frame when somebody listens, at most five times a second.  A failure is only explained:
 * looking must not stop a scan. */
void weft_live_picture_report(const char *name, const weft_mosaic *mosaic);

#endif
