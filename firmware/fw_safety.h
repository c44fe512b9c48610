/**
 * The ladder of fail-safes above the lamps' own time limit: lease, panic, the SAFE latch.
 *
 * Below it are the watchdog (the loop feeds it only after every poll has run) and the pull-downs of the
 * drivers (a reset lets go of every pin).
 */
#ifndef WEFT_FIRMWARE_FW_SAFETY_H
#define WEFT_FIRMWARE_FW_SAFETY_H

#include <stdbool.h>
#include <stdint.h>

void fw_safety_init(void);

/** Every valid frame says that the host lives. */
void fw_safety_host_lives(void);

/** HELLO came: half of the way out of SAFE.  Makes the boot nonce at the first one after a reset.
 *  @return the boot nonce, never 0 */
uint32_t fw_safety_hello(uint32_t salt);
/** 0 before the first HELLO. */
uint32_t fw_safety_boot_nonce(void);

/** Grants a lease of about `ms` (0: takes it back and latches SAFE).
 *  @return WEFT_STATUS_OK, or WEFT_STATUS_SAFE_LATCHED without a HELLO since the start or SAFE */
uint8_t fw_safety_lease(uint16_t ms, uint16_t *granted_ms);

/** @return WEFT_STATUS_OK when lights may be on now, or why not. */
uint8_t fw_safety_allows_light(void);

/** Dark at once.  From the receive interrupt; fw_safety_poll() does the rest. */
void fw_safety_panic(void);
/** Whether a panic waits for fw_safety_poll(). */
bool fw_safety_panicked(void);

/** Takes notice of a panic and of the end of the lease; from the loop, and before each command. */
void fw_safety_poll(void);

uint8_t fw_safety_state(void); /* WEFT_STATE_* */
uint8_t fw_safety_cause(void); /* WEFT_CAUSE_* */
uint16_t fw_safety_lease_left_ms(void);

#endif
