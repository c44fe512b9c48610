/* One frame of a set, taken until it is good: whole, lit, and by the right lamp. */
#include "host/capture/capture_private.h"

#include "core/formats/raw_file.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "host/capture/average.h"
#include "host/capture/exposures.h"

#include <math.h>
#include <stdio.h>

/* A frame with a light must beat the one without by 2 % (lamps of the room flicker) and by 0.05 % of the
 * range (8 of 16384 DN: the mean of a million photosites knows its offset much better than that). */
#define BRIGHTER_FACTOR 1.02
#define BRIGHTER_OFFSET 0.0005
/* Clipped photosites of one colour that are worth a warning. */
#define CLIPPED_SHARE 0.001
/* Exposures of one light that differ by more in shape (see WEFT_PRINT_SAME_SHAPE) are of two. */
#define OTHER_SHAPE 0.03
/* A room this bright costs range and adds its own noise. */
#define BRIGHT_ROOM 0.05

/* A light that does not light must not pass for a dark side of the cloth. */
static void check_brightness(const weft_capture_state *run, const weft_planned_frame *frame, weft_shot *shot)
{
    const double without = run->dark_mean * run->shooter.frame.exposure_s * run->shooter.frame.gain;
    if (!frame->lights || !frame->middle || !run->has_dark_mean)
        return;
    if (shot->stats.mean <= without * BRIGHTER_FACTOR + BRIGHTER_OFFSET)
        snprintf(shot->reason, sizeof shot->reason,
                 "no brighter than without it (%.2f %% of the range, without %.2f %%): %s",
                 100 * shot->stats.mean, 100 * without,
                 without > BRIGHT_ROOM ? "does this lamp shine all the time?" : "is the lamp connected?");
}

static weft_light_print print_of_frame(const weft_capture_state *run)
{
    const weft_captured_frame *const f = &run->shooter.frame;
    return weft_light_print_make(&f->mosaic, f->exposure_s * f->gain);
}

/* The controller answers for its outputs; the picture for the lamps behind them. */
static void check_shape(const weft_capture_state *run, const weft_planned_frame *frame, weft_shot *shot)
{
    if (frame->role != WEFT_ROLE_LIGHT)
        return;
    const weft_light_print now = print_of_frame(run);
    for (int light = 0; light < WEFT_CAPTURE_MAX_LIGHTS && !shot->reason[0]; light++) {
        const double d = weft_light_print_difference(&now, &run->prints[light], &run->dark_print);
        if (d < 0)
            continue;
        if (light == frame->light && !frame->middle && d > OTHER_SHAPE)
            snprintf(
                shot->reason, sizeof shot->reason,
                "another picture than its exposure of %g s (they differ by %.1f %%): was another lamp on, or "
                "did the sample move?",
                run->prints[light].time / run->shooter.frame.gain, 100 * d);
        else if (light != frame->light && frame->middle && d < WEFT_PRINT_SAME_SHAPE)
            snprintf(
                shot->reason, sizeof shot->reason,
                "the same picture as under light %d (they differ by %.2f %%): does its wire go to that lamp?",
                light, 100 * d);
    }
}

/* A cable that was pulled out may be put in again.  Meanwhile the controller goes dark by itself, and what
 * was being exposed is void.  Any other failure stays one. */
weft_err weft_capture_come_back(weft_capture_state *run, weft_err status, weft_error *why, weft_error *err)
{
    weft_controller *const c = run->shooter.controller;
    if (!weft_controller_is_gone(c)) {
        if (err)
            *err = *why;
        return status;
    }
    weft_warn("%s; waiting %g s for it", why->text, run->o.patience_s);
    return weft_controller_reopen(c, run->o.patience_s, err);
}

/* One exposure; a controller that was unplugged and is back gives a reason to take it again. */
static weft_err shoot(weft_capture_state *run, const weft_planned_frame *frame, weft_shot *shot,
                      weft_error *err)
{
    weft_error why = {0};
    const weft_err status =
        weft_shoot(&run->shooter, frame->lights, frame->exposure_s, run->o.gain, shot, &why);
    if (status == WEFT_OK)
        return WEFT_OK;
    WEFT_TRY(weft_capture_come_back(run, status, &why, err));
    snprintf(shot->reason, sizeof shot->reason, "the light controller was unplugged");
    return WEFT_OK;
}

/* Takes the frame until it is good.  `retries` gets a reason for each one that was not. */
static weft_err shoot_until_good(weft_capture_state *run, const weft_planned_frame *frame, weft_shot *shot,
                                 json_t *retries, weft_error *err)
{
    char what[32];
    weft_planned_frame_words(frame, what);
    for (int try = 1;; try++) {
        const weft_err status = shoot(run, frame, shot, err);
        if (status != WEFT_OK)
            return weft_prefix(err, status, "%s", what);
        if (!shot->reason[0])
            check_brightness(run, frame, shot);
        if (!shot->reason[0])
            check_shape(run, frame, shot);
        if (!shot->reason[0])
            return WEFT_OK;
        if (try >= run->o.tries)
            return weft_fail(err, WEFT_ERR_DEVICE, "%s: %s (tried %d times)", what, shot->reason, try);
        weft_warn("%s: %s; taking it again", what, shot->reason);
        json_array_append_new(retries, json_string(shot->reason));
        run->report.n_retries++;
    }
}

/* Each of the frames is judged by itself; what is kept is their mean, as a DNG. */
weft_err weft_capture_shoot(weft_capture_state *run, const weft_planned_frame *frame, weft_shot *shot,
                            json_t *retries, weft_error *err)
{
    weft_captured_frame *const f = &run->shooter.frame;
    weft_average mean = {0};
    weft_err status = WEFT_OK;
    for (int i = 0; i < run->o.average && status == WEFT_OK; i++) {
        status = shoot_until_good(run, frame, shot, retries, err);
        if (status == WEFT_OK && run->o.average > 1)
            status = weft_average_add(&mean, &f->mosaic, err);
        if (status == WEFT_OK && weft_cancelled())
            status = weft_fail(err, WEFT_ERR_CANCELLED, "cancelled");
    }
    if (status == WEFT_OK && run->o.average > 1) {
        weft_average_get(&mean, &f->mosaic);
        f->file.size = 0;
        status = weft_frame_stats_make(&f->mosaic, &shot->stats, err);
    }
    weft_average_fini(&mean);
    return status;
}

void weft_capture_remember_dark(weft_capture_state *run, const weft_shot *shot)
{
    const weft_captured_frame *const f = &run->shooter.frame;
    run->dark_mean = fmax(shot->stats.mean, 0) / (f->exposure_s * f->gain);
    run->has_dark_mean = true;
    run->dark_print = print_of_frame(run);
    if (shot->stats.mean > BRIGHT_ROOM) {
        weft_warn("the room is bright: %.0f %% of the range with all lights off; darken it",
                  100 * shot->stats.mean);
        run->report.n_warnings++;
    }
}

/* What the lights are compared with when the set has or gets no ambient frame now. */
weft_err weft_capture_look_at_the_dark(weft_capture_state *run, weft_error *err)
{
    const weft_planned_frame frame = {.role = WEFT_ROLE_AMBIENT,
                                      .light = -1,
                                      .exposure_s = weft_exposures_longest(&run->o),
                                      .middle = true};
    weft_shot shot;
    json_t *const reasons = json_array();
    const weft_err status = shoot_until_good(run, &frame, &shot, reasons, err);
    json_decref(reasons);
    if (status == WEFT_OK)
        weft_capture_remember_dark(run, &shot);
    return status;
}

void weft_capture_warn_of_clipping(weft_capture_state *run, const weft_planned_frame *frame,
                                   const weft_shot *shot)
{
    const char *colour;
    const double share = weft_frame_stats_clipped(&shot->stats, &colour);
    if (!frame->shortest || share <= CLIPPED_SHARE)
        return;
    weft_warn(
        "%s: %.1f %% of the %s pixels are clipped at %g s; give a shorter --exposure, or --bracket auto",
        frame->file, 100 * share, colour, run->shooter.frame.exposure_s);
    run->report.n_warnings++;
}

void weft_capture_remember_light(weft_capture_state *run, const weft_planned_frame *frame)
{
    if (frame->role == WEFT_ROLE_LIGHT && frame->middle)
        run->prints[frame->light] = print_of_frame(run);
}

weft_err weft_capture_read_prints(weft_capture_state *run, weft_error *err)
{
    for (int i = 0; i < run->plan.n; i++) {
        const weft_planned_frame *const f = &run->plan.frames[i];
        if (!f->have || f->role != WEFT_ROLE_LIGHT || !f->middle)
            continue;
        weft_mosaic mosaic;
        char *const path = weft_set_frame_path(&run->set, f->row, err);
        const weft_err status = path ? weft_raw_read(path, &mosaic, NULL, err) : WEFT_ERR_NOMEM;
        weft_free(path);
        WEFT_TRY(status);
        run->prints[f->light] = weft_light_print_make(&mosaic, weft_set_frame_time(&run->set.frames[f->row]));
        weft_mosaic_fini(&mosaic);
    }
    return WEFT_OK;
}
