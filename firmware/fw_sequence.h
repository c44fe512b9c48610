/**
 * Sequences: a table of steps, each a set of lights with settling time, trigger pulse, hold and gap.
 *
 * The edges are made by two interrupts, the board's alarm and the camera's exposure line, so that nothing
 * the loop does delays them.  Of one step:
 *
 *     lights   ____|~~~~~~~~~~~~~~~~~~~~~~~~~~~~~~|________|~~
 *                  :<-settle->:                   :<-gap-->:
 *     trigger  ________________|~~~~~|____________________________
 *                             :<--- hold -------->:
 *
 * With FW_HOLD_EXPOSURE the lights stay until the exposure line falls, and `hold` is the longest wait.
 * A step without lights is a dark frame.
 */
#ifndef WEFT_FIRMWARE_FW_SEQUENCE_H
#define WEFT_FIRMWARE_FW_SEQUENCE_H

#include "firmware/protocol.h"

#include <stdbool.h>
#include <stdint.h>

void fw_sequence_init(void);

/** Stores a step.
 *  @return WEFT_STATUS_OK, _BAD_ARG, _LIMIT (on for too long, no such place) or _BUSY while one runs */
uint8_t fw_sequence_set(const weft_seq_set_request *step);

/** Empties the table; the settings that its steps were checked against have changed. */
void fw_sequence_clear(void);

/** Runs `count` steps from `first` on.
 *  @return WEFT_STATUS_OK, _BAD_ARG when a step is not set, _BUSY, or why no lights may be on now */
uint8_t fw_sequence_run(const weft_seq_run_request *request, uint32_t *start_tick);

/** Dark, trigger low, nothing runs; from the loop.  Steps that have ended are still told. */
void fw_sequence_stop(void);

/** Tells the host what has happened; from the loop. */
void fw_sequence_poll(void);

bool fw_sequence_is_running(void);
/** Whether the last one ended by a failure and nobody has taken notice yet by fw_sequence_forgive(). */
bool fw_sequence_has_failed(void);
void fw_sequence_forgive(void);
/** Of the step that is lit now; 0 when none is. */
uint16_t fw_sequence_mask(void);
uint16_t fw_sequence_level(void);

/** The alarm rings: from its interrupt. */
void fw_sequence_on_alarm(void);
/** The exposure line has risen or fallen at `tick`: from its interrupt. */
void fw_sequence_on_exposure(bool rose, uint32_t tick);

#endif
