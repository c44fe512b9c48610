/**
 * The repeat of a fabric in its maps: threads per centimetre, a cut of whole repeats, and a closed seam.
 *
 * Averaged along its threads every thread of a weave looks like the next, so the slope across them has the
 * frequency of the threads as the strongest peak of its spectrum near that axis (weighted to heights); both
 * peaks give the two spacings and the skew between warp and weft, and demodulation by them how the threads
 * lie (weave_lie.h).  After how many threads the weave repeats is read off the autocorrelation along the two
 * directions.
 */
#ifndef WEFT_SHADING_BAKE_WEAVE_H
#define WEFT_SHADING_BAKE_WEAVE_H

#include "shading/bake/weave_lie.h"

/** What was found. */
typedef struct weft_weave {
    double step_px[2][2]; /* from a warp thread to the next (along the rows), and from a weft thread to the
                             next (down): vectors right and down, in pixels */
    double threads_per_px[2]; /* across the warp, across the weft */
    int threads[2];           /* after how many the weave repeats */
    double likeness[2];       /* correlation of the picture with itself after that, 0..1 */
    double skew_deg;          /* of the weft against the perpendicular of the warp */
    double bow[2]; /* largest distance of a warp thread, of a weft thread, from its chord, over the chord */
    weft_thread_lie lie[2]; /* how warp and weft lie off that lattice; empty where they cannot be followed */
} weft_weave;

void weft_weave_fini(weft_weave *weave);

/** Where in the picture the cloth lies that would be at `even` if all threads lay on the lattice: pixels,
 * right and down. */
void weft_weave_place(const weft_weave *weave, const double even[2], double at[2]);

/**
 * Finds the repeat.  Fills `weave`, to be freed by weft_weave_fini().
 * @param normal  3 planes
 * @param albedo  3 planes, or planes 0
 * @return WEFT_ERR_NODATA when there is no repeat to be seen (felt, leather, a map too small)
 */
weft_err weft_weave_find(const weft_image *normal, const weft_image *albedo, weft_weave *weave,
                         weft_error *err);

/** How a seam came out. */
typedef struct weft_seam {
    double across[2];  /* mean change of albedo and slopes over the seams: right to left, bottom to top */
    double inside[2];  /* the largest mean change between two neighbouring columns or rows inside */
    double repetition; /* rms of the repeats' mean albedo over the mean: what the eye finds in every tile */
    int threads[2];    /* of the tile */
} weft_seam;

/**
 * Cuts the largest rectangle of whole repeats, straightened to the threads (skew, bow and waves: every thread
 * of the tile lies on the even lattice), and closes it: in the overlap of
 * a repeat the path of least difference of albedo and slopes together is cut (dynamic programming; Efros and
 * Freeman 2001) and blended over some pixels.
 *
 * @param planes  the maps to cut alike, `n` of them; plane 0..2 of the first are the normals, the second
 * albedo
 * @param tiles   [n], initialised here: all of one size, each repeats
 */
weft_err weft_weave_cut(const weft_image *const planes[], int n, const weft_weave *weave, weft_image tiles[],
                        weft_seam *seam, weft_error *err);

#endif
