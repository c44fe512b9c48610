/**
 * The lamps: which are on, how bright, since when and for how long at most.
 */
#ifndef WEFT_FIRMWARE_FW_LIGHT_H
#define WEFT_FIRMWARE_FW_LIGHT_H

#include <stdbool.h>
#include <stdint.h>

void fw_light_init(void);

/**
 * Exactly the lights of `mask` at `level` for at most max_on_ms (exact to a millisecond, on the short side).
 *
 * All lights go dark before the new ones go on, so two different sets are never on together.  The set and
 * level that are on already stay on without a gap and only their time begins anew; the on tick stays.
 * A mask or level of 0 is fw_light_off().
 *
 * @return false, and dark, when a panic was recognised that fw_safety_poll() has not seen yet
 */
bool fw_light_set(uint16_t mask, uint16_t level, uint16_t max_on_ms);

/** Dark.  The one function that every way into darkness takes, also from the receive interrupt. */
void fw_light_dark(void);

/** Dark, and the book-keeping of it; from the loop. */
void fw_light_off(void);

/** Ends what has been on for too long; from the loop. */
void fw_light_poll(void);

uint16_t fw_light_mask(void);
uint16_t fw_light_level(void);    /* 0 when dark */
uint16_t fw_light_left_ms(void);  /* until max_on_ms; 0 when dark */
uint32_t fw_light_on_tick(void);  /* of the last switching on */
uint32_t fw_light_off_tick(void); /* of the last switching off */
uint16_t fw_light_max_on_offs(void);

#endif
