/** Which exposures each light of a set gets: what the options leave open is found out by looking. */
#ifndef WEFT_HOST_CAPTURE_EXPOSURES_H
#define WEFT_HOST_CAPTURE_EXPOSURES_H

#include "host/capture/capture.h"
#include "host/capture/shoot.h"

/** Gives every light what is given for all; lights that have their own keep it. */
void weft_exposures_apply(weft_capture_options *options);

/** Whether anything has to be looked for, after weft_exposures_apply(). */
bool weft_exposures_are_open(const weft_capture_options *options);

/**
 * Fills what is open in exposures_s, brackets and exposure_s: measured, one exposure for all lights that have
 * none, or for each light by itself (options->each).
 *
 * @return as weft_auto_exposure()
 */
weft_err weft_exposures_find(weft_shooter *shooter, weft_capture_options *options, int n_lights,
                             weft_error *err);

/** The shortest and the longest of the lights' exposures, in the middle of their brackets; of a set without
 *  single lights its only one.  All open ones count as 1 s. */
double weft_exposures_shortest(const weft_capture_options *options);
double weft_exposures_longest(const weft_capture_options *options);

#endif
