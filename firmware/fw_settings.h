/**
 * What the board remembers without power: serial number, number of lights, longest light, trims.
 *
 * Two slots in the EEPROM; a change is written into the older one, whose first byte is made valid last.
 * Power may go at any moment: what was stored before is then still there.
 */
#ifndef WEFT_FIRMWARE_FW_SETTINGS_H
#define WEFT_FIRMWARE_FW_SETTINGS_H

#include "firmware/fw_config.h"
#include "firmware/protocol.h"

#include <stdint.h>

typedef struct fw_settings_values {
    uint8_t serial_number[8];   /* ASCII, filled up with NUL */
    uint8_t n_lights;           /* 1..FW_N_LIGHTS */
    uint16_t max_on_ms;         /* 1..FW_MAX_ON_MS */
    uint8_t trims[FW_N_LIGHTS]; /* full level becomes trim + 1 parts of 256 */
} fw_settings_values;

/** Reads the EEPROM; built-in values where there is nothing, or nothing to be believed. */
void fw_settings_init(void);

const fw_settings_values *fw_settings(void);
uint8_t fw_settings_state(void); /* WEFT_SETTINGS_* */
uint16_t fw_settings_generation(void);

/** The level that gives `level` with the trims of these lights: they share one dimming line, so of several
 *  lights the lowest trim is taken.  Never 0 for a level above 0. */
uint16_t fw_settings_trim(uint16_t mask, uint16_t level);

/** @return WEFT_STATUS_OK or _BAD_ARG */
uint8_t fw_settings_get(const weft_cfg_get_request *request, weft_cfg_get_reply *reply);
/** Stores; takes up to 0.2 s.  @return WEFT_STATUS_OK, _BAD_ARG, or _EEPROM when it could not be stored, or
 *  when what is there cannot be read: then only WEFT_KEY_DEFAULTS is accepted */
uint8_t fw_settings_set(const weft_cfg_set_request *request, weft_cfg_set_reply *reply);

#endif
