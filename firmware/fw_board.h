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

/** The trigger line to the camera. */
void fw_board_trigger(bool high);

/** Lets edges of the exposure line come to fw_sequence_on_exposure(), or not. */
void fw_board_watch_exposure(bool on);
/** Whether the exposure line is high. */
bool fw_board_is_exposing(void);

/** Calls fw_sequence_on_alarm() from an interrupt: `ticks` from now, or from when the last alarm was due.
 *  One that is due already rings at once, and what comes after it
 *  counts from then. */
void fw_board_alarm_begin(uint32_t ticks);
void fw_board_alarm_after(uint32_t ticks);
void fw_board_alarm_stop(void);

/** Bytes that stay without power.  Writing takes 3.4 ms unless the byte is the same; the watchdog is fed. */
uint8_t fw_board_eeprom_read(uint16_t address);
void fw_board_eeprom_write(uint16_t address, uint8_t byte);

/** From now on the loop may do what it likes: the watchdog resets the board, and the next start knows that
 *  it was asked for. */
void fw_board_reboot(void);

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
