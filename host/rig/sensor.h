/** From light to numbers: shot noise, read noise, fixed pattern, gain, converter. */
#ifndef WEFT_HOST_RIG_SENSOR_H
#define WEFT_HOST_RIG_SENSOR_H

#include "host/rig/render.h"

#include <stdint.h>

/**
 * One exposure: every photosite's number.
 *
 *     electrons = full_well * exposure * (sum of lamps + room) * (1 + fixed pattern), Poisson, + read noise
 *     DN        = black + gain * electrons * (white - black) / full_well, rounded, cut to 0..white
 *
 * The Poisson number is exact below 40 electrons and a rounded-off normal above.
 *
 * @param on          per lamp: share of the exposure during which it was on
 * @param gain        analogue, >= 1
 * @param sequence    number of the frame: other noise in each, the same again for the same seed
 * @param dn          [height][width]
 */
void weft_rig_expose(const weft_rig_scene *scene, const weft_rig_frames *frames,
                     const double on[WEFT_RIG_N_LIGHTS], double exposure_s, double gain, uint64_t sequence,
                     uint16_t *dn);

#endif
