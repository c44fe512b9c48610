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
    bool stalled; /* the line takes no bytes */
    size_t sent;
    uint8_t wire[4096]; /* what was sent */
} sim_board;

extern sim_board sim;

/** A reset: variables of the firmware as after power-on, the board dark, time 0. */
void sim_board_start(void);

/** One turn of the firmware's loop. */
void sim_board_turn(void);

/** Time passes, with one turn of the loop a millisecond. */
void sim_board_pass_ms(int ms);

#endif
