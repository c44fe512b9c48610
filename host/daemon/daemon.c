#include "host/daemon/daemon.h"

#include "core/file.h"
#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"
#include "core/shipped.h"
#include "host/client/daemon_socket.h"
#include "host/daemon/http_server.h"
#include "host/daemon/listen.h"
#include "host/daemon/token.h"
#include "host/library/catalogue.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

enum { TURN_MS = 250, PEM_BYTES = 1 << 20 };
#define STOP_S 15.0

typedef struct daemon_state {
    const weft_daemon_options *options;
    char program[PATH_MAX], socket[108], rig[PATH_MAX];
    int lock, signals;
    bool own_socket, stopping;
    char *token, *certificate, *key;
    weft_loop *loop;
    weft_library_db *db;
    weft_events *events;
    weft_live live;
    weft_queue *queue;
    weft_http_server *server;
} daemon_state;

/* `weft` lies beside `weftd`. */
static weft_err find_program(daemon_state *d, weft_error *err)
{
    static const char *const places[] = {".", NULL};
    WEFT_TRY(weft_shipped_find("weft", places, d->program, err));
    if (access(d->program, X_OK) != 0)
        return weft_fail_errno(err, WEFT_ERR_MISSING, "%s: the program that does the work cannot be run",
                               d->program);
    return WEFT_OK;
}

/* One daemon per library: its queue has one owner. */
static weft_err take_lock(daemon_state *d, weft_error *err)
{
    char *const path = weft_asprintf(err, "%s/" WEFT_LIBRARY_HIDDEN "/lock", d->db->root);
    if (!path)
        return WEFT_ERR_NOMEM;
    weft_err status = WEFT_OK;
    d->lock = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0660);
    if (d->lock < 0)
        status =
            weft_fail_errno(err, WEFT_ERR_IO, "%s: cannot be opened; let this user write the library", path);
    else if (flock(d->lock, LOCK_EX | LOCK_NB) != 0)
        status = weft_fail(err, WEFT_ERR_EXISTS, "%s: another weftd serves this library", d->db->root);
    weft_free(path);
    return status;
}

/* Counts the starts. */
static weft_err next_epoch(daemon_state *d, int64_t *epoch, weft_error *err)
{
    WEFT_TRY(weft_library_db_exec(
        d->db, "INSERT INTO meta VALUES ('epoch', 1) ON CONFLICT (key) DO UPDATE SET value = value + 1",
        err));
    return weft_library_db_number(d->db, epoch, err, "SELECT value FROM meta WHERE key = 'epoch'");
}

/* What came, changed or went while no daemon ran; what has not changed is only looked for. */
static weft_err look_through_library(daemon_state *d, weft_error *err)
{
    weft_progress progress = {0};
    weft_catalogue_report report;
    WEFT_TRY(weft_catalogue_reindex(d->db, false, &progress, &report, err));
    weft_note("%d items in the library, %d new or changed, %d gone", report.n_items, report.n_read,
              report.n_removed);
    return WEFT_OK;
}

static weft_err load_secrets(daemon_state *d, weft_error *err)
{
    const weft_daemon_options *const o = d->options;
    size_t n;
    if ((o->certificate != NULL) != (o->key != NULL))
        return weft_fail(err, WEFT_ERR_USAGE, "--tls-cert and --tls-key go together");
    char *const path = o->token ? weft_strdup(o->token, err)
                                : weft_asprintf(err, "%s/" WEFT_LIBRARY_HIDDEN "/token", d->db->root);
    if (!path)
        return WEFT_ERR_NOMEM;
    weft_err status = weft_token_load(path, &d->token, err);
    if (status == WEFT_OK && o->listen)
        weft_note("clients over TCP show the token in %s", path);
    weft_free(path);
    if (status == WEFT_OK && o->certificate)
        status = weft_file_read(o->certificate, PEM_BYTES, &d->certificate, &n, err);
    if (status == WEFT_OK && o->key)
        status = weft_file_read(o->key, PEM_BYTES, &d->key, &n, err);
    return status;
}

/* Where the signal handler writes: an eventfd.  A handler, not a signalfd: libraries have threads of their
 * own that were there before any signal could be blocked, and one of them would take it. */
static int signal_fd = -1;

static void note_signal(int number)
{
    const int saved = errno;
    const uint64_t one = 1;
    (void)number;
    (void)!write(signal_fd, &one, sizeof one);
    errno = saved;
}

static void on_signal(void *context, uint32_t events)
{
    (void)events;
    ((daemon_state *)context)->stopping = true;
}

/* Ctrl-C and SIGTERM end the daemon in good order. */
static weft_err take_signals(daemon_state *d, weft_error *err)
{
    struct sigaction action = {.sa_handler = note_signal, .sa_flags = SA_RESTART};
    d->signals = signal_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (d->signals < 0)
        return weft_fail_errno(err, WEFT_ERR_IO, "no descriptor for signals");
    sigemptyset(&action.sa_mask);
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGINT, &action, NULL);
    signal(SIGPIPE, SIG_IGN);
    signal(SIGHUP, SIG_IGN);
    return weft_loop_watch(d->loop, d->signals, EPOLLIN, on_signal, d, err);
}

/* ---- sockets ---- */

static weft_err open_own_socket(daemon_state *d, weft_error *err)
{
    int fd = -1;
    if (d->options->socket)
        snprintf(d->socket, sizeof d->socket, "%s", d->options->socket);
    else
        weft_daemon_default_socket(d->socket);
    if (!d->options->socket) {
        char *const folder = weft_path_folder(d->socket, err);
        if (!folder)
            return WEFT_ERR_NOMEM;
        if (mkdir(folder, 0750) != 0 && errno != EEXIST)
            weft_explain("%s: %s", folder, strerror(errno)); /* the socket will say it */
        weft_free(folder);
    }
    WEFT_TRY(
        weft_listen_unix(d->options->socket ? d->options->socket : d->socket, d->options->group, &fd, err));
    d->own_socket = true;
    return weft_http_server_listen(d->server, fd, false, err);
}

static weft_err open_sockets(daemon_state *d, weft_error *err)
{
    weft_listen_given given[3];
    int n = 0, fd = -1;
    bool has_unix = false;
    char name[80];
    WEFT_TRY(weft_listen_from_systemd(given, 3, &n, err));
    for (int i = 0; i < n; i++) {
        has_unix |= !given[i].tcp;
        WEFT_TRY(weft_http_server_listen(d->server, given[i].fd, given[i].tcp, err));
    }
    if (!has_unix)
        WEFT_TRY(open_own_socket(d, err));
    if (!d->options->listen)
        return WEFT_OK;
    WEFT_TRY(weft_listen_tcp(d->options->listen, &fd, err));
    weft_listen_name(fd, name);
    if (!weft_listen_is_loopback(fd) && !d->certificate)
        weft_warn(
            "--listen %s: others on the network can read token and pictures; give --tls-cert and --tls-key",
            name);
    WEFT_TRY(weft_http_server_listen(d->server, fd, true, err));
    weft_note("listening on %s://%s", d->certificate ? "https" : "http", name);
    return WEFT_OK;
}

/* ---- life ---- */

static weft_err set_up(daemon_state *d, weft_error *err)
{
    int64_t epoch = 0;
    WEFT_TRY(find_program(d, err));
    WEFT_TRY(weft_library_db_open(d->options->library, &d->db, err));
    WEFT_TRY(take_lock(d, err));
    WEFT_TRY(next_epoch(d, &epoch, err));
    WEFT_TRY(look_through_library(d, err));
    WEFT_TRY(load_secrets(d, err));
    WEFT_TRY(weft_loop_create(&d->loop, err));
    WEFT_TRY(take_signals(d, err));
    WEFT_TRY(weft_events_create(epoch, &d->events, err));
    if (d->options->rig && !realpath(d->options->rig, d->rig))
        return weft_fail_errno(err, WEFT_ERR_MISSING,
                               "--rig %s: start the virtual scanner first (weft rig --dir %s)",
                               d->options->rig, d->options->rig);
    const weft_queue_options queue = {.program = d->program, .cpu_jobs = d->options->cpu_jobs};
    WEFT_TRY(weft_queue_create(&queue, d->loop, d->db, d->events, &d->live, &d->queue, err));
    WEFT_TRY(weft_queue_recover(d->queue, err));
    const weft_http_house house = {.loop = d->loop,
                                   .db = d->db,
                                   .queue = d->queue,
                                   .events = d->events,
                                   .live = &d->live,
                                   .rig = d->rig[0] ? d->rig : NULL,
                                   .port = d->options->port,
                                   .camera = d->options->camera,
                                   .token = d->token,
                                   .hosts = d->options->hosts.values,
                                   .tls_certificate = d->certificate,
                                   .tls_key = d->key};
    WEFT_TRY(weft_http_server_create(&house, &d->server, err));
    return open_sockets(d, err);
}

static void turn(daemon_state *d)
{
    weft_loop_turn(d->loop, weft_http_server_timeout(d->server, TURN_MS));
    weft_queue_tick(d->queue);
    weft_http_server_tick(d->server);
}

static void serve(daemon_state *d)
{
    uint64_t watchdog_us = 0;
    const bool watched = sd_watchdog_enabled(0, &watchdog_us) > 0;
    double barked_s = weft_clock_s();
    while (!d->stopping) {
        turn(d);
        if (watched && weft_clock_s() - barked_s > 0.3e-6 * (double)watchdog_us) {
            sd_notify(0, "WATCHDOG=1");
            barked_s = weft_clock_s();
        }
    }
}

/* Lights off first: the jobs are asked to end before anything else is taken down. */
static void stop(daemon_state *d)
{
    const double begin_s = weft_clock_s();
    sd_notify(0, "STOPPING=1");
    weft_loop_forget(d->loop, d->signals); /* it stays readable */
    weft_queue_stop(d->queue);
    while (weft_queue_running(d->queue) > 0 && weft_clock_s() - begin_s < STOP_S)
        turn(d);
}

static void take_down(daemon_state *d)
{
    weft_http_server_destroy(d->server);
    weft_queue_destroy(d->queue);
    weft_live_fini(&d->live);
    weft_events_destroy(d->events);
    weft_library_db_close(d->db);
    if (d->own_socket)
        (void)unlink(d->options->socket ? d->options->socket : d->socket);
    if (d->signals >= 0) {
        signal(SIGTERM, SIG_DFL);
        signal(SIGINT, SIG_DFL);
        close(d->signals);
    }
    weft_loop_destroy(d->loop);
    if (d->lock >= 0)
        close(d->lock);
    weft_free(d->token);
    weft_free(d->certificate);
    weft_free(d->key);
}

weft_err weft_daemon_run(const weft_daemon_options *options, weft_error *err)
{
    daemon_state *const d = weft_alloc(1, sizeof *d, err);
    if (!d)
        return WEFT_ERR_NOMEM;
    d->options = options;
    d->lock = d->signals = -1;
    const weft_err status = set_up(d, err);
    if (status == WEFT_OK) {
        weft_note("weftd serves %s%s%s", d->db->root, d->own_socket ? " on " : "",
                  d->own_socket ? (options->socket ? options->socket : d->socket) : "");
        sd_notifyf(0, "READY=1\nSTATUS=Serving %s\nMAINPID=%d", d->db->root, (int)getpid());
        serve(d);
        stop(d);
    }
    take_down(d);
    weft_free(d);
    return status;
}
