/**
 * The colours that a chart vouches for: the convex hull of its patches in linear sRGB (S-FC3-04).
 *
 * A model fitted to the patches extrapolates beyond them; what lies outside is to be looked at.
 */
#ifndef WEFT_CALIBRATION_GAMUT_H
#define WEFT_CALIBRATION_GAMUT_H

#include "core/image.h"

#define WEFT_GAMUT_MAX_POINTS 48
#define WEFT_GAMUT_MAX_FACES  (2 * WEFT_GAMUT_MAX_POINTS) /* a hull of n points has at most 2n - 4 */

/** Outside by more than this (linear, 1 = white) counts. */
#define WEFT_GAMUT_TOLERANCE 0.005

typedef struct weft_gamut {
    int n_faces;                          /* 0: no hull, nothing is outside */
    float faces[WEFT_GAMUT_MAX_FACES][4]; /* n . rgb - d: above 0 outside; n is of length 1 */
} weft_gamut;

/** What of a picture lies outside. */
typedef struct weft_gamut_survey {
    long counted, outside; /* pixels */
    double distance_max;   /* of the farthest from the hull's nearest face plane, linear */
    double distance_mean;  /* over those outside */
    long darker, brighter; /* of those outside: with less luminance than any patch, with more */
} weft_gamut_survey;

/** The hull of n points; points in one plane (a chart of greys) give none. */
void weft_gamut_init(weft_gamut *gamut, int n, const double (*points)[3]);

/** Distance beyond the hull, at most 0 inside. */
double weft_gamut_distance(const weft_gamut *gamut, const double rgb[3]);

/**
 * Counts the pixels outside.
 *
 * @param points  those of the hull, for the range of luminance
 * @param image   three planes, linear sRGB
 * @param mask    0: not counted; NULL: all
 */
void weft_gamut_look(const weft_gamut *gamut, int n, const double (*points)[3], const weft_image *image,
                     const weft_mask *mask, weft_gamut_survey *survey);

#endif
