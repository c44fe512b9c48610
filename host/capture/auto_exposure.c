#include "host/capture/auto_exposure.h"

#include "core/log.h"

#include <math.h>

#define FIRST_S    0.01
#define SHORTEST_S 2e-5
#define TOO_BRIGHT 0.95
/* Below this the noise floor and the steps of the converter would be measured as light. */
#define TOO_DARK 0.05

/* Brightest thousandth over all patterns; stops at the first pattern that is too bright to be measured. */
static weft_err measure(weft_shooter *s, const uint32_t *patterns, int n, double exposure_s, double gain,
                        double *high, weft_error *err)
{
    enum { TRIES = 3 };
    *high = 0;
    for (int i = 0; i < n && *high < TOO_BRIGHT; i++) {
        weft_shot shot = {.reason = "not tried"};
        for (int try = 0; try < TRIES && shot.reason[0]; try++)
            WEFT_TRY(weft_shoot(s, patterns[i], exposure_s, gain, &shot, err));
        if (shot.reason[0])
            return weft_fail(err, WEFT_ERR_DEVICE, "looking for the exposure: %s (tried %d times)",
                             shot.reason, TRIES);
        *high = fmax(*high, weft_frame_stats_high(&shot.stats));
    }
    return WEFT_OK;
}

static double round_to_two_digits(double x)
{
    const double unit = pow(10, floor(log10(x)) - 1);
    return round(x / unit) * unit;
}

weft_err weft_auto_exposure(weft_shooter *s, const uint32_t *patterns, int n, double gain, double *exposure_s,
                            weft_error *err)
{
    double try_s = FIRST_S, high = 0;
    for (;;) {
        WEFT_TRY(measure(s, patterns, n, try_s, gain, &high, err));
        weft_explain("exposure %g s: the brightest thousandth is at %.1f %%", try_s, 100 * high);
        if (high >= TOO_BRIGHT && try_s <= SHORTEST_S)
            return weft_fail(
                err, WEFT_ERR_NODATA,
                "even %g s is too long for this light; lower the gain, the lights or the aperture", try_s);
        if (high >= TOO_BRIGHT)
            try_s = fmax(try_s / 8, SHORTEST_S);
        else if (high < TOO_DARK && try_s < WEFT_AUTO_EXPOSURE_MAX_S)
            try_s = fmin(try_s * 8, WEFT_AUTO_EXPOSURE_MAX_S);
        else
            break;
    }
    const double found_s = try_s * WEFT_AUTO_EXPOSURE_TARGET / fmax(high, 1e-3);
    if (found_s > WEFT_AUTO_EXPOSURE_MAX_S)
        weft_warn("the sample is very dark: at %g s its brightest part is at %.1f %% of the range; are the "
                  "lights connected and the lens open?",
                  WEFT_AUTO_EXPOSURE_MAX_S, 100 * high * WEFT_AUTO_EXPOSURE_MAX_S / try_s);
    *exposure_s = round_to_two_digits(fmin(found_s, WEFT_AUTO_EXPOSURE_MAX_S));
    return WEFT_OK;
}
