/**
 * A virtual Nikon D5100 over the table of the virtual scanner: PTP/IP on a local address, for the stock
 * libgphoto2.  A photograph is what the sensor sees under the lamps that the firmware has on while the
 * shutter is open, in simulated time, as a NEF.
 *
 * It does what the body does over USB (libgphoto2 sees no other difference than the wire): capture into its
 * memory (0x9207, 0x90C0, 0x90CB), busy until the exposure is over (0x90C8), events by 0x90C7, a second
 * frame's time for long-exposure noise reduction.  What the body may do wrong can be asked of it.
 */
#ifndef WEFT_HOST_RIG_DSLR_H
#define WEFT_HOST_RIG_DSLR_H

#include "host/rig/controller_sim.h"
#include "host/rig/stage.h"

#include <jansson.h>

#define WEFT_DSLR_PORT   15740 /* PTP/IP's own; any free one when it is taken */
#define WEFT_DSLR_SERIAL "6001234"

typedef struct weft_dslr weft_dslr;

weft_err weft_dslr_create(const char *address, weft_rig_stage *stage, weft_controller_sim *sim,
                          weft_dslr **dslr, weft_error *err);
void weft_dslr_destroy(weft_dslr *dslr);

/** The TCP port at which it listens. */
int weft_dslr_port(const weft_dslr *dslr);

/**
 * Obeys one line, words apart by blanks; from any thread:
 *
 *     state               what it is doing
 *     reset               no fault, cable in, settings as from the factory
 *     unplug | plug       the cable
 *     turn CODE VALUE     a setting by its own buttons, such as turn 0x5004 2 (JPEG)
 *     lock CODE | free CODE  the client's changes of a setting are refused, or not
 *     fault NAME [NUMBER] see the table in dslr.c
 *
 * @return {"ok": true, ...} or {"ok": false, "error": "..."}
 */
json_t *weft_dslr_obey(weft_dslr *dslr, const char *line);

#endif
