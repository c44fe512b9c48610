/**
 * A board of variables: the logic of the firmware in a unit test, its time and pins in the test's hands.
 * (The whole program with its registers is tested on a simulated processor, see host/rig.)
 */
#ifndef WEFT_FIRMWARE_SIM_BOARD_H
#define WEFT_FIRMWARE_SIM_BOARD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct sim_board {
    uint16_t mask, level; /* what shines; 0 when dark */
    uint32_t tick;        /* time; 250 a millisecond */
    bool status_led;
    uint8_t reset_cause;
    uint16_t resets;
    int darkened; /* calls of fw_board_dark() */
    int lit;      /* calls of fw_board_light() */
    int locked;   /* depth */
    int fed;      /* calls of fw_board_watchdog_feed() */
    bool trigger, watching, exposing;
    bool alarm;          /* is set */
    uint32_t alarm_tick; /* when */
    bool rebooting;
    int eeprom_writes_left; /* until the power goes, in the middle of the next one; -1: it stays */
    bool stalled;           /* the line takes no bytes */
    size_t sent;
    uint8_t wire[4096]; /* what was sent */
} sim_board;

extern sim_board sim;

enum { SIM_EEPROM_BYTES = 1024 };
/** Stays over sim_board_start(). */
extern uint8_t sim_eeprom[SIM_EEPROM_BYTES];

/** A reset: variables of the firmware as after power-on, the board dark, time 0. */
void sim_board_start(void);

/** Turns of the firmware's loop until it would sleep. */
void sim_board_turn(void);

/** The exposure line changes; the firmware sees it when it watches. */
void sim_board_expose(bool high);

/** Time passes, with one turn of the loop a millisecond. */
void sim_board_pass_ms(int ms);

#endif
