/**
 * The serial line: bytes to frames, frames to commands, replies back; one line of text for people.
 *
 * The interrupts move bytes between the USART and two rings; everything else happens in the loop.
 */
#ifndef WEFT_FIRMWARE_FW_LINK_H
#define WEFT_FIRMWARE_FW_LINK_H

#include <stdbool.h>
#include <stdint.h>

void fw_link_init(void);

/** A byte came; `damaged` when the USART reports a framing error or that it lost bytes before this one.
 *  From the receive interrupt.  Recognises the panic. */
void fw_link_on_byte(uint8_t byte, bool damaged);

/** The next byte to send; false when there is none.  From the transmit interrupt. */
bool fw_link_next_byte(uint8_t *byte);

/** Whether received bytes wait.  With interrupts locked or not. */
bool fw_link_has_bytes(void);

/** Answers the next of what has come in; from the loop. */
void fw_link_poll(void);

/** Forgets the bytes that came before the last panic; from the loop, through fw_safety_poll(). */
void fw_link_discard(void);

/** Whether an event with n bytes of payload can be sent now. */
bool fw_link_has_room(uint8_t n);

/** Sends an event; dropped when there is no room, which its number shows to the host. */
void fw_link_send_event(uint8_t number, const uint8_t *payload, uint8_t n);

uint32_t fw_link_frames(void);
uint16_t fw_link_crc_errors(void);
uint16_t fw_link_overruns(void);

#endif
