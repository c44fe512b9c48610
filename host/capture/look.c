#include "host/capture/look.h"

#include "core/progress.h"
#include "host/capture/auto_exposure.h"

#include <math.h>
#include <stdio.h>

/* Clipped photosites of one colour that are worth a warning; as good_frame.c. */
#define CLIPPED_SHARE 0.001
#define TRIES         3
/* Shares of the range between which the brightest thousandth is a measure. */
#define TOO_BRIGHT 0.97
#define TOO_DARK   0.005

static weft_err look_at(weft_shooter *s, int light, weft_capture_look *look, weft_error *err)
{
    weft_light_look *const l = &look->lights[look->n++];
    weft_shot shot = {.reason = "not tried"};
    for (int try = 0; try < TRIES && shot.reason[0]; try++)
        WEFT_TRY(
            weft_shoot(s, light < 0 ? 0 : UINT32_C(1) << light, look->exposure_s, look->gain, &shot, err));
    *l = (weft_light_look){.light = light, .stats = shot.stats};
    snprintf(l->reason, sizeof l->reason, "%s", shot.reason);
    if (shot.reason[0] || light < 0)
        return WEFT_OK;
    const char *colour;
    double measured_s = look->exposure_s;
    if (weft_frame_stats_clipped(&shot.stats, &colour) > CLIPPED_SHARE)
        look->n_clipped++;
    weft_light_level level = weft_light_level_of(&shot.stats, measured_s);
    for (int i = 0; i < TRIES && level.top * measured_s >= TOO_BRIGHT && !shot.reason[0]; i++) {
        measured_s /= 4; /* what clips is no measure */
        WEFT_TRY(weft_shoot(s, UINT32_C(1) << light, measured_s, look->gain, &shot, err));
        const weft_light_level darker = weft_light_level_of(&shot.stats, measured_s);
        level.top = darker.top;
        level.high = level.high * 4 * measured_s >= TOO_BRIGHT ? darker.high : level.high;
    }
    if (level.high * measured_s > TOO_DARK && level.high * measured_s < TOO_BRIGHT && !shot.reason[0]) {
        l->level = level;
        l->suggested_s = WEFT_AUTO_EXPOSURE_TARGET / level.high;
        l->bracket = weft_light_level_bracket(&level, l->suggested_s);
    }
    return WEFT_OK;
}

/* The shortest exposure serves all; a light that would be too dark at it gets a bracket, or its own. */
static void suggest(weft_capture_look *look)
{
    look->suggested_s = look->longest_s = 0;
    look->bracket = 1;
    for (int i = 0; i < look->n; i++) {
        const double s = look->lights[i].suggested_s;
        if (s <= 0)
            continue;
        look->suggested_s = look->suggested_s > 0 ? fmin(look->suggested_s, s) : s;
        look->longest_s = fmax(look->longest_s, s);
    }
    for (int i = 0; i < look->n; i++)
        if (look->lights[i].suggested_s > 0) {
            const int n = weft_light_level_bracket(&look->lights[i].level, look->suggested_s);
            look->bracket = n > look->bracket ? n : look->bracket;
        }
}

static weft_err look_at_all(weft_shooter *s, const weft_capture_options *o, uint32_t lights, int n_lights,
                            weft_progress *progress, weft_capture_look *look, weft_error *err)
{
    uint32_t patterns[WEFT_CAPTURE_MAX_LIGHTS];
    int n = 0;
    for (int light = 0; light < n_lights; light++)
        if (lights >> light & 1)
            patterns[n++] = UINT32_C(1) << light;
    if (o->exposure_s <= 0)
        WEFT_TRY(weft_auto_exposure(s, patterns, n, look->gain, &look->exposure_s, err));
    weft_progress_begin(progress, "looking", "lights", n + 1);
    WEFT_TRY(look_at(s, -1, look, err));
    for (int light = 0; light < n_lights; light++) {
        if (!(lights >> light & 1))
            continue;
        WEFT_TRY(look_at(s, light, look, err));
        WEFT_TRY(weft_progress_step(progress, 1, err));
    }
    WEFT_TRY(weft_shooter_set_camera(s, look->exposure_s, look->gain, err));
    look->exposure_s = weft_camera_get_state(s->camera)->exposure_s;
    look->gain = weft_camera_get_state(s->camera)->gain;
    suggest(look);
    return WEFT_OK;
}

weft_err weft_capture_look_at(const weft_capture_options *o, weft_camera_device *camera,
                              weft_controller *controller, weft_progress *progress, weft_capture_look *look,
                              weft_error *err)
{
    const weft_controller_info *const info = weft_controller_get_info(controller);
    const int n = info->n_lights < WEFT_CAPTURE_MAX_LIGHTS ? info->n_lights : WEFT_CAPTURE_MAX_LIGHTS;
    const uint32_t every = n < 32 ? (UINT32_C(1) << n) - 1 : UINT32_MAX;
    if (o->lights & ~every)
        return weft_fail(err, WEFT_ERR_RANGE, "there is no light %d: the controller has 0 to %d",
                         31 - __builtin_clz(o->lights & ~every), n - 1);
    weft_shooter s = {.camera = camera,
                      .controller = controller,
                      .level = o->level ? o->level : info->level_max,
                      .settle_s = o->settle_s > 0 ? o->settle_s : 0.005,
                      .deadline_s = o->deadline_s > 0 ? o->deadline_s : 6,
                      .trigger = o->trigger};
    *look = (weft_capture_look){
        .exposure_s = o->exposure_s,
        .gain = o->gain > 0 ? o->gain : weft_camera_get_state(camera)->gain,
    };
    weft_controller_panic_on_crash(controller);
    weft_shooter_begin(&s);
    const weft_err status = look_at_all(&s, o, o->lights ? o->lights : every, n, progress, look, err);
    weft_shooter_end(&s);
    weft_progress_end(progress);
    return status;
}
