/**
 * How well the lights predict each other: each light's picture from all the others.
 *
 * For every pixel and light the normal and albedo are solved without that light, and what they say the light
 * should show is compared with what it did.  Nothing is fitted to what it is judged by, so noise, shadows,
 * gloss, and errors of the calibration all count: the figure that a user can publish without a ground truth.
 */
#ifndef WEFT_HOST_SOLVE_RELIGHT_H
#define WEFT_HOST_SOLVE_RELIGHT_H

#include "host/solve/solve.h"

typedef struct weft_relight {
    int n;
    size_t pixels;                    /* judged, per light about */
    double rms[WEFT_LIGHTS_MAX];      /* of predicted minus measured, in parts of full scale at the frame's
                                         exposure */
    double relative[WEFT_LIGHTS_MAX]; /* the same over the rms of the measured light */
    double bias[WEFT_LIGHTS_MAX];     /* mean of predicted minus measured over the mean measured: a wrong
                                         intensity */
    double rms_all, relative_all;
    weft_image map; /* 1 plane: rms over the lights relative to the pixel's brightest sample; 0: not judged */
} weft_relight;

void weft_relight_fini(weft_relight *relight);

/**
 * Judges a set in sensor geometry; options: method, half, height_mm and shadow count.  The method's model of
 * gloss is not used.
 *
 * Samples that the method may not use (saturated, below the noise) are not judged; shadows are.
 * @return what weft_solve_check() and the readers say; WEFT_ERR_NODATA when a light leaves fewer than three
 */
weft_err weft_relight_set(const weft_set *set, const weft_calibration *cal, const char *cal_folder,
                          const weft_solve_options *options, weft_relight *relight, weft_error *err);

#endif
