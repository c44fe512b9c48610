#include "core/progress.h"

#include "core/log.h"
#include "core/report_channel.h"

#include <signal.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>

static volatile sig_atomic_t cancel_requested;
static bool hiding;

double weft_clock_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void on_signal(int number)
{
    cancel_requested = 1;
    if (number == SIGINT)
        signal(SIGINT, SIG_DFL); /* the second Ctrl-C is not asked whether it may */
}

void weft_cancel_on_signals(void)
{
    struct sigaction action = {.sa_handler = on_signal};
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
}

bool weft_cancelled(void)
{
    return cancel_requested != 0;
}

void weft_cancel_request(bool yes)
{
    cancel_requested = yes;
}

void weft_progress_hide(bool on)
{
    hiding = on;
}

static void report(const weft_progress *p)
{
    weft_report_send(json_pack("{s:{s:s, s:s, s:I, s:I}}", "progress", "what", p->what, "unit", p->unit,
                               "done", (json_int_t)p->done, "total", (json_int_t)p->total));
}

void weft_progress_begin(weft_progress *p, const char *what, const char *unit, long total)
{
    const double now = weft_clock_s();
    *p = (weft_progress){.what = what,
                         .unit = unit,
                         .total = total,
                         .started_s = now,
                         .shown_s = now,
                         .hidden = hiding,
                         .terminal = isatty(STDERR_FILENO) != 0};
    if (weft_report_active() && !hiding)
        report(p);
}

static void show(weft_progress *p, double now)
{
    const double elapsed = now - p->started_s;
    const double rate = elapsed > 0 ? (double)p->done / elapsed : 0;
    const char *const end = p->terminal ? "\033[K" : "\n";
    fprintf(stderr, "%s%s ", p->terminal ? "\r" : "", p->what);
    if (p->total > 0) {
        const double share = (double)p->done / (double)p->total;
        if (p->terminal) {
            char bar[25] = "........................";
            for (int i = 0; i < (int)(share * 24) && i < 24; i++)
                bar[i] = '#';
            fprintf(stderr, "[%s] ", bar);
        }
        fprintf(stderr, "%3.0f %%, %ld/%ld %s", 100 * share, p->done, p->total, p->unit);
        if (rate > 0)
            fprintf(stderr, ", %.3g/s, %.0f s left", rate, (double)(p->total - p->done) / rate);
    } else {
        fprintf(stderr, "%ld %s, %.3g/s", p->done, p->unit, rate);
    }
    fputs(end, stderr);
    fflush(stderr);
    p->shown = true;
    p->shown_s = now;
}

weft_err weft_progress_step(weft_progress *p, long n, weft_error *err)
{
    p->done += n;
    if (cancel_requested)
        return weft_fail(err, WEFT_ERR_CANCELLED, "%s: cancelled after %ld of %ld %s", p->what, p->done,
                         p->total, p->unit);
    if (p->hidden)
        return WEFT_OK;
    const double now = weft_clock_s();
    if (weft_report_active()) { /* the listener shows it */
        if (now - p->shown_s >= 0.1 || p->done == p->total) {
            report(p);
            p->shown_s = now;
        }
        return WEFT_OK;
    }
    if (weft_log_get_level() > WEFT_LOG_QUIET && now - p->shown_s >= (p->terminal ? 0.1 : 3.0))
        show(p, now);
    return WEFT_OK;
}

void weft_progress_end(weft_progress *p)
{
    if (p->shown && p->terminal)
        fputs("\r\033[K", stderr);
    *p = (weft_progress){0};
}
