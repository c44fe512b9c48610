#include "host/daemon/http_private.h"

#include "core/log.h"
#include "core/mem.h"
#include "core/progress.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

enum { CONNECTION_MEMORY = 65536, IDLE_TIMEOUT_S = 60 };

weft_err weft_http_server_create(const weft_http_house *house, weft_http_server **server, weft_error *err)
{
    weft_http_server *const s = weft_alloc(1, sizeof *s, err);
    if (!s)
        return WEFT_ERR_NOMEM;
    s->house = *house;
    s->started_s = weft_clock_s();
    *server = s;
    return WEFT_OK;
}

void weft_http_server_destroy(weft_http_server *server)
{
    if (!server)
        return;
    weft_watchers_end(server); /* libmicrohttpd does not stop with connections that sleep */
    for (int i = 0; i < server->n_listeners; i++) {
        weft_loop_forget(server->house.loop, server->listeners[i].epoll);
        MHD_stop_daemon(server->listeners[i].mhd);
    }
    weft_free(server);
}

/* ---- connections ---- */

static void identify(weft_http_connection *c)
{
    struct ucred peer = {.uid = (uid_t)-1};
    socklen_t n = sizeof peer;
    if (c->listener->tcp) {
        snprintf(c->owner, sizeof c->owner, "tcp");
        return;
    }
    if (getsockopt(c->fd, SOL_SOCKET, SO_PEERCRED, &peer, &n) != 0)
        peer.uid = (uid_t)-1;
    c->uid = peer.uid;
    c->own_user = peer.uid == geteuid() || peer.uid == 0;
    snprintf(c->owner, sizeof c->owner, "uid %u", (unsigned)peer.uid);
    weft_explain("connection of process %d, %s", (int)peer.pid, c->owner);
}

static void begin_connection(weft_http_listener *listener, struct MHD_Connection *mhd, void **context)
{
    weft_http_server *const server = listener->server;
    const union MHD_ConnectionInfo *const info =
        MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_CONNECTION_FD);
    weft_http_connection *const c = info ? weft_alloc(1, sizeof *c, NULL) : NULL;
    *context = c;
    if (!c)
        return; /* weft_http_handle() refuses */
    *c = (weft_http_connection){.listener = listener, .fd = info->connect_fd, .waiting_s = weft_clock_s()};
    identify(c);
    c->link = &server->connections;
    c->next = server->connections;
    if (c->next)
        c->next->link = &c->next;
    server->connections = c;
    if (++server->n_connections > WEFT_HTTP_CONNECTIONS)
        weft_http_turn_away(c, 503, "too_many_connections", "too many connections; try again later");
}

static void on_connection(void *context, struct MHD_Connection *mhd, void **socket_context,
                          enum MHD_ConnectionNotificationCode what)
{
    weft_http_listener *const listener = context;
    weft_http_connection *const c = *socket_context;
    if (what == MHD_CONNECTION_NOTIFY_STARTED) {
        begin_connection(listener, mhd, socket_context);
    } else if (c) {
        *c->link = c->next;
        if (c->next)
            c->next->link = c->link;
        listener->server->n_connections--;
        weft_free(c);
        *socket_context = NULL;
    }
}

static void end_slow_requests(weft_http_server *server, double now_s)
{
    weft_http_connection *next;
    for (weft_http_connection *c = server->connections; c; c = next) {
        next = c->next;
        if (c->waiting_s > 0 && now_s - c->waiting_s > WEFT_HTTP_REQUEST_S) {
            weft_http_turn_away(c, 408, "too_slow", "the request did not come in time");
        }
    }
}

/* ---- listening ---- */

static size_t keep_escapes(void *context, struct MHD_Connection *mhd, char *text)
{
    (void)context, (void)mhd;
    return strlen(text); /* weft_http_decode() does it, and refuses what is no text */
}

WEFT_PRINTF(2, 0) static void on_mhd_log(void *context, const char *format, va_list args)
{
    char line[600];
    (void)context;
    vsnprintf(line, sizeof line, format, args);
    line[strcspn(line, "\r\n")] = '\0';
    weft_explain("http: %s", line);
}

static void on_ready(void *context, uint32_t events)
{
    const weft_http_listener *const listener = context;
    (void)events;
    MHD_run(listener->mhd);
}

static void note_address(weft_http_listener *l, int fd)
{
    union {
        struct sockaddr any;
        struct sockaddr_in v4;
        struct sockaddr_in6 v6;
        struct sockaddr_storage room;
    } a = {0};
    socklen_t n = sizeof a;
    char text[INET6_ADDRSTRLEN] = "";
    if (!l->tcp || getsockname(fd, &a.any, &n) != 0)
        return;
    if (a.any.sa_family == AF_INET6) {
        l->port = ntohs(a.v6.sin6_port);
        inet_ntop(AF_INET6, &a.v6.sin6_addr, text, sizeof text);
        snprintf(l->address, sizeof l->address, "[%s]", text);
    } else {
        l->port = ntohs(a.v4.sin_port);
        inet_ntop(AF_INET, &a.v4.sin_addr, text, sizeof text);
        snprintf(l->address, sizeof l->address, "%s", text);
    }
}

weft_err weft_http_server_listen(weft_http_server *server, int fd, bool tcp, weft_error *err)
{
    if (server->n_listeners == WEFT_HTTP_LISTENERS)
        return weft_fail(err, WEFT_ERR_RANGE, "more than %d sockets to listen on", WEFT_HTTP_LISTENERS);
    weft_http_listener *const l = &server->listeners[server->n_listeners];
    const char *const certificate = server->house.tls_certificate;
    *l = (weft_http_listener){.server = server, .tcp = tcp, .tls = tcp && certificate};
    note_address(l, fd);
    const struct MHD_OptionItem tls[] = {
        {l->tls ? MHD_OPTION_HTTPS_MEM_CERT : MHD_OPTION_END, 0, (void *)(uintptr_t)certificate},
        {MHD_OPTION_HTTPS_MEM_KEY, 0, (void *)(uintptr_t)server->house.tls_key},
        {MHD_OPTION_END, 0, NULL},
    };
    l->mhd = MHD_start_daemon(
        MHD_USE_EPOLL | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ERROR_LOG | (l->tls ? MHD_USE_TLS : 0U), 0, NULL,
        NULL, weft_http_handle, l, MHD_OPTION_EXTERNAL_LOGGER, on_mhd_log, NULL, MHD_OPTION_LISTEN_SOCKET, fd,
        MHD_OPTION_NOTIFY_COMPLETED, weft_http_completed, l, MHD_OPTION_NOTIFY_CONNECTION, on_connection, l,
        MHD_OPTION_UNESCAPE_CALLBACK, keep_escapes, NULL, MHD_OPTION_CONNECTION_MEMORY_LIMIT,
        (size_t)CONNECTION_MEMORY, MHD_OPTION_CONNECTION_LIMIT, (unsigned)(WEFT_HTTP_CONNECTIONS + 64),
        MHD_OPTION_CONNECTION_TIMEOUT, (unsigned)IDLE_TIMEOUT_S, MHD_OPTION_ARRAY, tls, MHD_OPTION_END);
    const union MHD_DaemonInfo *const info =
        l->mhd ? MHD_get_daemon_info(l->mhd, MHD_DAEMON_INFO_EPOLL_FD) : NULL;
    if (!info) {
        if (l->mhd)
            MHD_stop_daemon(l->mhd);
        return weft_fail(err, WEFT_ERR_IO, "the HTTP server does not start%s",
                         l->tls ? "; are certificate and key PEM files that fit?" : "");
    }
    l->epoll = info->epoll_fd;
    server->n_listeners++;
    return weft_loop_watch(server->house.loop, l->epoll, EPOLLIN, on_ready, l, err);
}

void weft_http_server_tick(weft_http_server *server)
{
    const double now_s = weft_clock_s();
    weft_watchers_tick(server, now_s);
    end_slow_requests(server, now_s);
    for (int i = 0; i < server->n_listeners; i++)
        MHD_run(server->listeners[i].mhd);
}

int weft_http_server_timeout(weft_http_server *server, int most_ms)
{
    int timeout_ms = most_ms;
    for (int i = 0; i < server->n_listeners; i++) {
        MHD_UNSIGNED_LONG_LONG ms;
        if (MHD_get_timeout(server->listeners[i].mhd, &ms) == MHD_YES &&
            ms < (MHD_UNSIGNED_LONG_LONG)timeout_ms)
            timeout_ms = (int)ms;
    }
    return timeout_ms;
}
