#include "core/parallel.h"

#include "core/mem_limit.h"
#include "core/progress.h"

#include <omp.h>

#define ENOUGH_S 0.05 /* between two looks at progress and cancelling */

void weft_parallel_set_threads(int n)
{
    omp_set_num_threads(n > 0 ? n : omp_get_num_procs());
}

static void run_bands(int first, int last, int n_rows, weft_rows_fn *fn, void *context)
{
#pragma omp parallel for schedule(dynamic, 1)
    for (int band = first; band < last; band++) {
        const int begin = band * WEFT_BAND_ROWS;
        const int end = begin + WEFT_BAND_ROWS < n_rows ? begin + WEFT_BAND_ROWS : n_rows;
        fn(context, band, begin, end);
        weft_mem_trim();
    }
}

void weft_parallel_rows(int n_rows, weft_rows_fn *fn, void *context)
{
    run_bands(0, weft_parallel_n_bands(n_rows), n_rows, fn, context);
}

weft_err weft_parallel_rows_progress(int n_rows, weft_rows_fn *fn, void *context, const char *what,
                                     weft_error *err)
{
    const int n_bands = weft_parallel_n_bands(n_rows);
    int step = 2 * omp_get_max_threads();
    weft_progress progress;
    weft_err status = WEFT_OK;
    weft_progress_begin(&progress, what, "rows", n_rows);
    for (int band = 0, last; band < n_bands && status == WEFT_OK; band = last) {
        const double began_s = weft_clock_s();
        last = step < n_bands - band ? band + step : n_bands;
        run_bands(band, last, n_rows, fn, context);
        /* threads wait for each other between the steps: not more often than the eye and ^C ask for */
        step *= weft_clock_s() - began_s < ENOUGH_S && step < n_bands ? 2 : 1;
        const int rows_before = band * WEFT_BAND_ROWS;
        const int rows_after = last * WEFT_BAND_ROWS < n_rows ? last * WEFT_BAND_ROWS : n_rows;
        status = weft_progress_step(&progress, rows_after - rows_before, err);
    }
    weft_progress_end(&progress);
    return status;
}
