/** Photographs of a chessboard, wherever they come from, as 8-bit grey for the corner finder. */
#ifndef WEFT_HOST_CLI_BOARD_PICTURE_H
#define WEFT_HOST_CLI_BOARD_PICTURE_H

#include "core/error.h"

#include <stdint.h>

typedef struct weft_board_picture {
    int width, height;
    uint8_t *grey; /* [height][width] */
} weft_board_picture;

/**
 * Reads a captured set (its frame with all lights on, else the mean of its lights), a camera raw, or a PNG,
 * TIFF or EXR picture.  Free with weft_board_picture_fini().
 */
weft_err weft_board_picture_load(const char *path, weft_board_picture *picture, weft_error *err);
void weft_board_picture_fini(weft_board_picture *picture);

#endif
