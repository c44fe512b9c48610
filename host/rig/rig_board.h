/**
 * The rig's light controller as its control socket handles it: plugged in and out, broken, badly wired.
 *
 * The serial line appears as a link in a folder that is laid out like /dev: DIR/dev/ttyACM0, and after each
 * time that it was plugged in again ttyACM1, ttyACM2, ...
 */
#ifndef WEFT_HOST_RIG_RIG_BOARD_H
#define WEFT_HOST_RIG_RIG_BOARD_H

#include "host/rig/controller_sim.h"

#include <jansson.h>

typedef struct weft_rig_board {
    weft_controller_sim *sim;
    char pty[128]; /* empty: unplugged */
    char *dev;     /* DIR/dev */
    char *link;    /* DIR/dev/ttyACM0; NULL: unplugged */
    int n_plugged;
} weft_rig_board;

/** Takes the simulator, whose pty is board->pty, and makes the link. */
weft_err weft_rig_board_begin(weft_rig_board *board, weft_controller_sim *sim, const char *dir,
                              weft_error *err);
/** Removes link and folder; the simulator stays. */
void weft_rig_board_end(weft_rig_board *board);

/**
 * Obeys what follows "board" (docs/virtual-scanner.md): "hang", "unplug", "unplug power", "plug",
 * "lamp 3 open", "line both drop 0.01 seed 7", ...
 *
 * @param moved  set when board->pty has changed
 * @return the reply
 */
json_t *weft_rig_board_obey(weft_rig_board *board, const char *words, bool *moved);

#endif
