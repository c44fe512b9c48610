/**
 * HTTP on the daemon's sockets: libmicrohttpd, driven by the one loop.
 *
 * What a request must pass before a route sees it, in this order: a connection among at most
 * WEFT_HTTP_CONNECTIONS; its whole request within WEFT_HTTP_REQUEST_S seconds; headers of at most 16 KiB; a
 * Host (and Origin) that is ours; on TCP the token; a known path and method; a body of at most 64 KiB of
 * JSON.  What fails gets a JSON error: {"error":{"status":421,"code":"foreign_host","message":"..."}}.
 */
#ifndef WEFT_HOST_DAEMON_HTTP_SERVER_H
#define WEFT_HOST_DAEMON_HTTP_SERVER_H

#include "host/daemon/events.h"
#include "host/daemon/live.h"
#include "host/daemon/queue.h"
#include "host/library/library_db.h"
#include "host/process/loop.h"

#include <stdbool.h>

#define WEFT_HTTP_CONNECTIONS 256
#define WEFT_HTTP_REQUEST_S   10.0
#define WEFT_HTTP_WATCHER_S   10.0 /* a watcher that takes nothing for so long is dropped */

/** What the routes work on; all of it outlives the server. */
typedef struct weft_http_house {
    weft_loop *loop;
    weft_library_db *db;
    weft_queue *queue;
    weft_events *events;
    weft_live *live;
    const char *rig, *port, *camera; /* devices for jobs that name none; NULL */
    const char *token;               /* for TCP; NULL: nobody may */
    const char *const *hosts; /* names by which TCP clients may call us, besides the usual; ends with NULL */
    const char *tls_certificate, *tls_key; /* PEM texts; NULL: no TLS */
} weft_http_house;

typedef struct weft_http_server weft_http_server;

weft_err weft_http_server_create(const weft_http_house *house, weft_http_server **server, weft_error *err);
/** Closes all connections.  NULL is fine. */
void weft_http_server_destroy(weft_http_server *server);

/** Serves a listening socket, which becomes the server's.  @param tcp  token, and TLS when there is a
 * certificate */
weft_err weft_http_server_listen(weft_http_server *server, int fd, bool tcp, weft_error *err);

/** Wakes watchers that have something to get, drops those that do not take it, ends requests that do not
 * come. Call after each turn of the loop. */
void weft_http_server_tick(weft_http_server *server);

/** When it must be called again at the latest, in ms; at most `most_ms`. */
int weft_http_server_timeout(weft_http_server *server, int most_ms);

#endif
