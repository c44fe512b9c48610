/** A piece of the virtual scanner's cloth as maps, with the thread counts that its maker gave it. */
#ifndef WEFT_TESTS_HOST_CLOTH_PIECE_H
#define WEFT_TESTS_HOST_CLOTH_PIECE_H

#include "core/image.h"

typedef struct cloth_piece {
    weft_image normal, albedo; /* row 0 at the top, y up */
    weft_image count[2]; /* across warp, across weft: the thread count at every pixel, growing right, down */
    double mm_per_px, threads_per_mm[2]; /* the second by the weave's pitch */
    int draft;                           /* the weave repeats after so many threads both ways */
} cloth_piece;

/** The middle w x h pixels of a fabric by name, as it lies on the table. */
void cloth_piece_init(cloth_piece *piece, const char *weave, int w, int h, double mm_per_px);
void cloth_piece_fini(cloth_piece *piece);

#endif
