/* avrdude as a child: its progress, its end, and what its complaints mean. */
#include "host/light/flash.h"

#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "host/light/port_owner.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

/* avrdude gives a silent board 5 s and tries again, in the middle of writing for every byte that is left. */
#define SILENCE_S  20.0
#define STANDING_S 6.0

enum { SAID_BYTES = 8192, PARTS = 50 }; /* avrdude draws a bar of 50 signs */

typedef struct avrdude {
    const char *port;
    const weft_flash_image *image;
    pid_t pid;
    int out; /* its stdout and stderr */
    int status;
    bool stopped, cancelled;
    bool baud_is_given;    /* by the user: no other was tried */
    char said[SAID_BYTES]; /* all that it said, NUL behind it; the rest is dropped */
    size_t n_said, line_at;
    weft_progress progress;
    double heard_s; /* when it last got on */
    bool in_bar, has_written;
} avrdude;

/* -- the child ------------------------------------------------------------------------------------------ */

/* Its own process group: Ctrl-C comes to us alone, and we end it when that is safe to say. */
static void become_avrdude(const avrdude *a, const char *program, int out, int reservation, int baud)
{
    char rate[16], memory[PATH_MAX + 16];
    snprintf(rate, sizeof rate, "%d", baud);
    snprintf(memory, sizeof memory, "flash:w:%s:i", a->image->path);
    const char *const words[] = {program, "-p", "m328p",      "-c", "arduino", "-P",   a->port, "-b",
                                 rate,    "-x", "attempts=2", "-D", "-U",      memory, NULL};
    setpgid(0, 0);
    dup2(out, STDOUT_FILENO);
    dup2(out, STDERR_FILENO);
    fcntl(reservation, F_SETFD, 0); /* when we are killed the port stays taken until it has ended */
    (void)signal(SIGPIPE, SIG_IGN); /* and it does end what it has begun, with nobody to tell */
    execv(program, (char *const *)(void *)words);
    _exit(127);
}

static weft_err begin(avrdude *a, int reservation, int baud, weft_error *err)
{
    char program[PATH_MAX];
    int ends[2];
    WEFT_TRY(weft_flash_find_avrdude(program, err));
    if (pipe2(ends, O_CLOEXEC) != 0)
        return weft_fail_errno(err, WEFT_ERR_IO, "no pipe for avrdude");
    a->pid = fork();
    if (a->pid == 0)
        become_avrdude(a, program, ends[1], reservation, baud);
    close(ends[1]);
    a->out = ends[0];
    if (a->pid < 0) {
        close(ends[0]);
        return weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be started", program);
    }
    return WEFT_OK;
}

/* -- what it says --------------------------------------------------------------------------------------- */

static void end_line(avrdude *a)
{
    const char *const line = a->said + a->line_at;
    if (*line && !a->in_bar)
        weft_explain("%s", line);
    a->line_at = a->n_said;
}

/* "Writing | ####" as it grows, a sign at a time. */
static void follow_bar(avrdude *a, char c)
{
    const char *const line = a->said + a->line_at;
    if (c == '#')
        a->heard_s = weft_clock_s();
    if (c == '#' && a->in_bar)
        (void)weft_progress_step(&a->progress, a->image->bytes / PARTS, NULL);
    if (c != '|')
        return;
    const bool writing = strncmp(line, "Writing", 7) == 0, reading = strncmp(line, "Reading", 7) == 0;
    if (a->in_bar)
        weft_progress_end(&a->progress);
    a->in_bar = !a->in_bar && (writing || (reading && a->has_written));
    a->has_written |= writing;
    if (a->in_bar)
        weft_progress_begin(&a->progress, writing ? "writing the firmware" : "verifying it", "bytes",
                            PARTS * (long)(a->image->bytes / PARTS));
}

static void hear(avrdude *a, const char *bytes, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        if (a->n_said + 2 > SAID_BYTES)
            continue; /* enough to know what is wrong */
        if (bytes[i] == '\n' || bytes[i] == '\r') {
            end_line(a);
            a->said[a->n_said++] = '\n';
            a->line_at = a->n_said;
            a->in_bar = false;
        } else {
            a->said[a->n_said++] = bytes[i];
            follow_bar(a, bytes[i]);
        }
        a->said[a->n_said] = '\0';
    }
}

static void listen_to(avrdude *a)
{
    a->heard_s = weft_clock_s();
    for (;;) {
        char bytes[512];
        struct pollfd p = {.fd = a->out, .events = POLLIN};
        const int ready = poll(&p, 1, 100);
        const ssize_t n = ready > 0 ? read(a->out, bytes, sizeof bytes) : -1;
        if (n > 0) {
            hear(a, bytes, (size_t)n);
            if (!a->has_written)
                a->heard_s = weft_clock_s();
        }
        if (ready > 0 && n == 0)
            return;
        const bool cancel = weft_cancelled();
        const double still_s = weft_clock_s() - a->heard_s;
        if (!a->stopped && (cancel || still_s > (a->has_written ? STANDING_S : SILENCE_S))) {
            a->cancelled = cancel;
            a->stopped = true;
            kill(a->pid, SIGTERM);
        }
    }
}

static void finish(avrdude *a)
{
    end_line(a);
    weft_progress_end(&a->progress);
    close(a->out);
    while (waitpid(a->pid, &a->status, 0) < 0 && errno == EINTR)
        ;
}

/* -- what that means ------------------------------------------------------------------------------------ */

static bool said(const avrdude *a, const char *words)
{
    return strcasestr(a->said, words) != NULL;
}

#define HALF_WRITTEN                                                                                         \
    "the board now holds part of a firmware and keeps its lights dark; run \"weft flash\" again"

static weft_err wrong_processor(const avrdude *a, weft_error *err)
{
    const char *const at = strcasestr(a->said, "device signature = ");
    char signature[48] = "another";
    if (at)
        snprintf(signature, sizeof signature, "%.*s", (int)strcspn(at + 19, "\n"), at + 19);
    return weft_fail(
        err, WEFT_ERR_MISMATCH,
        "%s: this board's processor is no ATmega328P (signature %s); nothing was written; choose the "
        "light controller with --port",
        a->port, signature);
}

static weft_err last_words(const avrdude *a, weft_error *err)
{
    const char *end = a->said + a->n_said, *at;
    do { /* the last line that is a complaint */
        while (end > a->said && (end[-1] == '\n' || end[-1] == ' '))
            end--;
        for (at = end; at > a->said && at[-1] != '\n';)
            at--;
        if (at == a->said || memmem(at, (size_t)(end - at), "rror", 4))
            break;
        end = at;
    } while (true);
    return weft_fail(err, WEFT_ERR_DEVICE, "%s: avrdude failed%s: %.*s", a->port,
                     a->has_written ? " (" HALF_WRITTEN ")" : "", (int)(end - at < 200 ? end - at : 200), at);
}

static weft_err why_failed(const avrdude *a, weft_error *err)
{
    if (a->cancelled)
        return weft_fail(err, WEFT_ERR_CANCELLED, "cancelled; %s",
                         a->has_written ? HALF_WRITTEN : "the board is as it was");
    if (WIFEXITED(a->status) && WEXITSTATUS(a->status) == 127)
        return weft_fail(err, WEFT_ERR_MISSING, "avrdude cannot be started; sudo apt install avrdude");
    if (said(a, "expected signature"))
        return wrong_processor(a, err);
    if (said(a, "verification") && (said(a, "mismatch") || said(a, "verification error")))
        return weft_fail(
            err, WEFT_ERR_DEVICE,
            "%s: the board does not hold what was written; run \"weft flash\" again; when it fails "
            "again the chip's memory is worn out, take another board",
            a->port);
    if (said(a, "can't open") || said(a, "cannot open") || said(a, "unable to open port"))
        return weft_fail(
            err, WEFT_ERR_DEVICE,
            "%s: avrdude cannot open the port; is the board plugged in, and are you in its group "
            "(sudo usermod -aG dialout $USER)?",
            a->port);
    if (a->stopped || said(a, "not in sync") || said(a, "not responding") || said(a, "not respond"))
        return a->has_written
                   ? weft_fail(err, WEFT_ERR_TIMEOUT,
                               "%s: the board fell silent while it was written; check its "
                               "cable and supply; " HALF_WRITTEN,
                               a->port)
                   : weft_fail(
                         err, WEFT_ERR_TIMEOUT,
                         "%s: no bootloader answers; is this the light controller's port%s?  A board without "
                         "a working bootloader needs one first (Arduino IDE: Tools, Burn Bootloader)",
                         a->port, a->baud_is_given ? ", and --baud its rate" : "");
    return last_words(a, err);
}

/* -- the whole ------------------------------------------------------------------------------------------ */

static weft_err write_at(const char *port, const weft_flash_image *image, int baud, bool baud_is_given,
                         int reservation, bool *silent, weft_error *err)
{
    avrdude *const a = weft_alloc(1, sizeof *a, err);
    if (!a)
        return WEFT_ERR_NOMEM;
    a->port = port;
    a->image = image;
    a->baud_is_given = baud_is_given;
    weft_err status = begin(a, reservation, baud, err);
    if (status == WEFT_OK) {
        listen_to(a);
        finish(a);
        if (!WIFEXITED(a->status) || WEXITSTATUS(a->status) != 0)
            status = why_failed(a, err);
        else if (!said(a, "verified"))
            status = last_words(a, err);
    }
    *silent = status == WEFT_ERR_TIMEOUT && !a->has_written;
    weft_free(a);
    return status;
}

weft_err weft_flash_write(const char *port, const weft_flash_image *image, int baud, int *used,
                          weft_error *err)
{
    static const int usual[] = {115200, 57600};
    int reservation;
    bool silent = true;
    weft_err status = WEFT_OK;
    WEFT_TRY(weft_port_reserve(port, &reservation, err));
    for (size_t i = 0; i < (baud ? 1 : sizeof usual / sizeof usual[0]) && silent; i++) {
        weft_error why = {0};
        *used = baud ? baud : usual[i];
        weft_explain("%s: asking for the bootloader at %d baud", port, *used);
        status = write_at(port, image, *used, baud != 0, reservation, &silent, &why);
        if (err && status != WEFT_OK)
            *err = why;
    }
    if (reservation >= 0)
        close(reservation);
    return status;
}
