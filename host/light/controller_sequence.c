/* Sequences: the table into the board, the run, and what it tells about each step. */
#include "core/progress.h"
#include "host/light/controller_private.h"

#include <math.h>
#include <string.h>

static const double ask_every_s = 0.25; /* holds the shortest lease that is of use, and bears a lost event */

bool weft_controller_step_is_proved(const weft_controller_info *info, const weft_controller_step *step,
                                    const weft_controller_step_result *r)
{
    const double settle_ticks = 1e-6 * step->settle_us * info->tick_hz;
    return r->rose && r->fell && r->rise_tick - r->on_tick + 1.0 >= settle_ticks &&
           r->fall_tick - r->on_tick <= r->off_tick - r->on_tick;
}

static weft_err check_steps(const weft_controller_info *info, const weft_controller_step *steps, int n,
                            weft_error *err)
{
    if (!(info->capabilities & WEFT_CAPABILITY_SEQUENCES))
        return weft_fail(err, WEFT_ERR_UNSUPPORTED,
                         "%s: firmware %s knows no sequences; flash the firmware of this build (weft flash)",
                         info->port, info->firmware);
    if (n < 1 || n > info->max_steps)
        return weft_fail(err, WEFT_ERR_RANGE, "%s: a sequence of %d steps: this controller takes 1 to %d",
                         info->port, n, info->max_steps);
    for (int i = 0; i < n; i++) {
        const weft_controller_step *const s = &steps[i];
        if (info->n_lights < 32 && s->lights >> info->n_lights)
            return weft_fail(err, WEFT_ERR_RANGE,
                             "%s: step %d: there is no light %d: this controller has 0 to %d", info->port, i,
                             31 - __builtin_clz(s->lights), info->n_lights - 1);
        if (s->level < 0 || s->level > info->level_max)
            return weft_fail(err, WEFT_ERR_RANGE, "%s: step %d: light level %d: wanted 0 to %d", info->port,
                             i, s->level, info->level_max);
        if ((double)s->settle_us + s->hold_us > 1e3 * info->max_on_ms)
            return weft_fail(err, WEFT_ERR_RANGE,
                             "%s: step %d: lights on for up to %.1f ms: this controller gives at most %d ms",
                             info->port, i, 1e-3 * ((double)s->settle_us + s->hold_us), info->max_on_ms);
        if (s->settle_us > 250000 || s->gap_us > 10000000 || s->hold_us < 100 || s->trigger_us > 250000 ||
            s->trigger_us > s->hold_us || (s->trigger_us > 0 && s->trigger_us < 20))
            return weft_fail(
                err, WEFT_ERR_RANGE,
                "%s: step %d: wanted settle 0 to 250 ms, trigger 0 or 0.02 to 250 ms and at most "
                "the hold, hold from 0.1 ms, gap 0 to 10 s",
                info->port, i);
    }
    return WEFT_OK;
}

static weft_err set_step(weft_controller *c, int index, const weft_controller_step *s, weft_error *err)
{
    const weft_seq_set_request request = {.index = (uint8_t)index,
                                          .mask = (uint16_t)s->lights,
                                          .level = (uint16_t)s->level,
                                          .settle_us = s->settle_us,
                                          .trigger_us = s->trigger_us,
                                          .hold_mode =
                                              s->until_exposure ? WEFT_HOLD_EXPOSURE : WEFT_HOLD_FIXED,
                                          .hold_us = s->hold_us,
                                          .gap_us = s->gap_us};
    uint8_t payload[WEFT_SEQ_SET_REQUEST_BYTES];
    weft_frame reply;
    weft_seq_set_request_encode(&request, payload);
    return weft_controller_command(c, WEFT_CMD_SEQ_SET, payload, sizeof payload, 0, &reply, err);
}

static weft_err start(weft_controller *c, int n, uint16_t run_id, weft_error *err)
{
    const weft_seq_run_request request = {.first = 0, .count = (uint8_t)n, .run_id = run_id};
    uint8_t payload[WEFT_SEQ_RUN_REQUEST_BYTES];
    weft_frame reply;
    weft_seq_run_request_encode(&request, payload);
    c->n_events = 0; /* of runs before */
    return weft_controller_command(c, WEFT_CMD_SEQ_RUN, payload, sizeof payload, WEFT_SEQ_RUN_REPLY_BYTES,
                                   &reply, err);
}

static void abort_run(weft_controller *c)
{
    weft_frame reply;
    (void)weft_controller_command(c, WEFT_CMD_SEQ_ABORT, (const uint8_t *)"", 0, 0, &reply, NULL);
}

/* -- what the board tells -------------------------------------------------------------------------------- */

typedef struct run {
    uint16_t id;
    int n, n_told;
    bool done;
    weft_controller_step_result *results;
} run;

static void take_step(run *r, const weft_frame *event)
{
    weft_step_event e;
    weft_step_event_decode(event->payload, event->n, &e);
    if (e.run_id != r->id || e.index >= r->n)
        return;
    r->results[e.index] = (weft_controller_step_result){.index = e.index,
                                                        .rose = (e.flags & WEFT_STEP_ROSE) != 0,
                                                        .fell = (e.flags & WEFT_STEP_FELL) != 0,
                                                        .on_tick = e.on_tick,
                                                        .trigger_tick = e.trigger_tick,
                                                        .rise_tick = e.rise_tick,
                                                        .fall_tick = e.fall_tick,
                                                        .off_tick = e.off_tick};
    r->n_told++;
}

static weft_err take_event(const weft_controller *c, run *r, const weft_frame *event, weft_error *err)
{
    weft_done_event done;
    weft_fault_event fault;
    switch (event->command) {
    case WEFT_EVENT_STEP:
        take_step(r, event);
        return WEFT_OK;
    case WEFT_EVENT_DONE:
        weft_done_event_decode(event->payload, event->n, &done);
        r->done |= done.run_id == r->id;
        return WEFT_OK;
    case WEFT_EVENT_FAULT:
        weft_fault_event_decode(event->payload, event->n, &fault);
        if (fault.run_id != r->id)
            return WEFT_OK;
        return weft_fail(err, WEFT_ERR_DEVICE,
                         "%s: the sequence stopped in step %d, dark: %s; check the camera, its trigger and "
                         "exposure lines and the hold time",
                         c->serial.name, fault.index, weft_protocol_fault_text(fault.cause));
    default:
        return WEFT_OK;
    }
}

/* Asks how it goes, which also keeps the lease.  *ended: it runs no more. */
static weft_err look(weft_controller *c, bool *ended, weft_error *err)
{
    weft_controller_status status;
    WEFT_TRY(weft_controller_get_status(c, &status, err));
    if (strcmp(status.state, "SAFE") == 0)
        return weft_fail(err, WEFT_ERR_DEVICE,
                         "%s: the light controller has gone dark for safety (%s); begin again",
                         c->serial.name, status.safe_cause);
    *ended = strcmp(status.state, "RUNNING") != 0;
    return WEFT_OK;
}

static weft_err wait_for_end(weft_controller *c, run *r, double end_s, weft_error *err)
{
    bool ended = false;
    double asked_s = weft_clock_s();
    while (!r->done) {
        weft_frame event;
        bool got;
        WEFT_TRY(weft_controller_next_event(c, weft_clock_s() + ask_every_s, &event, &got, err));
        if (got)
            WEFT_TRY(take_event(c, r, &event, err));
        else if (ended)
            break;                                     /* it had ended a while ago: its last word is lost */
        if (weft_clock_s() - asked_s >= ask_every_s) { /* events are no sign of life of ours */
            WEFT_TRY(look(c, &ended, err));
            asked_s = weft_clock_s();
        }
        if (weft_cancelled())
            return weft_fail(err, WEFT_ERR_CANCELLED, "cancelled; the lights are off");
        if (weft_clock_s() > end_s)
            return weft_fail(err, WEFT_ERR_TIMEOUT, "%s: the sequence does not end; it was stopped",
                             c->serial.name);
    }
    if (r->n_told != r->n)
        return weft_fail(err, WEFT_ERR_PROTOCOL,
                         "%s: the controller told of %d of %d steps: the serial line loses bytes; check the "
                         "cable, then run the sequence again",
                         c->serial.name, r->n_told, r->n);
    return WEFT_OK;
}

weft_err weft_controller_run_sequence(weft_controller *c, const weft_controller_step *steps, int n,
                                      weft_controller_step_result *results, weft_error *err)
{
    static uint16_t last_id;
    run r = {.id = ++last_id, .n = n, .results = results};
    double us = 0;
    WEFT_TRY(check_steps(&c->info, steps, n, err));
    for (int i = 0; i < n; i++) {
        WEFT_TRY(set_step(c, i, &steps[i], err));
        us += (double)steps[i].settle_us + steps[i].hold_us + steps[i].gap_us;
    }
    weft_err status = start(c, n, r.id, err);
    if (status == WEFT_OK)
        status =
            wait_for_end(c, &r, weft_clock_s() + 20e-6 * us + 20, err); /* a simulated board may be slow */
    if (status != WEFT_OK)
        abort_run(c);
    return status;
}
