#include "firmware/fw_sequence.h"

#include "firmware/fw_board.h"
#include "firmware/fw_config.h"
#include "firmware/fw_light.h"
#include "firmware/fw_link.h"
#include "firmware/fw_safety.h"
#include "firmware/fw_settings.h"

typedef struct step {
    uint16_t mask, level; /* level: trimmed; both 0 for a dark frame */
    uint16_t settle, trigger;
    uint32_t hold, gap; /* ticks, as all times here */
    bool is_set, until_exposure;
} step;

static step steps[FW_MAX_STEPS];
static const step *current; /* &steps[run.index], for the interrupts */

typedef enum phase { PHASE_NONE, PHASE_GAP, PHASE_SETTLE, PHASE_PULSE, PHASE_HOLD } phase;

/* Changed by the interrupts; by the loop with them locked, or while nothing runs. */
static struct {
    volatile phase phase;
    volatile uint8_t index; /* of the step that runs, or runs next in the first gap */
    uint8_t end;
    volatile uint8_t fault; /* WEFT_FAULT_* of the last run */
    uint16_t run_id;
    volatile bool ended; /* and the loop has not told yet */
    uint8_t done;        /* steps of this run that have ended as they should */
} run;

/* Written at `head` by the interrupts, told at `tail` by the loop; the one at `head` is of the step that
 * runs. */
static struct {
    weft_step_event records[FW_STEP_RING];
    volatile uint8_t head, tail;
} told;

static weft_step_event *record; /* &told.records[told.head] */

void fw_sequence_init(void)
{
    fw_sequence_clear();
    run.phase = PHASE_NONE;
    run.fault = WEFT_FAULT_NONE;
    run.ended = false;
    told.head = told.tail = 0;
    record = told.records;
    current = steps;
}

void fw_sequence_clear(void)
{
    for (uint8_t i = 0; i < FW_MAX_STEPS; i++)
        steps[i].is_set = false;
}

/* -- the table ------------------------------------------------------------------------------------------ */

static uint32_t to_ticks(uint32_t us)
{
    return (us + FW_US_A_TICK / 2) / FW_US_A_TICK; /* a power of two: a shift */
}

static uint8_t check(const weft_seq_set_request *s)
{
    if (s->index >= FW_MAX_STEPS)
        return WEFT_STATUS_LIMIT;
    if (s->mask >> fw_settings()->n_lights || s->level > FW_LEVEL_MAX || s->hold_mode > WEFT_HOLD_EXPOSURE)
        return WEFT_STATUS_BAD_ARG;
    if (s->trigger_us != 0 && s->trigger_us < FW_PULSE_MIN_US)
        return WEFT_STATUS_BAD_ARG;
    if (s->hold_us < FW_HOLD_MIN_US || s->trigger_us > s->hold_us)
        return WEFT_STATUS_BAD_ARG;
    if (s->settle_us > FW_SETTLE_MAX_US || s->trigger_us > FW_SETTLE_MAX_US || s->gap_us > FW_GAP_MAX_US)
        return WEFT_STATUS_LIMIT;
    const uint32_t max_on_us = (uint32_t)fw_settings()->max_on_ms * 1000u;
    if (s->hold_us > max_on_us || s->settle_us > max_on_us - s->hold_us)
        return WEFT_STATUS_LIMIT;
    return WEFT_STATUS_OK;
}

uint8_t fw_sequence_set(const weft_seq_set_request *s)
{
    if (fw_sequence_is_running())
        return WEFT_STATUS_BUSY;
    const uint8_t status = check(s);
    if (status != WEFT_STATUS_OK)
        return status;
    step *const to = &steps[s->index];
    const bool dark = s->mask == 0 || s->level == 0;
    to->mask = dark ? 0 : s->mask;
    to->level = dark ? 0 : fw_settings_trim(s->mask, s->level);
    to->settle = (uint16_t)to_ticks(s->settle_us);
    to->trigger = (uint16_t)to_ticks(s->trigger_us);
    to->hold = to_ticks(s->hold_us);
    to->gap = to_ticks(s->gap_us);
    to->until_exposure = s->hold_mode == WEFT_HOLD_EXPOSURE;
    to->is_set = true;
    return WEFT_STATUS_OK;
}

static bool are_set(uint8_t first, uint8_t count)
{
    if (count == 0 || first >= FW_MAX_STEPS || count > FW_MAX_STEPS - first)
        return false;
    for (uint8_t i = 0; i < count; i++)
        if (!steps[first + i].is_set)
            return false;
    return true;
}

uint8_t fw_sequence_run(const weft_seq_run_request *request, uint32_t *start_tick)
{
    if (fw_sequence_is_running())
        return WEFT_STATUS_BUSY;
    if (!are_set(request->first, request->count))
        return WEFT_STATUS_BAD_ARG;
    const uint8_t allowed = fw_safety_allows_light();
    if (allowed != WEFT_STATUS_OK)
        return allowed;
    fw_light_off();
    run.index = request->first;
    current = &steps[request->first];
    run.end = (uint8_t)(request->first + request->count);
    run.run_id = request->run_id;
    run.fault = WEFT_FAULT_NONE;
    run.ended = false;
    run.done = 0;
    told.tail = told.head; /* what the host did not wait for */
    const uint8_t was = fw_board_lock();
    *start_tick = fw_board_ticks() + FW_START_TICKS;
    run.phase = PHASE_GAP;
    fw_board_watch_exposure(true);
    fw_board_alarm_begin(FW_START_TICKS);
    fw_board_unlock(was);
    return WEFT_STATUS_OK;
}

/* -- interrupts: neither of the two runs inside the other; those of serial line and clock run inside both --
 */

/* Also from the loop, with interrupts locked. */
static void halt(void)
{
    fw_board_alarm_stop();
    fw_board_trigger(false);
    fw_board_dark();
    fw_board_watch_exposure(false);
    run.phase = PHASE_NONE;
}

static void end_run(uint8_t fault)
{
    halt();
    run.fault = fault;
    run.ended = true;
}

/* A panic between the check and the light would be overruled. */
static bool turn_on(const step *s)
{
    const uint8_t was = fw_board_lock();
    const bool allowed = !fw_safety_panicked();
    if (allowed && s->mask)
        fw_board_light(s->mask, s->level);
    if (!allowed)
        halt();
    fw_board_unlock(was);
    return allowed;
}

static void begin_step(void)
{
    const step *const s = current;
    weft_step_event *const r = record;
    if (!turn_on(s))
        return;
    r->on_tick = fw_board_ticks();
    r->run_id = run.run_id;
    r->index = run.index;
    r->flags = 0;
    run.phase = PHASE_SETTLE;
    fw_board_alarm_after(s->settle);
}

static void end_step(uint8_t fault)
{
    fw_board_dark();
    fw_board_trigger(false);
    record->off_tick = fw_board_ticks();
    const uint8_t next = (uint8_t)(told.head + 1) & (FW_STEP_RING - 1);
    if (next == told.tail)
        fault = WEFT_FAULT_TOO_FAST;
    else
        told.head = next;
    record = &told.records[told.head];
    if (fault) {
        end_run(fault);
        return;
    }
    current++;
    run.index++;
    run.done++;
    run.phase = PHASE_GAP;
}

static void begin_trigger(void)
{
    const step *const s = current;
    weft_step_event *const r = record;
    if (s->until_exposure && fw_board_is_exposing()) {
        r->trigger_tick = r->on_tick;
        end_step(WEFT_FAULT_EXPOSURE_EARLY);
        return;
    }
    r->flags &= (uint8_t) ~(WEFT_STEP_ROSE | WEFT_STEP_FELL); /* edges before it were not ours */
    if (s->trigger)
        fw_board_trigger(true);
    r->trigger_tick = fw_board_ticks();
    run.phase = PHASE_PULSE;
    fw_board_alarm_after(s->trigger);
}

void fw_sequence_on_alarm(void)
{
    const step *const s = current;
    if (fw_safety_panicked()) {
        halt();
        return;
    }
    switch (run.phase) {
    case PHASE_NONE:
        fw_board_alarm_stop();
        break;
    case PHASE_GAP:
        if (run.index == run.end)
            end_run(WEFT_FAULT_NONE);
        else
            begin_step();
        break;
    case PHASE_SETTLE:
        begin_trigger();
        break;
    case PHASE_PULSE:
        fw_board_trigger(false);
        run.phase = PHASE_HOLD;
        fw_board_alarm_after(s->hold - s->trigger);
        break;
    case PHASE_HOLD:
        end_step(s->until_exposure ? WEFT_FAULT_EXPOSURE_MISSING : WEFT_FAULT_NONE);
        if (run.phase == PHASE_GAP)
            fw_board_alarm_after(s->gap);
        break;
    }
}

void fw_sequence_on_exposure(bool rose, uint32_t tick)
{
    const step *const s = current;
    weft_step_event *const r = record;
    if (run.phase != PHASE_PULSE && run.phase != PHASE_HOLD)
        return;
    if (rose && !(r->flags & WEFT_STEP_ROSE)) {
        r->flags |= WEFT_STEP_ROSE;
        r->rise_tick = tick;
    } else if (!rose && (r->flags & (WEFT_STEP_ROSE | WEFT_STEP_FELL)) == WEFT_STEP_ROSE) {
        r->flags |= WEFT_STEP_FELL;
        r->fall_tick = tick;
        if (s->until_exposure) {
            end_step(WEFT_FAULT_NONE);
            if (run.phase == PHASE_GAP)
                fw_board_alarm_begin(s->gap);
        }
    }
}

/* -- the loop ------------------------------------------------------------------------------------------- */

void fw_sequence_stop(void)
{
    const uint8_t was = fw_board_lock();
    if (run.phase != PHASE_NONE)
        halt();
    fw_board_unlock(was);
}

static void tell_end(void)
{
    uint8_t payload[WEFT_DONE_EVENT_BYTES + WEFT_FAULT_EVENT_BYTES];
    run.ended = false;
    if (run.fault == WEFT_FAULT_NONE) {
        const weft_done_event event = {.run_id = run.run_id, .n_steps = run.done};
        weft_done_event_encode(&event, payload);
        fw_link_send_event(WEFT_EVENT_DONE, payload, WEFT_DONE_EVENT_BYTES);
    } else {
        const weft_fault_event event = {.cause = run.fault, .run_id = run.run_id, .index = run.index};
        weft_fault_event_encode(&event, payload);
        fw_link_send_event(WEFT_EVENT_FAULT, payload, WEFT_FAULT_EVENT_BYTES);
    }
}

void fw_sequence_poll(void)
{
    uint8_t payload[WEFT_STEP_EVENT_BYTES];
    const bool ended = run.ended; /* before the steps: whatever ended before it is among them */
    while (told.tail != told.head) {
        if (!fw_link_has_room(WEFT_STEP_EVENT_BYTES))
            return; /* soon */
        weft_step_event *const r = &told.records[told.tail];
        if (!(r->flags & WEFT_STEP_ROSE))
            r->rise_tick = r->on_tick;
        if (!(r->flags & WEFT_STEP_FELL))
            r->fall_tick = r->on_tick;
        weft_step_event_encode(r, payload);
        fw_link_send_event(WEFT_EVENT_STEP, payload, sizeof payload);
        told.tail = (uint8_t)(told.tail + 1) & (FW_STEP_RING - 1);
    }
    if (ended && fw_link_has_room(WEFT_FAULT_EVENT_BYTES))
        tell_end();
}

bool fw_sequence_is_running(void)
{
    return run.phase != PHASE_NONE;
}

bool fw_sequence_has_failed(void)
{
    return run.fault != WEFT_FAULT_NONE;
}

void fw_sequence_forgive(void)
{
    if (!fw_sequence_is_running() && !run.ended)
        run.fault = WEFT_FAULT_NONE;
}

static const step *lit_step(void)
{
    static const step none;
    const uint8_t was = fw_board_lock();
    const step *const s = run.phase > PHASE_GAP ? &steps[run.index] : &none;
    fw_board_unlock(was);
    return s;
}

uint16_t fw_sequence_mask(void)
{
    return lit_step()->mask;
}

uint16_t fw_sequence_level(void)
{
    return lit_step()->level;
}
