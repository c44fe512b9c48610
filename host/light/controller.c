#include "host/light/controller.h"

#include "core/log.h"
#include "core/progress.h"
#include "host/light/controller_crash.h"
#include "host/light/controller_private.h"

#include <stdio.h>
#include <string.h>

/* How long the n-th try waits for its reply.  A board answers within a millisecond: the waits are for
 * damaged frames and for a busy computer. */
static const int try_ms[] = {30, 30, 40, 50, 50, 100, 100, 150, 200, 200};
enum { N_TRIES = sizeof try_ms / sizeof try_ms[0] };

/* Storing a setting takes the EEPROM 3.4 ms a byte. */
enum { STORE_MS = 250 };

/* -- frames --------------------------------------------------------------------------------------------- */

/* Adds a byte; true when it ends a good frame of ours. */
static bool take_byte(weft_controller *c, uint8_t byte, weft_frame *frame)
{
    if (byte != 0) {
        if (c->n < sizeof c->wire)
            c->wire[c->n++] = byte;
        else
            c->too_long = true;
        return false;
    }
    const bool good = !c->too_long && weft_frame_decode(c->wire, c->n, frame) == WEFT_FRAME_GOOD;
    if (!good && c->n > 0)
        c->bad_replies++;
    c->n = 0;
    c->too_long = false;
    return good;
}

/* The next good frame of any kind; *got is false at the deadline. */
static weft_err next_frame(weft_controller *c, double deadline_s, weft_frame *frame, bool *got,
                           weft_error *err)
{
    for (;;) {
        while (c->unread_at < c->unread_n)
            if (take_byte(c, c->unread[c->unread_at++], frame)) {
                *got = true;
                return WEFT_OK;
            }
        c->unread_at = 0;
        WEFT_TRY(weft_serial_read(&c->serial, c->unread, sizeof c->unread, deadline_s, &c->unread_n, err));
        c->n_bytes += c->unread_n;
        if (c->unread_n == 0) {
            *got = false;
            return WEFT_OK;
        }
    }
}

static void note_event(weft_controller *c, const weft_frame *frame)
{
    if (frame->command == WEFT_EVENT_SAFE && frame->n >= WEFT_SAFE_EVENT_BYTES)
        weft_explain("%s: the controller went dark: %s", c->serial.name,
                     weft_protocol_cause_text(frame->payload[0]));
    else if (c->n_events < MAX_EVENTS) /* when full, the new one is lost, and a run misses it */
        c->events[c->n_events++] = *frame;
}

weft_err weft_controller_next_event(weft_controller *c, double deadline_s, weft_frame *event, bool *got,
                                    weft_error *err)
{
    weft_frame frame;
    *got = true;
    while (c->n_events == 0 && *got) {
        WEFT_TRY(next_frame(c, deadline_s, &frame, got, err));
        if (*got && frame.type == WEFT_FRAME_EVENT)
            note_event(c, &frame);
    }
    if (c->n_events > 0) {
        *event = c->events[0];
        memmove(c->events, c->events + 1, (size_t)--c->n_events * sizeof c->events[0]);
    }
    return WEFT_OK;
}

weft_err weft_controller_next_reply(weft_controller *c, uint8_t seq, uint8_t command, double deadline_s,
                                    weft_frame *reply, bool *got, weft_error *err)
{
    for (;;) {
        WEFT_TRY(next_frame(c, deadline_s, reply, got, err));
        if (!*got)
            return WEFT_OK;
        if (reply->type == WEFT_FRAME_EVENT)
            note_event(c, reply);
        else if (reply->type == WEFT_FRAME_REPLY && reply->n > 0 &&
                 ((reply->seq == seq && reply->command == command) ||
                  reply->payload[0] == WEFT_STATUS_BAD_CRC))
            return WEFT_OK;
    }
}

uint8_t weft_controller_encode(weft_controller *c, uint8_t command, const uint8_t *payload, uint8_t n,
                               uint8_t *wire)
{
    weft_frame request = {.version = WEFT_PROTOCOL_MAJOR,
                          .type = WEFT_FRAME_REQUEST,
                          .seq = ++c->seq,
                          .command = command,
                          .n = n};
    memcpy(request.payload, payload, n);
    return weft_frame_encode(&request, wire);
}

/* Sends a command until it is answered.  The same frame again is safe: the board answers it from its
 * memory and does not run it twice. */
static weft_err transact(weft_controller *c, uint8_t command, const uint8_t *payload, uint8_t n,
                         weft_frame *reply, weft_error *err)
{
    uint8_t wire[WEFT_FRAME_WIRE_MAX];
    const uint8_t length = weft_controller_encode(c, command, payload, n, wire);
    const double begin_s = weft_clock_s();
    const double on_the_line_s = 10.0 * (length + WEFT_FRAME_WIRE_MAX) / c->serial.rate;
    const int storing_ms = command == WEFT_CMD_CFG_SET ? STORE_MS : 0;
    for (int i = 0; i < N_TRIES; i++) {
        bool got;
        const double deadline_s = weft_clock_s() + 1e-3 * (try_ms[i] + storing_ms) + on_the_line_s;
        c->retries += i > 0;
        WEFT_TRY(weft_serial_write(&c->serial, wire, length, deadline_s, err));
        WEFT_TRY(weft_controller_next_reply(c, c->seq, command, deadline_s, reply, &got, err));
        if (got && reply->payload[0] != WEFT_STATUS_BAD_CRC)
            return WEFT_OK;
    }
    return weft_fail(err, WEFT_ERR_TIMEOUT,
                     "%s: the light controller does not answer %s (%d tries in %.2f s); its lights go off by "
                     "themselves; check the cable",
                     c->serial.name, weft_protocol_command_name(command), N_TRIES, weft_clock_s() - begin_s);
}

/* -- what refusals mean --------------------------------------------------------------------------------- */

static weft_err ask_status(weft_controller *c, weft_status_reply *status, weft_error *err)
{
    weft_frame reply;
    WEFT_TRY(transact(c, WEFT_CMD_STATUS, (const uint8_t *)"", 0, &reply, err));
    if (reply.payload[0] != WEFT_STATUS_OK)
        return weft_fail(err, WEFT_ERR_PROTOCOL, "%s: the light controller refuses STATUS: %s",
                         c->serial.name, weft_protocol_status_text(reply.payload[0]));
    weft_status_reply_decode(reply.payload + 1, (uint8_t)(reply.n - 1), status);
    return WEFT_OK;
}

static weft_err check_same_boot(const weft_controller *c, const weft_status_reply *status, weft_error *err)
{
    if (status->boot_nonce == c->info.boot_nonce)
        return WEFT_OK;
    return weft_fail(err, WEFT_ERR_DEVICE,
                     "%s: the light controller has reset meanwhile (%u resets since power on), so what was "
                     "going on is void; check its supply and cable, then begin again",
                     c->serial.name, status->resets);
}

static weft_err check_not_safe(const weft_controller *c, const weft_status_reply *status, weft_error *err)
{
    if (status->state != WEFT_STATE_SAFE)
        return WEFT_OK;
    return weft_fail(err, WEFT_ERR_DEVICE,
                     "%s: the light controller has gone dark for safety: %s; begin again", c->serial.name,
                     weft_protocol_cause_text(status->safe_cause));
}

/* Mostly, the board is not where we left it. */
weft_err weft_controller_refused(weft_controller *c, uint8_t command, uint8_t code, weft_error *err)
{
    weft_status_reply status;
    if (code == WEFT_STATUS_NOT_LEASED || code == WEFT_STATUS_SAFE_LATCHED) {
        WEFT_TRY(ask_status(c, &status, err));
        WEFT_TRY(check_same_boot(c, &status, err));
        WEFT_TRY(check_not_safe(c, &status, err));
    }
    if (code == WEFT_STATUS_EEPROM)
        return weft_fail(
            err, WEFT_ERR_DEVICE,
            "%s: the controller's settings cannot be stored, or those that it has cannot be read; "
            "\"weft light set defaults\" begins anew",
            c->serial.name);
    return weft_fail(
        err, code == WEFT_STATUS_BAD_ARG || code == WEFT_STATUS_LIMIT ? WEFT_ERR_RANGE : WEFT_ERR_PROTOCOL,
        "%s: the light controller refuses %s: %s", c->serial.name, weft_protocol_command_name(command),
        weft_protocol_status_text(code));
}

weft_err weft_controller_command(weft_controller *c, uint8_t number, const uint8_t *payload, uint8_t n,
                                 uint8_t bytes, weft_frame *reply, weft_error *err)
{
    WEFT_TRY(transact(c, number, payload, n, reply, err));
    if (reply->payload[0] != WEFT_STATUS_OK)
        return weft_controller_refused(c, number, reply->payload[0], err);
    if (reply->n < bytes + 1)
        return weft_fail(err, WEFT_ERR_PROTOCOL,
                         "%s: the reply to %s is cut (wanted %d bytes, got %d); flash the firmware of this "
                         "build (weft flash)",
                         c->serial.name, weft_protocol_command_name(number), bytes + 1, reply->n);
    return WEFT_OK;
}

/* -- commands ------------------------------------------------------------------------------------------- */

const weft_controller_info *weft_controller_get_info(const weft_controller *c)
{
    return &c->info;
}

static weft_err check_light(const weft_controller_info *info, uint32_t mask, int level, int max_on_ms,
                            weft_error *err)
{
    if (info->n_lights < 32 && mask >> info->n_lights)
        return weft_fail(err, WEFT_ERR_RANGE, "%s: there is no light %d: this controller has 0 to %d",
                         info->port, 31 - __builtin_clz(mask), info->n_lights - 1);
    if (level < 0 || level > info->level_max)
        return weft_fail(err, WEFT_ERR_RANGE, "%s: light level %d: wanted 0 to %d", info->port, level,
                         info->level_max);
    if (max_on_ms < 1 || max_on_ms > info->max_on_ms)
        return weft_fail(err, WEFT_ERR_RANGE,
                         "%s: light for %d ms: this controller gives 1 to %d ms at a time", info->port,
                         max_on_ms, info->max_on_ms);
    return WEFT_OK;
}

weft_err weft_controller_light(weft_controller *c, uint32_t mask, int level, int max_on_ms, uint32_t *on_tick,
                               weft_error *err)
{
    WEFT_TRY(check_light(&c->info, mask, level, max_on_ms, err));
    const weft_light_request request = {
        .mask = (uint16_t)mask, .level = (uint16_t)level, .max_on_ms = (uint16_t)max_on_ms};
    uint8_t payload[WEFT_LIGHT_REQUEST_BYTES];
    weft_frame frame;
    weft_light_reply reply;
    weft_light_request_encode(&request, payload);
    WEFT_TRY(weft_controller_command(c, WEFT_CMD_LIGHT, payload, sizeof payload, WEFT_LIGHT_REPLY_BYTES,
                                     &frame, err));
    weft_light_reply_decode(frame.payload + 1, (uint8_t)(frame.n - 1), &reply);
    if (on_tick)
        *on_tick = reply.on_tick;
    return WEFT_OK;
}

weft_err weft_controller_off(weft_controller *c, uint32_t *off_tick, weft_error *err)
{
    weft_frame frame;
    weft_off_reply reply;
    WEFT_TRY(
        weft_controller_command(c, WEFT_CMD_OFF, (const uint8_t *)"", 0, WEFT_OFF_REPLY_BYTES, &frame, err));
    weft_off_reply_decode(frame.payload + 1, (uint8_t)(frame.n - 1), &reply);
    if (off_tick)
        *off_tick = reply.off_tick;
    return WEFT_OK;
}

weft_err weft_controller_get_status(weft_controller *c, weft_controller_status *status, weft_error *err)
{
    weft_status_reply s;
    WEFT_TRY(ask_status(c, &s, err));
    WEFT_TRY(check_same_boot(c, &s, err));
    *status = (weft_controller_status){
        .state = weft_protocol_state_name(s.state),
        .safe_cause = weft_protocol_cause_name(s.safe_cause),
        .lights = s.lights,
        .level = s.level,
        .ticks = s.ticks,
        .lease_left_ms = s.lease_left_ms,
        .on_left_ms = s.on_left_ms,
        .frames = s.frames,
        .crc_errors = s.crc_errors,
        .overruns = s.overruns,
        .resets = s.resets,
        .max_on_offs = s.max_on_offs,
        .retries = c->retries,
        .bad_replies = c->bad_replies,
    };
    return WEFT_OK;
}

weft_err weft_controller_keep_alive(weft_controller *c, weft_error *err)
{
    weft_status_reply s;
    WEFT_TRY(ask_status(c, &s, err));
    WEFT_TRY(check_same_boot(c, &s, err));
    return check_not_safe(c, &s, err);
}

bool weft_controller_is_gone(const weft_controller *c)
{
    return c->serial.gone;
}

int weft_controller_panic_fd(const weft_controller *c)
{
    return c->serial.fd;
}

void weft_controller_panic_on_crash(const weft_controller *c)
{
    weft_controller_watch_crash(c->serial.fd);
}
