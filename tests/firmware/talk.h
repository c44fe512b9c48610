/**
 * A test's talk with the real firmware on a stepped, simulated board, frame by frame, in simulated time.
 */
#ifndef WEFT_TESTS_FIRMWARE_TALK_H
#define WEFT_TESTS_FIRMWARE_TALK_H

#include "firmware/fw_config.h"
#include "firmware/protocol.h"
#include "host/rig/controller_sim.h"

#include <stdbool.h>
#include <stdint.h>

/** The board, between power_on() and power_off(). */
extern weft_controller_sim *sim;

/** A program of the build, by its path in there. */
const char *elf_path(const char *name);

/** Set-up and tear-down of a test. */
int power_on(void **state);
int power_off(void **state);

/** Writes a request as it goes over the line.  @return its bytes */
uint8_t request(uint8_t *wire, uint8_t number, uint8_t command, const void *payload, uint8_t n);

/** The next frame that comes within `ms`; false when none does. */
bool next_frame(weft_frame *f, int ms);

/** Sends a command and gives the status of its reply, with the reply's payload in `reply` (or NULL).  Events
 *  on the way are lost. */
int ask(uint8_t command, const void *payload, uint8_t n, weft_frame *reply);

/** The commands; each gives the status of the reply. */
int hello(weft_hello_reply *out);
int lease(uint16_t ms);
int light(uint16_t mask, uint16_t level, uint16_t max_on_ms);
uint8_t light_request(uint8_t *bytes, uint16_t mask, uint16_t level, uint16_t max_on_ms);
weft_status_reply status(void);

/** HELLO and LEASE, which must succeed. */
void take_lease(uint16_t ms);

/** What shines, and the simulated time. */
uint32_t lights(void);
double now_ms(void);
/** When the lights went off, in ms of simulated time. */
double off_at_ms(void);

#endif
