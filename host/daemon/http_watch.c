/*
 * Watchers.  Each takes its next piece when the client has taken the last one (the reader callback); with
 * nothing to give the connection is suspended and weft_watchers_tick() wakes it.  A client that has something
 * to take and does not take it for ten seconds, or that is overrun by the ring of events, is hung up on: it
 * comes back with Last-Event-ID when it can.
 */
#include "host/daemon/http_watch.h"

#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>

#define HEARTBEAT_S 15.0

enum { BLOCK_BYTES = 32768 };

typedef struct weft_watcher {
    struct weft_watcher *next, **link;
    weft_http_server *server;
    struct MHD_Connection *mhd;
    int fd;
    bool suspended, dropped;
    double asked_s; /* when the client last took something */
    /* of events */
    weft_watch_options events;
    size_t sent; /* of the piece that is under way */
    double spoke_s;
    /* of pictures */
    bool pictures;
    double min_period_s, shown_s;
    weft_picture *picture; /* under way */
    uint64_t seen;
    char head[128];
    size_t n_head;
} weft_watcher;

/* ---- events ---- */

/* Copies on from text[0..n); true when that is all of it. */
static bool give(weft_watcher *w, const char *text, size_t n, char *buffer, size_t room, size_t *used)
{
    const size_t left = n - w->sent, now = left < room - *used ? left : room - *used;
    memcpy(buffer + *used, text + w->sent, now);
    *used += now;
    w->sent += now;
    if (w->sent < n)
        return false;
    w->sent = 0;
    return true;
}

static size_t give_events(weft_watcher *w, char *buffer, size_t room)
{
    const weft_events *const events = w->server->house.events;
    size_t used = 0;
    if (w->events.first) {
        if (!give(w, w->events.first, strlen(w->events.first), buffer, room, &used))
            return used;
        weft_free(w->events.first);
        w->events.first = NULL;
    }
    while (used < room && w->events.next < weft_events_end(events)) {
        const weft_event *const event = weft_events_get(events, w->events.next);
        if (!event) {
            w->dropped = true; /* overrun */
            break;
        }
        if (w->events.job && event->job != w->events.job && w->sent == 0) {
            w->events.next++;
            continue;
        }
        if (!give(w, event->text, event->n, buffer, room, &used))
            break;
        w->events.next++;
    }
    return used;
}

/* Whether there is something for this watcher; passes over what is not for it. */
static bool has_events(weft_watcher *w)
{
    const weft_events *const events = w->server->house.events;
    if (w->events.first)
        return true;
    for (; w->events.next < weft_events_end(events); w->events.next++) {
        const weft_event *const event = weft_events_get(events, w->events.next);
        if (!event || w->sent > 0 || !w->events.job || event->job == w->events.job)
            return true;
    }
    return false;
}

/* ---- pictures ---- */

static bool has_picture(const weft_watcher *w, double now_s)
{
    const weft_picture *const latest = w->server->house.live->latest;
    return w->picture || (latest && latest->number != w->seen && now_s - w->shown_s >= w->min_period_s);
}

static size_t give_picture(weft_watcher *w, char *buffer, size_t room, double now_s)
{
    size_t used = 0;
    if (!w->picture) {
        if (!has_picture(w, now_s))
            return 0;
        w->picture = weft_picture_hold(w->server->house.live->latest); /* older ones are passed over */
        w->seen = w->picture->number;
        w->shown_s = now_s;
        w->sent = 0;
        w->n_head = (size_t)snprintf(w->head, sizeof w->head,
                                     "--weft-frame\r\nContent-Type: image/jpeg\r\nContent-Length: %zu\r\n"
                                     "Weft-Picture: %" PRIu64 "\r\n\r\n",
                                     w->picture->n, w->picture->number);
    }
    static const char tail[] = "\r\n";
    const struct {
        const char *bytes;
        size_t n;
    } parts[] = {{w->head, w->n_head}, {(const char *)w->picture->bytes, w->picture->n}, {tail, 2}};
    size_t begin = 0;
    for (int i = 0; i < 3 && used < room; i++) {
        const size_t at = w->sent - begin;
        if (w->sent < begin + parts[i].n) {
            const size_t left = parts[i].n - at, now = left < room - used ? left : room - used;
            memcpy(buffer + used, parts[i].bytes + at, now);
            used += now;
            w->sent += now;
        }
        begin += parts[i].n;
    }
    if (w->sent == w->n_head + w->picture->n + 2) {
        weft_picture_release(w->picture);
        w->picture = NULL;
        w->sent = 0;
    }
    return used;
}

/* ---- the stream ---- */

static ssize_t on_read(void *context, uint64_t position, char *buffer, size_t room)
{
    weft_watcher *const w = context;
    const double now_s = weft_clock_s();
    (void)position;
    if (w->dropped)
        return MHD_CONTENT_READER_END_WITH_ERROR;
    w->asked_s = now_s;
    const size_t n = w->pictures ? give_picture(w, buffer, room, now_s) : give_events(w, buffer, room);
    if (n > 0) {
        w->spoke_s = now_s;
        return (ssize_t)n;
    }
    if (w->dropped)
        return MHD_CONTENT_READER_END_WITH_ERROR;
    MHD_suspend_connection(w->mhd);
    w->suspended = true;
    return 0;
}

static void on_free(void *context)
{
    weft_watcher *const w = context;
    *w->link = w->next;
    if (w->next)
        w->next->link = w->link;
    if (w->events.hold)
        weft_queue_hold(w->server->house.queue, w->events.job, false);
    weft_picture_release(w->picture);
    weft_free(w->events.first);
    weft_free(w);
}

static enum MHD_Result watch(weft_http_request *r, weft_watcher *w, const char *type)
{
    const double now_s = weft_clock_s();
    w->server = r->server;
    w->mhd = r->mhd;
    w->fd = r->connection->fd;
    w->asked_s = w->spoke_s = now_s;
    struct MHD_Response *const response =
        MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, BLOCK_BYTES, on_read, w, on_free);
    if (!response) {
        weft_free(w->events.first);
        weft_free(w);
        return MHD_NO;
    }
    w->link = &r->server->watchers;
    w->next = r->server->watchers;
    if (w->next)
        w->next->link = &w->next;
    r->server->watchers = w;
    if (w->events.hold)
        weft_queue_hold(r->server->house.queue, w->events.job, true);
    MHD_set_connection_option(r->mhd, MHD_CONNECTION_OPTION_TIMEOUT,
                              0U); /* weft_watchers_tick() looks after it */
    return weft_reply(r, 200, response, type);
}

enum MHD_Result weft_watch_events(weft_http_request *request, const weft_watch_options *options)
{
    weft_watcher *const w = weft_alloc(1, sizeof *w, NULL);
    if (!w) {
        weft_free(options->first);
        return MHD_NO;
    }
    w->events = *options;
    return watch(request, w, "text/event-stream");
}

enum MHD_Result weft_watch_pictures(weft_http_request *request, double max_hz)
{
    weft_watcher *const w = weft_alloc(1, sizeof *w, NULL);
    if (!w)
        return MHD_NO;
    w->pictures = true;
    w->min_period_s = 1 / max_hz;
    return watch(request, w, "multipart/x-mixed-replace; boundary=weft-frame");
}

static void wake(weft_watcher *w)
{
    if (!w->suspended)
        return;
    w->suspended = false;
    w->asked_s = weft_clock_s();
    MHD_resume_connection(w->mhd);
}

static void drop(weft_watcher *w, const char *why)
{
    weft_explain("a watcher is dropped: %s", why);
    w->dropped = true;
    (void)shutdown(w->fd, SHUT_RDWR);
    wake(w);
}

/* A suspended connection is not looked at by libmicrohttpd: that the client has gone must be found here. */
static bool has_gone(const weft_watcher *w)
{
    char byte;
    return recv(w->fd, &byte, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
}

void weft_watchers_tick(weft_http_server *server, double now_s)
{
    weft_watcher *next;
    for (weft_watcher *w = server->watchers; w; w = next) {
        next = w->next;
        if (w->dropped)
            continue;
        const bool ready = w->pictures ? has_picture(w, now_s) : has_events(w);
        if (w->suspended && has_gone(w)) {
            drop(w, "the client has gone");
        } else if (!w->pictures && !w->events.first &&
                   w->events.next < weft_events_begin(server->house.events)) {
            drop(w, "overrun by events");
        } else if (!w->suspended && now_s - w->asked_s > WEFT_HTTP_WATCHER_S) {
            drop(w, "it takes nothing");
        } else if (w->suspended && !w->pictures && !ready && now_s - w->spoke_s > HEARTBEAT_S) {
            w->events.first = weft_strdup(": still here\n\n", NULL);
            wake(w);
        } else if (w->suspended && ready) {
            wake(w);
        }
    }
}

void weft_watchers_end(weft_http_server *server)
{
    for (weft_watcher *w = server->watchers; w; w = w->next)
        drop(w, "weftd ends");
    for (int i = 0; i < server->n_listeners; i++)
        MHD_run(server->listeners[i].mhd);
}
