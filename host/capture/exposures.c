#include "host/capture/exposures.h"

#include "core/log.h"
#include "host/capture/auto_exposure.h"

#include <math.h>

static bool has(const weft_capture_options *o, int light)
{
    return !o->no_lights && o->lights >> light & 1;
}

bool weft_exposures_are_open(const weft_capture_options *o)
{
    bool open = o->no_lights && o->exposure_s <= 0;
    for (int i = 0; i < WEFT_CAPTURE_MAX_LIGHTS; i++)
        open |= has(o, i) && (o->exposures_s[i] <= 0 || o->brackets[i] <= 0);
    return open;
}

static double extreme(const weft_capture_options *o, double (*choose)(double, double))
{
    double found = 0;
    for (int i = 0; i < WEFT_CAPTURE_MAX_LIGHTS; i++)
        if (has(o, i)) {
            const double s = o->exposures_s[i] > 0 ? o->exposures_s[i] : 1;
            found = found > 0 ? choose(found, s) : s;
        }
    return found > 0 ? found : o->exposure_s > 0 ? o->exposure_s : 1;
}

double weft_exposures_shortest(const weft_capture_options *o)
{
    return extreme(o, fmin);
}

double weft_exposures_longest(const weft_capture_options *o)
{
    return extreme(o, fmax);
}

/* One exposure for every light that has none of its own. */
static weft_err find_common(weft_shooter *s, weft_capture_options *o, int n_lights, weft_error *err)
{
    uint32_t patterns[WEFT_CAPTURE_MAX_LIGHTS + 1];
    int n = 0;
    for (int light = 0; light < n_lights; light++)
        if (has(o, light) && o->exposures_s[light] <= 0)
            patterns[n++] = UINT32_C(1) << light;
    if (o->no_lights) /* all of them would clip a set that is made for single lights */
        patterns[n++] = n_lights < 32 ? (UINT32_C(1) << n_lights) - 1 : UINT32_MAX;
    if (n == 0)
        return WEFT_OK;
    WEFT_TRY(weft_auto_exposure(s, patterns, n, o->gain, &o->exposure_s, err));
    weft_explain("exposure %g s", o->exposure_s);
    return WEFT_OK;
}

/* A light begins to be looked for where the one before was found. */
static weft_err find_of_each(weft_shooter *s, weft_capture_options *o, int n_lights, weft_error *err)
{
    double try_s = 0;
    for (int light = 0; light < n_lights; light++) {
        weft_light_level level;
        double *const exposure_s = &o->exposures_s[light];
        if (!has(o, light) || (*exposure_s > 0 && o->brackets[light] > 0))
            continue;
        WEFT_TRY(weft_light_level_measure(s, UINT32_C(1) << light, o->gain, &try_s, &level, err));
        *exposure_s = *exposure_s > 0 ? *exposure_s : weft_light_level_exposure(&level);
        if (o->brackets[light] <= 0)
            o->brackets[light] = weft_light_level_bracket(&level, *exposure_s);
        weft_explain("light %d: exposure %g s, %d in its bracket", light, *exposure_s, o->brackets[light]);
    }
    return WEFT_OK;
}

void weft_exposures_apply(weft_capture_options *o)
{
    for (int light = 0; light < WEFT_CAPTURE_MAX_LIGHTS; light++) {
        if (o->exposures_s[light] <= 0 && o->exposure_s > 0)
            o->exposures_s[light] = o->exposure_s;
        if (o->brackets[light] <= 0 && o->bracket > 0)
            o->brackets[light] = o->bracket;
    }
}

weft_err weft_exposures_find(weft_shooter *s, weft_capture_options *o, int n_lights, weft_error *err)
{
    if (o->exposure_s <= 0 && (!o->each || o->no_lights))
        WEFT_TRY(find_common(s, o, n_lights, err));
    weft_exposures_apply(o);
    WEFT_TRY(find_of_each(s, o, n_lights, err));
    if (o->exposure_s <= 0)
        o->exposure_s = weft_exposures_longest(o);
    return WEFT_OK;
}
