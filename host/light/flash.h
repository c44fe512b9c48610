/** Programming the light controller: avrdude, through the bootloader of the board. */
#ifndef WEFT_HOST_LIGHT_FLASH_H
#define WEFT_HOST_LIGHT_FLASH_H

#include "host/light/controller.h"
#include "host/light/flash_image.h"

#include <stdbool.h>

/** What a board is, and all that it keeps in its EEPROM. */
typedef struct weft_flash_board {
    weft_controller_info info;
    bool has_settings; /* false: firmware that knows none, or cannot read its own */
    char serial[9];
    int n_lights, max_on_ms;
    int trims[10];
} weft_flash_board;

/** Asks the board.  @return as weft_controller_open() */
weft_err weft_flash_board_read(const char *port, weft_flash_board *board, weft_error *err);

/** Which settings differ, as "serial WL-1 -> WL-2, trim-3 256 -> 200"; empty when none does.
 *  @return their number */
int weft_flash_board_compare(const weft_flash_board *before, const weft_flash_board *after, char text[256]);

/** Path of avrdude, looked for in $PATH.  @return WEFT_ERR_MISSING with the remedy */
weft_err weft_flash_find_avrdude(char path[PATH_MAX], weft_error *err);

/** Refuses a port that any other program has open or reserved, avrdude's own lock being none. */
weft_err weft_flash_check_free(const char *port, weft_error *err);

/**
 * Writes the image and has it verified.  The port is reserved for all that time, also against other programs
 * of Weft.  Nothing but the program is written: the EEPROM stays.
 *
 * @param baud  rate of the bootloader; 0: 115200 (Uno, new Nano), then 57600 (old Nano)
 * @param used  gets the rate that worked
 * @return WEFT_ERR_DEVICE (port in use or gone, verification failed), WEFT_ERR_MISMATCH (another processor),
 *         WEFT_ERR_TIMEOUT (no bootloader answers), WEFT_ERR_CANCELLED; each says what the board holds now
 *         and what to do
 */
weft_err weft_flash_write(const char *port, const weft_flash_image *image, int baud, int *used,
                          weft_error *err);

#endif
