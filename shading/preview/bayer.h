/** Ordered dither (S-BLG-06). */
#ifndef WEFT_SHADING_PREVIEW_BAYER_H
#define WEFT_SHADING_PREVIEW_BAYER_H

/**
 * Bayer's 4 x 4 matrix over 16: each of 0/16 .. 15/16 once in any 4 x 4 window, far values side by side.
 *
 * @param phase  0..15 turns through all sixteen offsets of the matrix, so that a place sees every value once
 *               in sixteen frames; 0 is the matrix as printed (its 0.22 is 4/16)
 * Source: S-BLG-06, S-BLG-07.
 */
static inline double weft_bayer(int x, int y, int phase)
{
    static const unsigned char matrix[4][4] = {{0, 8, 2, 10}, {12, 4, 14, 6}, {3, 11, 1, 9}, {15, 7, 13, 5}};
    return matrix[(y + (phase >> 2)) & 3][(x + phase) & 3] / 16.0;
}

#endif
