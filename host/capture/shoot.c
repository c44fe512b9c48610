#include "host/capture/shoot.h"

#include "core/log.h"
#include "core/progress.h"

#include <math.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>

/* A lease lasts a second or so. */
#define WORD_EVERY_S 0.15
/* The frame is on its way for a while after its exposure, and the lights stay on until it is here. */
#define MAX_ON_SPARE_S 1.0

static weft_err ask_for_light(weft_shooter *s, uint32_t *on_tick, weft_error *err)
{
    WEFT_TRY(weft_controller_light(s->controller, s->lit, s->level, s->max_on_ms, on_tick, err));
    s->asked_s = s->heard_s = weft_clock_s();
    return WEFT_OK;
}

weft_err weft_shooter_keep_alive(weft_shooter *s, weft_error *err)
{
    const double now_s = weft_clock_s();
    if (s->lit && now_s - s->asked_s > 0.0005 * s->max_on_ms)
        return ask_for_light(s, NULL, err);
    if (now_s - s->heard_s < WORD_EVERY_S)
        return WEFT_OK;
    WEFT_TRY(weft_controller_keep_alive(s->controller, err));
    s->heard_s = now_s;
    return WEFT_OK;
}

/* Called by the camera while it waits. */
static weft_err on_idle(void *context, weft_error *err)
{
    if (weft_cancelled())
        return weft_fail(err, WEFT_ERR_CANCELLED, "cancelled");
    return weft_shooter_keep_alive(context, err);
}

static weft_err settle(weft_shooter *s, weft_error *err)
{
    const double end_s = weft_clock_s() + s->settle_s;
    double left_s;
    while ((left_s = end_s - weft_clock_s()) > 0) {
        const long ns = (long)(1e9 * fmin(left_s, 0.05));
        nanosleep(&(struct timespec){.tv_nsec = ns}, NULL);
        WEFT_TRY(on_idle(s, err));
    }
    return WEFT_OK;
}

/* The camera is armed: the controller lights, waits, pulses and goes dark.  Its failure is looked at when the
 * camera has had its say. */
static weft_err fire(void *context, weft_error *err)
{
    weft_shooter *const s = context;
    s->fire_error = (weft_error){0};
    s->fire_status = weft_controller_run_sequence(s->controller, &s->step, 1, &s->result, &s->fire_error);
    s->heard_s = weft_clock_s();
    if (s->fire_status == WEFT_ERR_CANCELLED)
        return weft_fail(err, WEFT_ERR_CANCELLED, "cancelled");
    return WEFT_OK;
}

void weft_shooter_begin(weft_shooter *s)
{
    weft_camera_set_idle(s->camera, on_idle, s);
    weft_camera_set_fire(s->camera, fire, s);
}

/* Whatever else fails, the lights must not stay on. */
static weft_err go_dark(weft_shooter *s, uint32_t *off_tick, weft_error *err)
{
    const weft_err status = weft_controller_off(s->controller, off_tick, err);
    const int fd = weft_controller_panic_fd(s->controller);
    if (status != WEFT_OK && fd >= 0 && write(fd, "\0\0\0", 3) < 0)
        weft_explain("the panic bytes could not be written either");
    s->lit = 0;
    s->heard_s = weft_clock_s();
    return status;
}

void weft_shooter_end(weft_shooter *s)
{
    weft_camera_set_idle(s->camera, NULL, NULL);
    weft_camera_set_fire(s->camera, NULL, NULL);
    go_dark(s, NULL, NULL);
    weft_captured_frame_fini(&s->frame);
}

weft_err weft_shooter_set_camera(weft_shooter *s, double exposure_s, double gain, weft_error *err)
{
    const weft_camera_settings wanted = {.exposure_s = exposure_s, .gain = gain, .trigger = s->trigger};
    if (wanted.exposure_s == s->set.exposure_s && wanted.gain == s->set.gain &&
        wanted.trigger == s->set.trigger)
        return WEFT_OK;
    WEFT_TRY(weft_camera_configure(s->camera, &wanted, err));
    s->set = wanted;
    return WEFT_OK;
}

/* The proof that the lights were on from before the trigger until the frame was here: the controller says
 * that they still are, and since when. */
static weft_err check_still_lit(weft_shooter *s, uint32_t lights, char reason[200], weft_error *err)
{
    weft_controller_status status;
    WEFT_TRY(weft_controller_get_status(s->controller, &status, err));
    if (status.lights != lights)
        snprintf(reason, 200, "the lights changed during the exposure (wanted %#x, found %#x, controller %s)",
                 (unsigned)lights, (unsigned)status.lights, status.state);
    return WEFT_OK;
}

static weft_err expose(weft_shooter *s, uint32_t lights, weft_shot *shot, weft_error *err)
{
    WEFT_TRY(weft_camera_expose(s->camera, s->deadline_s, &s->frame, err));
    if (s->frame.status != WEFT_FRAME_COMPLETE) {
        snprintf(shot->reason, sizeof shot->reason, "%s", s->frame.reason);
        return WEFT_OK;
    }
    return lights ? check_still_lit(s, lights, shot->reason, err) : WEFT_OK;
}

/* ---- by wire ---- */

/* A camera begins to expose up to so long after the pulse. */
#define LATENCY_S 0.15
/* And when its exposure line tells when it has ended, it may take this long. */
#define PATIENCE_S 1.0

static weft_controller_step plan_step(const weft_shooter *s, uint32_t lights, double exposure_s)
{
    const int most_ms = weft_controller_get_info(s->controller)->max_on_ms;
    const double most_s = 1e-3 * most_ms - s->settle_s;
    const double hold_s = s->exposure_line ? exposure_s + PATIENCE_S : 1.02 * exposure_s + LATENCY_S;
    return (weft_controller_step){
        .lights = lights,
        .level = s->level,
        .settle_us = (uint32_t)lround(1e6 * s->settle_s),
        .trigger_us = 200,
        .hold_us = (uint32_t)lround(1e6 * fmax(fmin(hold_s, most_s), fmin(exposure_s, 10))),
        .until_exposure = s->exposure_line,
    };
}

/* Whether the exposure line proves the frame; without such a line nothing is said. */
static void check_edges(weft_shooter *s, weft_shot *shot)
{
    const weft_controller_info *const info = weft_controller_get_info(s->controller);
    const weft_controller_step_result *const r = &s->result;
    const double ms = 1e3 / info->tick_hz;
    if (!r->rose && !r->fell && !s->exposure_line)
        return;
    s->exposure_line = true;
    shot->proved = weft_controller_step_is_proved(info, &s->step, r);
    shot->rise_tick = r->rise_tick;
    shot->fall_tick = r->fall_tick;
    if (!shot->proved && !(r->rose && r->fell))
        snprintf(shot->reason, sizeof shot->reason,
                 "the exposure %s within the %.0f ms that the lights were on",
                 r->rose ? "did not end" : "did not begin", ms * (r->off_tick - r->on_tick));
    else if (!shot->proved)
        snprintf(shot->reason, sizeof shot->reason,
                 "the lights did not cover the exposure: on for %.2f ms, exposed from %.2f to %.2f ms after",
                 ms * (r->off_tick - r->on_tick), ms * (r->rise_tick - r->on_tick),
                 ms * (r->fall_tick - r->on_tick));
}

static weft_err shoot_by_wire(weft_shooter *s, uint32_t lights, double exposure_s, weft_shot *shot,
                              weft_error *err)
{
    s->step = plan_step(s, lights, exposure_s);
    s->result = (weft_controller_step_result){0};
    s->fire_status = weft_fail(&s->fire_error, WEFT_ERR_DEVICE, "the camera was not armed");
    WEFT_TRY(weft_controller_off(s->controller, NULL, err));
    WEFT_TRY(weft_camera_expose(s->camera, s->deadline_s + LATENCY_S, &s->frame, err));
    shot->on_tick = s->result.on_tick;
    shot->off_tick = s->result.off_tick;
    if (s->fire_status == WEFT_ERR_RANGE || s->fire_status == WEFT_ERR_UNSUPPORTED) {
        if (err)
            *err = s->fire_error;
        return s->fire_status;
    }
    if (s->frame.status != WEFT_FRAME_COMPLETE)
        snprintf(shot->reason, sizeof shot->reason, "%s", s->frame.reason);
    else if (s->fire_status != WEFT_OK)
        snprintf(shot->reason, sizeof shot->reason, "%.199s", s->fire_error.text);
    else
        check_edges(s, shot);
    return WEFT_OK;
}

/* ---- by software ---- */

static weft_err shoot_by_software(weft_shooter *s, uint32_t lights, double exposure_s, weft_shot *shot,
                                  weft_error *err)
{
    const int most_ms =
        weft_controller_get_info(s->controller)->max_on_ms; /* longer light is asked for again */
    s->max_on_ms = (int)fmin(ceil(1e3 * (s->settle_s + exposure_s + MAX_ON_SPARE_S)), most_ms);
    weft_err status;
    if (lights) {
        s->lit = lights;
        status = ask_for_light(s, &shot->on_tick, err);
    } else {
        status = weft_controller_off(s->controller, NULL, err);
    }
    if (status == WEFT_OK && lights)
        status = settle(s, err);
    if (status == WEFT_OK)
        status = expose(s, lights, shot, err);
    if (lights) {
        weft_error *const second = status == WEFT_OK ? err : NULL; /* the first cause is the one to tell */
        const weft_err dark = go_dark(s, &shot->off_tick, second);
        status = status == WEFT_OK ? dark : status;
    }
    return status;
}

weft_err weft_shoot(weft_shooter *s, uint32_t lights, double exposure_s, double gain, weft_shot *shot,
                    weft_error *err)
{
    *shot = (weft_shot){0};
    WEFT_TRY(weft_camera_prepare(s->camera, err)); /* in the dark: a new helper may take seconds */
    WEFT_TRY(weft_shooter_set_camera(s, exposure_s, gain, err));
    WEFT_TRY(s->trigger == WEFT_TRIGGER_WIRE ? shoot_by_wire(s, lights, exposure_s, shot, err)
                                             : shoot_by_software(s, lights, exposure_s, shot, err));
    return shot->reason[0] ? WEFT_OK : weft_frame_stats_make(&s->frame.mosaic, &shot->stats, err);
}
