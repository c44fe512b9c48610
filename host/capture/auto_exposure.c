#include "host/capture/auto_exposure.h"

#include "core/log.h"

#include <math.h>

#define FIRST_S    0.01
#define SHORTEST_S 2e-5
#define TOO_BRIGHT 0.95
/* Below this the noise floor and the steps of the converter would be measured as light. */
#define TOO_DARK 0.05
/* A bracket's ends. */
#define HIGHLIGHTS_BELOW 0.95
#define MIDDLE_ABOVE     0.10
#define MOST_STEPS       2

static weft_err shoot_once(weft_shooter *s, uint32_t pattern, double exposure_s, double gain,
                           weft_frame_stats *stats, weft_error *err)
{
    enum { TRIES = 3 };
    weft_shot shot = {.reason = "not tried"};
    for (int try = 0; try < TRIES && shot.reason[0]; try++)
        WEFT_TRY(weft_shoot(s, pattern, exposure_s, gain, &shot, err));
    if (shot.reason[0])
        return weft_fail(err, WEFT_ERR_DEVICE, "looking for the exposure: %s (tried %d times)", shot.reason,
                         TRIES);
    *stats = shot.stats;
    return WEFT_OK;
}

/* The brightest pattern; stops at the first that is too bright to be measured. */
static weft_err measure(weft_shooter *s, const uint32_t *patterns, int n, double exposure_s, double gain,
                        double *high, weft_frame_stats *brightest, weft_error *err)
{
    *high = 0;
    for (int i = 0; i < n && *high < TOO_BRIGHT; i++) {
        weft_frame_stats stats;
        WEFT_TRY(shoot_once(s, patterns[i], exposure_s, gain, &stats, err));
        if (i > 0 && weft_frame_stats_high(&stats) <= *high)
            continue;
        *high = fmax(weft_frame_stats_high(&stats), 0);
        *brightest = stats;
    }
    return WEFT_OK;
}

static double round_to_two_digits(double x)
{
    const double unit = pow(10, floor(log10(x)) - 1);
    return round(x / unit) * unit;
}

/* From *try_s on to an exposure at which the brightest of the patterns can be measured. */
static weft_err find_range(weft_shooter *s, const uint32_t *patterns, int n, double gain, double *try_s,
                           weft_frame_stats *brightest, weft_error *err)
{
    for (double high;;) {
        WEFT_TRY(measure(s, patterns, n, *try_s, gain, &high, brightest, err));
        weft_explain("exposure %g s: the brightest thousandth is at %.1f %%", *try_s, 100 * high);
        if (high >= TOO_BRIGHT && *try_s <= SHORTEST_S)
            return weft_fail(
                err, WEFT_ERR_NODATA,
                "even %g s is too long for this light; lower the gain, the lights or the aperture", *try_s);
        if (high >= TOO_BRIGHT)
            *try_s = fmax(*try_s / 8, SHORTEST_S);
        else if (high < TOO_DARK && *try_s < WEFT_AUTO_EXPOSURE_MAX_S)
            *try_s = fmin(*try_s * 8, WEFT_AUTO_EXPOSURE_MAX_S);
        else
            return WEFT_OK;
    }
}

static double wanted_s(double high)
{
    return WEFT_AUTO_EXPOSURE_TARGET / fmax(high, 1e-3);
}

static void warn_of_darkness(double high)
{
    if (wanted_s(high) > WEFT_AUTO_EXPOSURE_MAX_S)
        weft_warn("the sample is very dark: at %g s its brightest part is at %.1f %% of the range; are the "
                  "lights connected and the lens open?",
                  WEFT_AUTO_EXPOSURE_MAX_S, 100 * high * WEFT_AUTO_EXPOSURE_MAX_S);
}

double weft_light_level_exposure(const weft_light_level *level)
{
    return round_to_two_digits(fmin(wanted_s(level->high), WEFT_AUTO_EXPOSURE_MAX_S));
}

weft_light_level weft_light_level_of(const weft_frame_stats *stats, double exposure_s)
{
    weft_light_level level = {0};
    for (int c = 0; c < 3; c++) {
        level.high = fmax(level.high, stats->colours[c].high / exposure_s);
        level.top = fmax(level.top, stats->colours[c].top / exposure_s);
        level.middle = fmax(level.middle, stats->colours[c].middle / exposure_s);
    }
    return level;
}

weft_err weft_auto_exposure(weft_shooter *s, const uint32_t *patterns, int n, double gain, double *exposure_s,
                            weft_error *err)
{
    double try_s = FIRST_S;
    weft_frame_stats stats = {0};
    WEFT_TRY(find_range(s, patterns, n, gain, &try_s, &stats, err));
    const weft_light_level level = weft_light_level_of(&stats, try_s);
    warn_of_darkness(level.high);
    *exposure_s = weft_light_level_exposure(&level);
    return WEFT_OK;
}

weft_err weft_light_level_measure(weft_shooter *s, uint32_t pattern, double gain, double *try_s,
                                  weft_light_level *level, weft_error *err)
{
    weft_frame_stats stats = {0};
    *try_s = *try_s > 0 ? *try_s : FIRST_S;
    WEFT_TRY(find_range(s, &pattern, 1, gain, try_s, &stats, err));
    *level = weft_light_level_of(&stats, *try_s);
    warn_of_darkness(level->high);
    if (level->top * *try_s < HIGHLIGHTS_BELOW || *try_s <= SHORTEST_S)
        return WEFT_OK;
    const double shorter_s =
        fmax(*try_s / 16, SHORTEST_S); /* what clips has no measure: one look from below */
    WEFT_TRY(shoot_once(s, pattern, shorter_s, gain, &stats, err));
    level->top = fmax(level->top, weft_light_level_of(&stats, shorter_s).top);
    return WEFT_OK;
}

int weft_light_level_bracket(const weft_light_level *level, double exposure_s)
{
    int shorter = 0, longer = 0;
    double top = level->top * exposure_s, middle = level->middle * exposure_s;
    for (; top >= HIGHLIGHTS_BELOW && shorter < MOST_STEPS; shorter++)
        top /= WEFT_CAPTURE_BRACKET_FACTOR;
    for (; middle > 0 && middle < MIDDLE_ABOVE && longer < MOST_STEPS; longer++)
        middle *= WEFT_CAPTURE_BRACKET_FACTOR;
    const int n = 2 * shorter + 1 > 2 * longer ? 2 * shorter + 1 : 2 * longer;
    return n;
}
