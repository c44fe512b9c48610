/** What set.json says of its brackets: the sensor's noise, and the weight of each exposure. */
#ifndef WEFT_HOST_CAPTURE_WEIGHTS_H
#define WEFT_HOST_CAPTURE_WEIGHTS_H

#include "host/set/set.h"

/**
 * Measures the noise of the sensor by the brackets of up to three lights (the middle one of what they say;
 * the read noise by the dark or ambient frame, where the lit ones have no dark parts), unless the set has it,
 * and records for each frame of a bracket `capture.weight`: its part of the merged value at the light's mean
 * brightness, where nothing clips.  The weights of a light add up to 1.
 *
 * Sets without brackets, and brackets that do not tell their noise, stay as they are.
 *
 * @return what reading the frames returns
 */
weft_err weft_weights_record(weft_set *set, weft_error *err);

#endif
