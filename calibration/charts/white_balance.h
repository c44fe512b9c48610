/** White balance of each light from a scale of greys (S-ORD-19). */
#ifndef WEFT_CALIBRATION_CHARTS_WHITE_BALANCE_H
#define WEFT_CALIBRATION_CHARTS_WHITE_BALANCE_H

#include "calibration/charts/grey_fit.h"

typedef struct weft_white_balance {
    double site_gain[WEFT_SITES]; /* mean of the greens' slopes / slope of the class; G1 and G2 kept apart */
    double gain[3];               /* for the three channels, green 1 */
} weft_white_balance;

/** The gains that make a neutral equal in all channels. */
weft_white_balance weft_white_balance_from(const weft_grey_fit *fit);

#endif
