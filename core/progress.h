/**
 * Progress of long work, and its cancellation.
 *
 * On a terminal a bar with rate and time left; piped, a line at most every few seconds; silent with -q.
 * When a program listens (core/report_channel.h) it gets the progress instead of the terminal.
 * A worker calls weft_progress_step() per unit and returns WEFT_ERR_CANCELLED when that says so.
 */
#ifndef WEFT_CORE_PROGRESS_H
#define WEFT_CORE_PROGRESS_H

#include "core/error.h"

#include <stdbool.h>

typedef struct weft_progress {
    const char *what; /* "solving", lives as long as the work */
    const char *unit; /* "rows" */
    long done, total;
    double started_s, shown_s; /* monotonic clock */
    bool terminal, shown;
    bool hidden; /* begun while weft_progress_hide() was on */
} weft_progress;

/** Begins; `total` is the number of units, 0 when unknown. */
void weft_progress_begin(weft_progress *p, const char *what, const char *unit, long total);

/** Says that `n` more units are done.  @return WEFT_OK, or WEFT_ERR_CANCELLED with its text in `err`.
 *  From one thread only: a parallel loop reports after each batch of rows. */
weft_err weft_progress_step(weft_progress *p, long n, weft_error *err);

/** Ends; leaves the terminal on a fresh line.  Harmless when never begun (all zero). */
void weft_progress_end(weft_progress *p);

/** While on, work that begins is not shown or reported, and still cancelled: steps of a longer work that
 * shows its own progress. */
void weft_progress_hide(bool on);

/** Installs the SIGINT/SIGTERM handler that makes weft_cancelled() true; a second SIGINT kills. */
void weft_cancel_on_signals(void);
bool weft_cancelled(void);
/** Asks for cancellation from inside (tests, the daemon); `false` takes it back. */
void weft_cancel_request(bool yes);

/** Seconds of the monotonic clock, for durations. */
double weft_clock_s(void);

#endif
