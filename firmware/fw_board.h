/**
 * What the logic of the firmware asks of the board.
 *
 * avr/avr_board.c answers with the registers of an ATmega328P, sim/sim_board.c with variables, for the
 * unit tests on a PC.  Nothing else touches hardware.
 */
#ifndef WEFT_FIRMWARE_FW_BOARD_H
#define WEFT_FIRMWARE_FW_BOARD_H

#include <stdbool.h>
#include <stdint.h>

/** Ports dark, clocks and USART running, interrupts on.  Once, first thing in main. */
void fw_board_init(void);

/** Why it started (WEFT_RESET_*) and how many resets there were since power came on. */
uint8_t fw_board_reset_cause(void);
uint16_t fw_board_resets(void);

/** Lets no interrupt in until restored; for a few microseconds only (a byte lasts 20). */
uint8_t fw_board_lock(void);
void fw_board_unlock(uint8_t was);

/** All lights and the dimming line low, in a few cycles.  From the loop and from interrupts. */
void fw_board_dark(void);

/** Lights on at a level 1..FW_LEVEL_MAX, after everything was dark, the PWM begun anew.  Locked. */
void fw_board_light(uint16_t mask, uint16_t level);

/** Ticks of FW_TICK_HZ, and milliseconds, since the start; both wrap. */
uint32_t fw_board_ticks(void);
uint16_t fw_board_ms(void);

/** Says that there are bytes to send: the board asks fw_link_next_byte() from its interrupt. */
void fw_board_send(void);

/** The status LED beside the USB socket (not a light of the dome). */
void fw_board_status_led(bool on);

/** The watchdog resets the board when it is not fed for 250 ms. */
void fw_board_watchdog_start(void);
void fw_board_watchdog_feed(void);

/** Sleeps until the next interrupt, at most a millisecond; returns at once when `fw_link_has_bytes()`. */
void fw_board_sleep(void);

#endif
