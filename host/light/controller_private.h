/**
 * The inside of controller.h, for its parts: commands and events.  Private to host/light.
 */
#ifndef WEFT_HOST_LIGHT_CONTROLLER_PRIVATE_H
#define WEFT_HOST_LIGHT_CONTROLLER_PRIVATE_H

#include "host/light/controller.h"
#include "host/light/serial_port.h"

enum { MAX_EVENTS = 64 };

struct weft_controller {
    weft_serial serial;
    uint8_t seq;
    uint8_t wire[WEFT_FRAME_WIRE_MAX]; /* the frame that is coming in */
    size_t n;
    bool too_long;
    uint8_t unread[256]; /* bytes behind it */
    size_t unread_at, unread_n;
    size_t n_bytes; /* that ever came */
    uint32_t retries, bad_replies;
    weft_frame events[MAX_EVENTS]; /* that came and nobody has asked for, the oldest first */
    int n_events;
    weft_controller_info info;
    int lease_ms;
    char dev[512]; /* where it is looked for when its port has vanished */
};

/* -- frames (controller.c) */

/** A request with the next sequence number, as it goes over the line.  @return its bytes */
uint8_t weft_controller_encode(weft_controller *c, uint8_t command, const uint8_t *payload, uint8_t n,
                               uint8_t *wire);

/** The reply to `seq`, or any complaint of a damaged frame: only one command is ever under way.  *got is
 * false at the deadline. */
weft_err weft_controller_next_reply(weft_controller *c, uint8_t seq, uint8_t command, double deadline_s,
                                    weft_frame *reply, bool *got, weft_error *err);

/** Turns a refusal into what the user needs to know.  @return never WEFT_OK */
weft_err weft_controller_refused(weft_controller *c, uint8_t command, uint8_t code, weft_error *err);

/** A command whose reply must be OK; `reply` is then at least `bytes` long behind its status.  Events on the
 *  way are kept. */
weft_err weft_controller_command(weft_controller *c, uint8_t number, const uint8_t *payload, uint8_t n,
                                 uint8_t bytes, weft_frame *reply, weft_error *err);

/** The next event but SAFE, kept or new; *got is false at the deadline. */
weft_err weft_controller_next_event(weft_controller *c, double deadline_s, weft_frame *event, bool *got,
                                    weft_error *err);

#endif
