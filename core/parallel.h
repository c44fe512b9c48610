/**
 * Loops over the rows of an image, spread over the cores.
 *
 * The work is cut into bands of rows in the same way whatever the number of threads, so a body whose
 * rows do not depend on each other gives the same bits with 1, 2 and 7 threads.  Sums are made per band
 * by the caller (weft_parallel_n_bands() partial sums) and added in band order.
 */
#ifndef WEFT_CORE_PARALLEL_H
#define WEFT_CORE_PARALLEL_H

#include "core/error.h"

/** Rows in a band: enough work to hide the cost of handing it out, small enough to share evenly. */
#define WEFT_BAND_ROWS 16

/** Does rows [row_begin, row_end) of band number `band`.  From any thread; must not allocate. */
typedef void weft_rows_fn(void *context, int band, int row_begin, int row_end);

/** Number of bands that weft_parallel_rows() makes of `n_rows`. */
static inline int weft_parallel_n_bands(int n_rows)
{
    return (n_rows + WEFT_BAND_ROWS - 1) / WEFT_BAND_ROWS;
}

/** Runs `fn` over all bands of [0, n_rows) and returns when all are done. */
void weft_parallel_rows(int n_rows, weft_rows_fn *fn, void *context);

/** As weft_parallel_rows(), showing progress and stopping when cancelled; both are looked at between bands,
 * about twenty times a second where bands are quick. */
weft_err weft_parallel_rows_progress(int n_rows, weft_rows_fn *fn, void *context, const char *what,
                                     weft_error *err);

/** Sets the number of threads; 0 goes back to one per core (or OMP_NUM_THREADS). */
void weft_parallel_set_threads(int n);

#endif
