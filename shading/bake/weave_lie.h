/**
 * How threads lie in a picture of cloth: where each is off the even lattice that its peak in the spectrum
 * says.
 *
 * A thread system of wave vector k has the slope field a(p) cos(2 pi (k . p + shift(p)) + c).  Taken down by
 * exp(-2 pi i k . p) and smoothed over some threads, the angle of what is left is the shift in threads:
 * demodulation, as interferograms are read (Takeda, Ina and Kobayashi 1982).  Bow, waves and stretch of the
 * cloth are in it.
 */
#ifndef WEFT_SHADING_BAKE_WEAVE_LIE_H
#define WEFT_SHADING_BAKE_WEAVE_LIE_H

#include "core/image.h"

/** One thread system. */
typedef struct weft_thread_lie {
    double cell_px; /* side of a cell: about a thread */
    weft_image
        shift; /* 1 plane, a value a cell, threads: the thread count at p is k . p + shift(p) + constant */
} weft_thread_lie;

/**
 * Reads the lie of one system and mends its wave vector: k becomes that of the plane through the thread count
 * (least squares over the picture), and `shift` what is left.
 *
 * @param slope  [h][w] across the threads
 * @param k      in: cycles a pixel, right and down, from the spectrum's peak; out: mended
 * @param lie    initialised here
 * @return WEFT_ERR_NOMEM; WEFT_ERR_NODATA when the threads cannot be followed (torn, or too blurred), with k
 *         unchanged
 */
weft_err weft_thread_lie_read(const float *slope, int w, int h, double k[2], weft_thread_lie *lie,
                              weft_error *err);

void weft_thread_lie_fini(weft_thread_lie *lie);

/** The shift in threads at a pixel; beyond the outer cells' middles, theirs.  0 of an empty lie. */
double weft_thread_lie_at(const weft_thread_lie *lie, double x, double y);

/** Bow: how far at most a thread is from the chord between its ends, in thread spacings (ASTM D3882 gives it
 * as a share of the chord).  @param along  the direction the threads run: 0 along the rows, 1 down */
double weft_thread_lie_bow(const weft_thread_lie *lie, int along);

#endif
