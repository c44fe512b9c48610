/** Albedo that the colour chart does not vouch for (S-FC3-04). */
#ifndef WEFT_HOST_SOLVE_ALBEDO_GAMUT_H
#define WEFT_HOST_SOLVE_ALBEDO_GAMUT_H

#include "calibration/calibration.h"
#include "host/set/maps.h"

/** Adds to maps->info: "result": {"gamut": {"outside_share", "darker_share", "brighter_share",
 * "distance_mean", "distance_max"}}, over the answered pixels.  Nothing when the calibration does not know
 * the chart's colours. */
weft_err weft_albedo_gamut_note(const weft_calibration *cal, weft_maps *maps, weft_error *err);

/** One line about it, without a full stop: "12.3 % of the albedo ..."; empty when nothing is known of it or
 *  less than 0.1 % is outside. */
void weft_albedo_gamut_words(const weft_maps *maps, char *words, size_t size);

#endif
