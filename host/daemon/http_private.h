/** What the parts of the HTTP server share: connections, requests, replies, the table of routes. */
#ifndef WEFT_HOST_DAEMON_HTTP_PRIVATE_H
#define WEFT_HOST_DAEMON_HTTP_PRIVATE_H

#include "host/daemon/http_server.h"
#include "host/daemon/job_request.h"

#include <jansson.h>
#include <microhttpd.h>
#include <stdint.h>
#include <sys/types.h>

enum { WEFT_HTTP_LISTENERS = 4, WEFT_HTTP_HEADER_BYTES = 16384, WEFT_HTTP_HEADERS = 64 };

typedef struct weft_http_listener {
    weft_http_server *server;
    struct MHD_Daemon *mhd;
    int epoll; /* of mhd */
    bool tcp, tls;
    int port; /* of TCP */
    char address[64];
} weft_http_listener;

/** A client's connection; one request after the other. */
typedef struct weft_http_connection {
    struct weft_http_connection *next, **link; /* of the server's list */
    weft_http_listener *listener;
    int fd;
    double waiting_s; /* since when a whole request is awaited; 0: one is being answered */
    uid_t uid;        /* of the client, on the Unix socket */
    bool own_user;    /* on the Unix socket, and the daemon's own user or root */
    char owner[32];   /* "uid 1000", "tcp" */
} weft_http_connection;

struct weft_watcher; /* http_watch.c */

struct weft_http_server {
    weft_http_house house;
    int n_listeners;
    weft_http_listener listeners[WEFT_HTTP_LISTENERS];
    weft_http_connection *connections;
    int n_connections;
    struct weft_watcher *watchers;
    double started_s;
};

typedef struct weft_http_request {
    weft_http_server *server;
    weft_http_connection *connection;
    struct MHD_Connection *mhd;
    const struct weft_route *route; /* NULL: answered already */
    char *url, *path;               /* as it came; decoded */
    const char *tail;               /* what {id} or {path} of the route stands for, in path */
    int64_t id;                     /* of {id} */
    char *body;
    size_t n_body;
    bool answered, too_large;
} weft_http_request;

typedef enum MHD_Result weft_route_fn(weft_http_request *request);

typedef struct weft_route {
    const char *method; /* "GET": also HEAD */
    const char *path;   /* "/v1/jobs/{id}/log"; {id} is a number, {path} the rest */
    const char *name;   /* operationId */
    weft_route_fn *answer;
    bool body; /* takes a JSON body */
} weft_route;

/** All routes; ends with {0}. */
extern const weft_route weft_routes[];

/** The route of a path, filling tail and id.  @param allowed  gets the methods of the path when none fits;
 *  empty: no such path */
const weft_route *weft_route_find(const char *method, const char *path, const char **tail, int64_t *id,
                                  char allowed[64]);

/** Percent-decodes a path or a value of a query; NULL unless it is whole, UTF-8 and without control
 * characters. */
char *weft_http_decode(const char *text, bool plus_is_blank);

/** Value of a query parameter, decoded, on the heap; *present tells absent from empty.
 *  @return NULL when absent or not decodable (then *present is true) */
char *weft_http_query(const weft_http_request *request, const char *key, bool *present);
/** A whole number of the query in [min, max]; `value` stays when it is absent.  @return false after answering
 * 400 */
bool weft_http_query_int(weft_http_request *request, const char *key, int min, int max, int *value,
                         enum MHD_Result *result);

/* -- http_reply.c */

/** Answers with a JSON value, which is released. */
enum MHD_Result weft_reply_json(weft_http_request *request, unsigned status, json_t *value);
/** Answers with {"error":...}. */
enum MHD_Result weft_reply_problem(weft_http_request *request, unsigned status, const char *code,
                                   const char *format, ...) WEFT_PRINTF(4, 5);
/** Answers for a failed call. */
enum MHD_Result weft_reply_error(weft_http_request *request, weft_err status, const weft_error *error);
/** Answers with a response that is released; `type` may be NULL. */
enum MHD_Result weft_reply(weft_http_request *request, unsigned status, struct MHD_Response *response,
                           const char *type);
/** The text of an error, without any connection, for one that has sent no request; free(). */
char *weft_reply_text(unsigned status, const char *code, const char *message);

/* -- http_refuse.c */

/** MHD_queue_response() of the library, for answers of ours; one that is called by that name is the library's
 *  own and is replaced. */
enum MHD_Result weft_http_queue(struct MHD_Connection *mhd, unsigned status, struct MHD_Response *response);
/** Answers past the library, for a client that has no request that could be answered, and hangs up.  Under
 *  TLS it is only hung up on. */
void weft_http_turn_away(weft_http_connection *connection, unsigned status, const char *code,
                         const char *message);

/* -- http_request.c: callbacks of libmicrohttpd */

enum MHD_Result weft_http_handle(void *listener, struct MHD_Connection *mhd, const char *url,
                                 const char *method, const char *version, const char *upload,
                                 size_t *n_upload, void **request);
void weft_http_completed(void *listener, struct MHD_Connection *mhd, void **request,
                         enum MHD_RequestTerminationCode how);

/* -- http_watch.c */

void weft_watchers_tick(weft_http_server *server, double now_s);
/** Hangs up on all of them. */
void weft_watchers_end(weft_http_server *server);

/* -- routes_*.c */

weft_route_fn weft_route_info, weft_route_openapi, weft_route_commands;
weft_route_fn weft_route_jobs_list, weft_route_jobs_add, weft_route_job_get, weft_route_job_remove,
    weft_route_job_log, weft_route_job_cancel, weft_route_job_resume;
weft_route_fn weft_route_events, weft_route_live, weft_route_live_picture, weft_route_live_stream;
weft_route_fn weft_route_library_list, weft_route_library_item, weft_route_file;

#endif
