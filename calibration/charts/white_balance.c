#include "calibration/charts/white_balance.h"

weft_white_balance weft_white_balance_from(const weft_grey_fit *fit)
{
    weft_white_balance balance;
    const double green = 0.5 * (fit->slope[WEFT_SITE_G1] + fit->slope[WEFT_SITE_G2]);
    for (int s = 0; s < WEFT_SITES; s++)
        balance.site_gain[s] = green / fit->slope[s];
    balance.gain[0] = balance.site_gain[WEFT_SITE_R];
    balance.gain[1] = 1;
    balance.gain[2] = balance.site_gain[WEFT_SITE_B];
    return balance;
}
